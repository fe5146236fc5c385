"""The case of De Vivo et al., IV-B: along a valley, ranges with air, noise and reflections; who hears what.

Big Tujunga canyon and a YUMA almanac stand in for the paper's ground and satellites, as in paper_case. What is
simulated is the truth; what a filter may know of it is in ``Case`` under names that say so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
import numpy.typing as npt

import gnss
import navigation
from benchmarks.visibility.paper_case import cut_out, paper_window
from benchmarks.visibility.paper_flight import RATE_HZ, UPDATE_S, valley_path
from terrain import ElevationGrid, to_lon_lat
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, min_visible_altitude, satellites, visible_sets
from visibility.dilution import DopKind
from visibility.sight import reflections

__all__ = ["Case", "Leg", "Noise", "drone_case", "heard", "satellite_case"]

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.bool_]

STEP_S = 1.0
# a mountainside farther away than this scatters too weakly to be heard
REFLECTION_REACH_M = 1000.0
# drones hover over the highest ground within reach of six places evenly along the flight
DRONES, DRONE_ABOVE_GROUND_M, DRONE_REACH_M = 6, 250.0, 1500.0


@dataclass(frozen=True, slots=True)
class Noise:
    """One-sigma errors, metres; of the clock m²/s³. zenith_m: what a standard atmosphere is wrong by, to the zenith."""

    clock_m: float
    receiver_m: float
    zenith_m: float
    drift_m2_per_s3: float

    def white_m2(self) -> float:
        """Variance of what is white: satellite clocks and receiver (eq. 36)."""
        return self.clock_m**2 + self.receiver_m**2


SATELLITE_NOISE = Noise(clock_m=2.0, receiver_m=1.0, zenith_m=0.1, drift_m2_per_s3=0.01)
DRONE_NOISE = Noise(clock_m=0.0, receiver_m=0.5, zenith_m=0.0, drift_m2_per_s3=0.0)


@dataclass(frozen=True, eq=False)
class Leg:
    """Epochs first to stop, during which the anchors stand still: who they are, and where they are in sight."""

    first: int
    stop: int
    surfaces: MinimumVisibleAltitude
    anchors_m: Array


@dataclass(frozen=True, eq=False)
class Case:
    """n epochs of a flight.

    points_m: (n, 3) the truth. Per leg, for its k anchors: in sight in truth, the excess of the reflection where not
    (NaN: nothing is heard), the delay of the air beyond a standard atmosphere that is wrong by one metre to the zenith.
    """

    grid: ElevationGrid
    times_s: Array
    points_m: Array
    legs: tuple[Leg, ...]
    in_sight: tuple[Flags, ...]
    excess_m: tuple[Array, ...]
    air_factor: tuple[Array, ...]
    noise: Noise
    kind: DopKind

    @property
    def has_clock(self) -> bool:
        return self.kind == "pseudorange"


def satellite_case(whole: ElevationGrid, almanac: gnss.Almanac, start: datetime, *, every: int = 1) -> Case:
    """The flight under the satellites of an almanac, one epoch a second; every: only each so many-th of them."""
    grid = paper_window(whole)
    points_m, times_s = _epochs(grid, every)
    leg_of = (times_s // UPDATE_S).astype(int)
    moments = [start + timedelta(seconds=(leg + 0.5) * UPDATE_S) for leg in range(int(leg_of[-1]) + 1)]
    eyes = satellites.satellite_eyes(whole, almanac, moments)
    legs: list[Leg] = []
    factors: list[Array] = []
    _, lat_deg = to_lon_lat(grid, points_m[:1, 0], points_m[:1, 1])
    air = navigation.Troposphere(math.radians(float(np.ravel(lat_deg)[0])), start.timetuple().tm_yday)
    for leg in range(len(moments)):
        here = np.flatnonzero(leg_of == leg)
        if not len(here):
            continue
        surfaces = cut_out(min_visible_altitude(whole, eyes.distant_anchors(leg)))
        sky = [anchor for anchor in surfaces.anchors if isinstance(anchor, DistantAnchor)]
        legs.append(_leg(here, surfaces))
        elevation = np.array([anchor.elevation_rad for anchor in sky])
        _, wet = navigation.niell_mapping(air, elevation, float(points_m[here, 2].mean()))
        factors.append(np.tile(wet, (len(here), 1)))
    return _case(grid, times_s, points_m, legs, factors, SATELLITE_NOISE, "pseudorange")


def drone_case(whole: ElevationGrid, *, every: int = 1) -> Case:
    """The same flight with six drones over the hills along it, and ranges without a clock."""
    grid = paper_window(whole)
    points_m, times_s = _epochs(grid, every)
    surfaces = min_visible_altitude(grid, drones(grid, points_m))
    legs = [_leg(np.arange(len(points_m)), surfaces)]
    return _case(grid, times_s, points_m, legs, [np.zeros((len(points_m), DRONES))], DRONE_NOISE, "ranging")


def drones(grid: ElevationGrid, points_m: Array) -> list[Anchor]:
    """Six drones over the hills beside the flight, from its start to its end."""
    east_m = grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols)
    north_m = grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows)
    placed = []
    for number in range(DRONES):
        here_m = points_m[int(number / (DRONES - 1) * (len(points_m) - 1))]
        near = np.hypot(*np.meshgrid(east_m - here_m[0], north_m - here_m[1])) <= DRONE_REACH_M
        row, col = np.unravel_index(np.argmax(np.where(near, grid.heights_m, -np.inf)), grid.shape)
        altitude_m = float(grid.heights_m[row, col]) + DRONE_ABOVE_GROUND_M
        placed.append(Anchor(f"D{number + 1}", float(east_m[col]), float(north_m[row]), altitude_m))
    return placed


def heard(case: Case, leg: int, epoch: int, draws: Draws) -> Array:
    """(s, k) what each of s receivers measures at an epoch of a leg; NaN = nothing."""
    here, row = case.legs[leg], epoch - case.legs[leg].first
    straight_m = np.linalg.norm(here.anchors_m - case.points_m[epoch], axis=1)
    late_m = np.where(case.in_sight[leg][row], 0.0, case.excess_m[leg][row])
    air_m = draws.zenith_m[:, None] * case.air_factor[leg][row]
    white_m = draws.generator.normal(0.0, math.sqrt(case.noise.white_m2()), (len(air_m), len(straight_m)))
    measured: Array = straight_m + late_m + air_m + draws.clock_m[:, [0]] + white_m
    return measured


class Draws:
    """What is drawn by chance for s receivers: the air of the day once, the clock as it goes on."""

    def __init__(self, case: Case, count: int, generator: np.random.Generator) -> None:
        self.generator = generator
        self.zenith_m = generator.normal(0.0, case.noise.zenith_m, count)
        self.clock_m = np.zeros((count, 2))
        if case.has_clock:
            self.clock_m = generator.normal(0.0, (100.0, 1.0), (count, 2))
        self._psd = case.noise.drift_m2_per_s3

    def advance(self, step_s: float) -> None:
        """Let the clocks drift on."""
        power = self._psd * np.array([[step_s**3 / 3.0, step_s**2 / 2.0], [step_s**2 / 2.0, step_s]])
        self.clock_m[:, 0] += step_s * self.clock_m[:, 1]
        if self._psd > 0.0:
            self.clock_m += self.generator.multivariate_normal(np.zeros(2), power, len(self.clock_m))


def _epochs(grid: ElevationGrid, every: int) -> tuple[Array, Array]:
    points_m = valley_path(grid)[:: int(RATE_HZ * STEP_S)][::every]
    return points_m, np.arange(len(points_m), dtype=np.float64) * STEP_S * every


def _leg(epochs: npt.NDArray[np.intp], surfaces: MinimumVisibleAltitude) -> Leg:
    anchors_m = [
        a.position_m(surfaces.grid) if isinstance(a, DistantAnchor) else (a.east_m, a.north_m, a.altitude_m)
        for a in surfaces.anchors
    ]
    return Leg(int(epochs[0]), int(epochs[-1]) + 1, surfaces, np.array(anchors_m))


def _case(
    grid: ElevationGrid, times_s: Array, points_m: Array, legs: Sequence[Leg], factors: Sequence[Array], noise: Noise,
    kind: DopKind,
) -> Case:  # fmt: skip
    in_sight, excess_m = [], []
    for leg in legs:
        here_m = points_m[leg.first : leg.stop]
        seen = visible_sets(leg.surfaces, here_m).visible()
        in_sight.append(seen)
        excess_m.append(reflections(leg.surfaces, here_m, ~seen, reach_m=REFLECTION_REACH_M).excess_m)
    return Case(grid, times_s, points_m, tuple(legs), tuple(in_sight), tuple(excess_m), tuple(factors), noise, kind)
