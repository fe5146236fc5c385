"""gps-sdr-sim's circle as a drive through a wood: a tactical unit, a clock that wanders, canopy, reflections, channels.

Channels are simulated as their correlators' sums (``tests.reference.correlator_sums``), which
tests/gnss/receiver/test_correlator_sums.py shows to be those of samples.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pyproj import CRS
from scipy.interpolate import CubicSpline

from gnss import (
    Ephemerides,
    GpsTime,
    LookAngles,
    Place,
    ReceiverClock,
    ecef_to_enu_m,
    enu_to_ecef_m,
    ephemeris_positions_ecef_m,
    instants,
    look_angles,
    read_rinex_navigation,
)
from gnss.receiver import BIT_S, BitSums, foretold_delays_s
from gnss.sky import place_of_ecef
from navigation.inertial import IMU_PRESETS, ImuLog, InertialStart, TangentFrame, imu_log, quaternion_of_angles
from terrain import ElevationGrid, to_grid_frame
from tests.reference import correlator_sums
from tests.reference.inertial import Drive, along
from visibility.cover.canopy import Canopy
from visibility.satellites import expected_sky
from visibility.signal import Foliage, with_foliage

__all__ = ["BEGIN", "MOTION", "NAVIGATION", "DeepDrive", "Wood"]

Array = npt.NDArray[np.float64]
DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
MOTION, NAVIGATION = DATA / "if/gps-sdr-sim_circle.csv", DATA / "rtk/simulated/rover.nav"
BEGIN = GpsTime(1823, 518_400.0)
LIGHT, STEP_S, LEVER_M = 299_792_458.0, 0.01, (0.2, -0.1, 1.0)
MASK_RAD = math.radians(8.0)
BIAS_M = 0.15  # what air and orbits leave of each range after corrections


@dataclass(frozen=True)
class Wood:
    """Trees from from_s on, 0 = none: crowns of top_m, denser by factor; share of seconds in which a satellite begins
    to be heard by a reflection only."""

    from_s: float = math.inf
    top_m: float = 22.0
    factor: float = 1.0
    reflected: float = 0.0


class Circle(Drive):
    """The motion of a file as a smooth path, the vehicle along its course."""

    def __init__(self, enu_m: Array, known_s: Array, duration_s: float) -> None:
        self.position = CubicSpline(known_s, enu_m)
        self.velocity = self.position.derivative()
        self.times_s = np.arange(0.0, duration_s + 1e-9, STEP_S)
        fine = np.arange(0.0, known_s[-1], 0.1)
        east, north, _ = self.velocity(fine).T
        heading = CubicSpline(fine, np.unwrap(np.arctan2(east, north)))
        self._angles = heading, np.zeros_like, np.zeros_like


class DeepDrive:
    """One drawing of the drive: truth, readings of a unit, and what its channels hear.

    bias_m: one sigma of a range's own error, constant over minutes.
    """

    def __init__(
        self, seed: int, duration_s: float, wood: Wood, unit: str = "tactical", bias_m: float = BIAS_M
    ) -> None:
        self.rng = np.random.default_rng(seed)
        self.wood, self.seed, self.duration_s, self.noise = wood, seed, duration_s, IMU_PRESETS[unit]
        table = np.loadtxt(MOTION, delimiter=",")
        self.origin = place_of_ecef(table[:, 1:].mean(axis=0))
        # places are told to a millimetre: a second apart that is no acceleration
        self.drive = Circle(ecef_to_enu_m(self.origin, table[::10, 1:]), table[::10, 0], duration_s)
        origin = self.origin
        latitude = math.radians(origin.lat_deg)
        self.frame = TangentFrame(latitude, math.radians(origin.lon_deg), origin.height_m)
        self.ephemerides: Ephemerides = read_rinex_navigation(NAVIGATION)
        names = self.ephemerides.healthy_ids
        seen = self._sky(names)
        high = np.flatnonzero(seen.elevation_rad > MASK_RAD)
        self.names = tuple(names[n] for n in high)
        self.prns = tuple(int(name[1:]) for name in self.names)
        self.azimuth_rad, self.elevation_rad = seen.azimuth_rad[high], seen.elevation_rad[high]
        self.biases_m = dict(zip(self.prns, bias_m * self.rng.normal(size=len(high)), strict=True))
        # of a good oscillator: white noise and a walk of its frequency
        ticks = np.arange(-1.0, duration_s + 3.0, 0.02)
        drift = 2e-7 + np.cumsum(self.rng.normal(0.0, 1e-11 * math.sqrt(0.02), len(ticks)))
        ahead = np.cumsum(drift * 0.02 + self.rng.normal(0.0, 3e-11 * math.sqrt(0.02), len(ticks)))
        self.ticks, self.ahead = ticks, 4e-5 + ahead
        self.reflections = self._reflections()
        self._true: dict[tuple[int, int], Array] = {}

    def _sky(self, names: tuple[str, ...]) -> LookAngles:
        return look_angles(self.origin, ephemeris_positions_ecef_m(self.ephemerides, names, instants(BEGIN))[:, 0])

    @property
    def clock(self) -> ReceiverClock:
        """A first guess, 5 m and 0.05 m/s off."""
        drift = (np.interp(0.5, self.ticks, self.ahead) - np.interp(0.0, self.ticks, self.ahead)) / 0.5
        return ReceiverClock(float(np.interp(0.0, self.ticks, self.ahead)) + 5.0 / LIGHT, float(drift) + 0.05 / LIGHT)

    @cached_property
    def log(self) -> ImuLog:
        """The unit's readings."""
        rng, noise, rate = np.random.default_rng(self.seed + 1000), self.noise, self.frame.body.rate_rad_per_s
        latitude = self.frame.latitude_rad
        turning = rate * np.array([0.0, math.cos(latitude), math.sin(latitude)])
        forces, rates = self.drive.readings(lambda at: along(self.frame.gravity_m_per_s2, at), turning)
        root = math.sqrt(STEP_S)
        forces += rng.normal(0.0, noise.force_bias_m_per_s2, 3)
        rates += rng.normal(0.0, noise.rate_bias_rad_per_s, 3)
        forces += rng.normal(0.0, noise.velocity_walk_m_per_s_sqrt_s / root, forces.shape)
        rates += rng.normal(0.0, noise.angle_walk_rad_per_sqrt_s / root, rates.shape)
        return imu_log(self.drive.times_s, forces, rates)

    @cached_property
    def start(self) -> InertialStart:
        """What is believed at first, as a receiver under the open sky and its course tell."""
        rng = np.random.default_rng(self.seed + 2000)
        heading = float(self.drive.angles(np.zeros(1))[0, 0])
        off = np.radians([0.3, 0.3, 0.6])
        return InertialStart(
            self.drive.position(0.0) + rng.normal(0.0, 1.0, 3),
            self.drive.velocity(0.0) + rng.normal(0.0, 0.03, 3),
            quaternion_of_angles(heading + rng.normal(0.0, off[2]), rng.normal(0.0, off[1]), rng.normal(0.0, off[0])),
            position_sigma_m=1.0,
            velocity_sigma_m_per_s=0.03,
            attitude_sigma_rad=off,
            lever_arm_m=LEVER_M,
        )

    def antenna_m(self, times_s: Array) -> Array:
        """(k, 3) in the frame."""
        found: Array = self.drive.position(times_s) + self.drive.attitude(times_s).apply(LEVER_M)
        return found

    @cached_property
    def losses_db(self) -> Array:
        """(seconds, satellites) in trees, by the models of ``visibility.signal`` over a wood of gaps and crowns."""
        count = math.ceil(self.duration_s) + 2
        if math.isinf(self.wood.from_s):
            return np.zeros((count, len(self.prns)))
        rng, posts, cell_m = np.random.default_rng(7), 161, 4.0
        tops = rng.gamma(6.0, self.wood.top_m / 6.0, (posts // 2 + 1, posts // 2 + 1)).clip(0.0, 1.6 * self.wood.top_m)
        tops = np.kron(tops, np.ones((2, 2)))[:posts, :posts]
        zone, ground = CRS.from_epsg(32653), np.zeros((posts, posts), np.float32)
        middle = to_grid_frame(
            ElevationGrid(ground, cell_m, cell_m, crs=zone), self.origin.lon_deg, self.origin.lat_deg
        )
        half_m = 0.5 * (posts - 1) * cell_m
        west_m, border_m = float(middle[0]) - half_m, float(middle[1]) + half_m
        bare = ElevationGrid(ground, cell_m, cell_m, west_m, border_m, zone)
        grid = with_foliage(bare, Foliage(Canopy(bare, tops.astype(np.float32), (0.2 * tops).astype(np.float32))))
        places_m = self.antenna_m(np.arange(float(count)))
        losses = np.zeros((count, len(self.prns)))
        for second, place_m in enumerate(places_m):
            if second >= self.wood.from_s:
                place: Place = place_of_ecef(enu_to_ecef_m(self.origin, place_m))
                losses[second] = expected_sky(grid, place, self.azimuth_rad, self.elevation_rad, 2.0).loss_db
        return self.wood.factor * losses

    def _reflections(self) -> dict[tuple[int, int], tuple[float, float]]:
        """(metres more, metres per second more) by satellite and second."""
        found: dict[tuple[int, int], tuple[float, float]] = {}
        if self.wood.reflected == 0.0:
            return found
        for prn in self.prns:
            second = self.wood.from_s
            while second < self.duration_s:
                second += self.rng.exponential(1.0 / self.wood.reflected)
                more = self.rng.uniform(5.0, 60.0), self.rng.normal(0.0, 0.3)
                for held in range(self.rng.integers(1, 5)):
                    found[prn, int(second) + held] = more
        return found

    def true_delays_s(self, prn: int, begin_s: float, times_s: Array) -> Array:
        """(k,) from satellite to samples."""
        second = round(begin_s)
        if (second, prn) not in self._true:
            places_m = enu_to_ecef_m(self.origin, self.antenna_m(begin_s + times_s))
            ahead = np.interp(begin_s + times_s, self.ticks, self.ahead)
            told = foretold_delays_s(
                self.ephemerides, f"G{prn:02d}", BEGIN.plus(begin_s), times_s, places_m, clock_s=ahead
            )
            more_m, more_m_per_s = self.reflections.get((prn, second), (0.0, 0.0))
            self._true[second, prn] = told + (self.biases_m[prn] + more_m + more_m_per_s * times_s) / LIGHT
        return self._true[second, prn]

    def correlate(self, prn: int, begin_s: float, times_s: Array, delays_s: Array) -> BitSums:
        """The sums that a channel's correlator gives beside foretold delays."""
        number = self.prns.index(prn)
        rng = np.random.default_rng((self.seed, round(begin_s), prn))
        true_s = self.true_delays_s(prn, begin_s, times_s)
        sent = times_s - delays_s + (BEGIN.second_of_week % BIT_S + begin_s) % BIT_S
        first, end = math.ceil(sent[0] / BIT_S), math.floor(sent[-1] / BIT_S)
        edges_s = np.interp(np.arange(first, end + 1) * BIT_S, sent, times_s)
        off_s = np.interp(edges_s, times_s, true_s - delays_s)
        open_db_hz = 45.0 - 5.0 * (1.0 - math.sin(self.elevation_rad[number]))
        at = begin_s + 0.5 * (edges_s[1:] + edges_s[:-1])
        loss_db = np.interp(at, np.arange(len(self.losses_db)), self.losses_db[:, number])
        bits = rng.choice([-1, 1], len(edges_s) - 1)
        turns = np.random.default_rng((self.seed, prn)).uniform()
        sums = correlator_sums.sums(off_s, open_db_hz - loss_db, bits, turns, rng)
        return BitSums(prn, sums, edges_s, times_s, delays_s)
