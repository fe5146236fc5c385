"""What lies ahead of a rover that knows its path: where it hears too few anchors, how unsure it will be, what to do.

Sight along the path is foretold from the map at the path itself, with the map's errors folded in; anchors that the
detector finds occluded for good count as hidden wherever the map has them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from detection import PositionFix, RangingAnchor
from navigation import MotionNoise, predict_bubble
from planning.errors import WatchError
from terrain import ElevationGrid, height_at
from visibility import Curvature, lines_of_sight
from visibility.dilution import surface_normals
from visibility.sight import SightDoubt
from visibility.sight.roofs import roofs_over
from visibility.signal import Radio

from .arrivals import arrivals
from .forecasts import DEFAULT_ERRORS, GroundErrors, mixed_with_doubts, sight_probability
from .obstructions import ObstructedStretch, obstructions, runs_along

__all__ = [
    "Advice",
    "DarkStretch",
    "Drive",
    "SpeedAdvice",
    "advise",
    "distance_along_m",
]

Floats = npt.NDArray[np.float64]

MOST_POINTS = 240
SPEEDS = (0.5, 0.75, 1.5, 2.0)  # of the speed that is foreseen, which are tried
WORTH = 0.8  # of the largest bubble: another speed that leaves no less is none to speak of
NEAR_PATH_M = 5.0  # places of a path that are so much alike near are told apart by where the rover was last


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """A path that a rover is to follow, and what it needs on it.

    path_m: (n, 2) east, north, in the frame of the map. speed_m_per_s: foreseen; max_speed_m_per_s: possible.
    min_anchors: a stretch with fewer usable ones is told. horizon_m: how far ahead is looked. interval_s: between
    ranges. epsilon: sigmas in a bubble. usable: probability from which an anchor counts: of sight, and that its signal
    arrives. max_slope_rad: of ground that the rover can drive over, for another path. Raises WatchError.
    """

    path_m: Floats
    speed_m_per_s: float = 1.0
    max_speed_m_per_s: float = 2.0
    min_anchors: int = 4
    horizon_m: float = 500.0
    interval_s: float = 1.0
    epsilon: float = 3.0
    usable: float = 0.5
    max_slope_rad: float = math.radians(25.0)
    motion: MotionNoise = field(default_factory=MotionNoise)

    def __post_init__(self) -> None:
        path_m = np.array(self.path_m, np.float64)
        if path_m.ndim != 2 or path_m.shape[1] != 2 or len(path_m) < 2 or not np.isfinite(path_m).all():
            raise WatchError("A path needs at least two places (east, north), all finite.")
        path_m.setflags(write=False)
        object.__setattr__(self, "path_m", path_m)
        for name in ("speed_m_per_s", "max_speed_m_per_s", "horizon_m", "interval_s", "epsilon", "max_slope_rad"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise WatchError(f"{name} must be a number > 0, not {getattr(self, name)}.")
        if self.min_anchors < 1 or not 0.0 < self.usable < 1.0:
            raise WatchError("min_anchors must be at least 1, and usable between 0 and 1.")

    @property
    def along_m(self) -> Floats:
        """(n,) metres along the path up to each of its places."""
        return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(self.path_m, axis=0).T))])


@dataclass(frozen=True, slots=True)
class DarkStretch:
    """Where fewer anchors than needed will be usable.

    from_m, to_m: metres along the path. in_s, for_s: seconds until it begins, and that it takes, at the foreseen speed.
    fewest: how few anchors are usable where there are fewest. hidden: ids that are not usable somewhere in it.
    bubble_m: the largest bubble in it.
    """

    from_m: float
    to_m: float
    in_s: float
    for_s: float
    fewest: int
    hidden: tuple[str, ...]
    bubble_m: float


@dataclass(frozen=True, slots=True)
class SpeedAdvice:
    """Another speed over the way ahead, and the largest bubble with it and without."""

    speed_m_per_s: float
    bubble_m: float
    bubble_before_m: float
    sentence: str


@dataclass(frozen=True, slots=True, eq=False)
class Advice:
    """What is ahead. at_m: where on the path the rover is; off_path_m: how far beside it.

    along_m: (k,) metres along the path; usable: (k,) anchors; bubble_m: (k,) radius, metres. stretches: in the order of
    the way. speed: a better one, if one is. obstructed: where the path leads through a building, over unknown ground or
    off the map, in the order of the way; no anchor counts there.
    """

    at_m: float
    off_path_m: float
    along_m: Floats
    usable: npt.NDArray[np.int64]
    bubble_m: Floats
    stretches: tuple[DarkStretch, ...]
    speed: SpeedAdvice | None
    obstructed: tuple[ObstructedStretch, ...] = ()


def distance_along_m(drive: Drive, place_m: Sequence[float], last_m: float | None = None) -> tuple[float, float]:
    """(metres along the path of its place nearest to a rover, how far that is); last_m: where it was before."""
    begin, step = drive.path_m[:-1], np.diff(drive.path_m, axis=0)
    rover_m = np.asarray(place_m, np.float64)[:2]
    length2 = np.maximum((step * step).sum(axis=1), 1e-12)
    share = (((rover_m - begin) * step).sum(axis=1) / length2).clip(0.0, 1.0)
    off_m = np.hypot(*(begin + share[:, None] * step - rover_m).T)
    along_m = drive.along_m[:-1] + share * np.sqrt(length2)
    near = np.flatnonzero(off_m <= off_m.min() + NEAR_PATH_M)
    best = near[np.argmin(off_m[near] if last_m is None else np.abs(along_m[near] - last_m))]
    return float(along_m[best]), float(off_m[best])


def advise(
    grid: ElevationGrid,
    drive: Drive,
    place: PositionFix,
    anchors: Sequence[RangingAnchor],
    *,
    antenna_above_ground_m: float = 1.5,
    range_sigma_m: float = 0.1,
    occluded: Collection[str] = (),
    last_m: float | None = None,
    errors: GroundErrors = DEFAULT_ERRORS,
    curvature: Curvature | None = None,
    doubts: Mapping[str, tuple[SightDoubt, ...]] | None = None,
    radios: Mapping[str, Radio] | None = None,
) -> Advice:
    """What lies ahead of a rover at a place (2 or 3 dimensions), with its covariance, on its path.

    occluded: ids of anchors that count as hidden. last_m: where on the path it was before. doubts: by anchor, what
    ranges said against the map. radios: by anchor; its signal must arrive too. Places of the path that are outside the
    map or on unknown ground have no usable anchor. Raises WatchError, SignalError.
    """
    if not anchors:
        raise WatchError("Advice needs anchors.")
    at_m, off_path_m = distance_along_m(drive, place.position_m.tolist(), last_m)
    end_m = min(at_m + drive.horizon_m, float(drive.along_m[-1]))
    step_m = max(0.5 * min(grid.cell_east_m, grid.cell_north_m), (end_m - at_m) / MOST_POINTS)
    along_m = np.append(np.arange(at_m, end_m, step_m), end_m)
    level_m = np.column_stack([np.interp(along_m, drive.along_m, drive.path_m[:, axis]) for axis in (0, 1)])
    points_m = np.column_stack([level_m, height_at(grid, *level_m.T) + antenna_above_ground_m])
    inside = roofs_over(grid, *level_m.T) > points_m[:, 2]
    known = np.isfinite(points_m[:, 2]) & ~inside
    points_m[:, 2] = np.where(np.isfinite(points_m[:, 2]), points_m[:, 2], 0.0)
    anchors_m = np.array([(one.east_m, one.north_m, one.altitude_m) for one in anchors])
    usable = np.zeros((len(points_m), len(anchors)), np.bool_)
    if known.any():
        sees = _p_sight(grid, points_m[known], anchors_m, errors, curvature)
        if radios:
            heard = arrivals(grid, points_m[known], anchors_m, [radios.get(one.id) for one in anchors], curvature)
            sees = np.where(np.isnan(heard.p_usable), sees, sees * heard.p_usable)
        sees = mixed_with_doubts(sees, [one.id for one in anchors], doubts or {}, points_m[known])
        usable[known] = (sees >= drive.usable) & np.array([one.id not in occluded for one in anchors])
    sigmas_m = np.hypot(range_sigma_m, [one.sigma_m for one in anchors])
    ways = _Ways(grid, points_m, along_m - at_m, anchors_m, usable, sigmas_m, place, drive, errors.dem_sigma_m)
    bubble_m = ways.bubble_m(drive.speed_m_per_s)
    ids = [one.id for one in anchors]
    stretches = _stretches(drive, at_m, along_m, usable, ids, bubble_m)
    speed = _better_speed(ways, drive, bubble_m) if stretches else None
    obstructed = obstructions(grid, along_m, level_m, known, inside)
    return Advice(at_m, off_path_m, along_m, usable.sum(axis=1), bubble_m, stretches, speed, obstructed)


def _p_sight(
    grid: ElevationGrid, points_m: Floats, anchors_m: Floats, errors: GroundErrors, curvature: Curvature | None
) -> Floats:
    """(m, k) probability of sight between points and anchors; 0 over unknown ground."""
    k = len(anchors_m)
    sight = lines_of_sight(
        grid, np.repeat(points_m, k, axis=0), np.tile(anchors_m, (len(points_m), 1)), curvature=curvature
    )
    clearance_m = np.where(sight.over_unknown, -np.inf, sight.clearance_m).reshape(-1, k)
    away_m = np.nan_to_num(sight.blocking_distance_m).reshape(-1, k)
    reach_m = np.hypot(*(anchors_m[None, :, :2] - points_m[:, None, :2]).transpose(2, 0, 1))
    return sight_probability(clearance_m, away_m, reach_m, errors)


@dataclass(frozen=True, slots=True, eq=False)
class _Ways:
    """The way ahead at any speed: (n, 3) points, (n,) metres from here, (n, k) usable anchors, (k,) sigmas."""

    grid: ElevationGrid
    points_m: Floats
    ahead_m: Floats
    anchors_m: Floats
    usable: npt.NDArray[np.bool_]
    sigmas_m: Floats
    place: PositionFix
    drive: Drive
    dem_sigma_m: float

    def bubble_m(self, speed_m_per_s: float) -> Floats:
        """(n,) radius of the bubble when the rover drives so fast."""
        covariance = np.diag([0.0, 0.0, self.dem_sigma_m**2, 1.0, 1.0, 0.01])
        d = len(self.place.position_m)
        covariance[:d, :d] = self.place.covariance_m2
        normals = surface_normals(self.grid, self.points_m[:, 0], self.points_m[:, 1])
        slope = np.nan_to_num(-normals[:, :2] / normals[:, 2:])
        return predict_bubble(
            self.points_m, self.ahead_m / speed_m_per_s, self.anchors_m, self.usable, self.sigmas_m,
            motion=self.drive.motion, interval_s=self.drive.interval_s, initial_covariance=covariance,
            ground_slope=slope, ground_sigma_m=self.dem_sigma_m, epsilon=self.drive.epsilon,
        ).radius_m  # fmt: skip


def _stretches(
    drive: Drive, at_m: float, along_m: Floats, usable: npt.NDArray[np.bool_], ids: Sequence[str], bubble_m: Floats
) -> tuple[DarkStretch, ...]:
    count = usable.sum(axis=1)
    found = []
    for low_m, high_m, which in runs_along(count < drive.min_anchors, along_m):
        hidden: npt.NDArray[np.bool_] = np.logical_not(usable[which].all(axis=0))
        found.append(
            DarkStretch(
                low_m, high_m, (low_m - at_m) / drive.speed_m_per_s, (high_m - low_m) / drive.speed_m_per_s,
                int(count[which].min()), tuple(name for name, off in zip(ids, hidden.tolist(), strict=True) if off),
                float(bubble_m[which].max()),
            )
        )  # fmt: skip
    return tuple(found)


def _better_speed(ways: _Ways, drive: Drive, bubble_m: Floats) -> SpeedAdvice | None:
    """The speed nearest to the foreseen one that makes the largest bubble ahead clearly smaller."""
    before_m = float(bubble_m.max())
    for factor in sorted(SPEEDS, key=lambda factor: abs(math.log(factor))):
        speed = factor * drive.speed_m_per_s
        if speed > drive.max_speed_m_per_s:
            continue
        after_m = float(ways.bubble_m(speed).max())
        if after_m <= WORTH * before_m:
            how = "faster" if factor > 1.0 else "slower"
            bubbles = f"{after_m:.1f} m, not {before_m:.1f}"
            sentence = f"Drive {how}, at {speed:.2g} m/s: the largest bubble ahead is {bubbles}."
            return SpeedAdvice(speed, after_m, before_m, sentence)
    return None
