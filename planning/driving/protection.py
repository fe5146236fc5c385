"""Protection levels over a map: how far off a position may be though nothing is noticed, foretold from geometry."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from navigation.monitor import ProtectionRisk, predict_protection
from planning.watching import GroundErrors
from planning.watching.forecasts import sight_probability
from terrain import ElevationGrid
from visibility import Anchor, AntennaLimits, Curvature, lines_of_sight

__all__ = ["ForetoldProtection", "protection_over_map", "within_reach"]

Array = npt.NDArray[np.float64]
POINTS_AT_ONCE = 20_000


@dataclass(frozen=True, eq=False)
class ForetoldProtection:
    """Of p points: horizontal_m, vertical_m (p,), inf where nothing can be promised, NaN where a point is none;
    unwatched (p,) probability of what no hypothesis covers; sight (p, k) probability that each anchor is in sight, NaN
    over unknown ground, where it counts as hidden. curvature: that was used."""

    horizontal_m: Array
    vertical_m: Array
    unwatched: Array
    sight: Array
    curvature: Curvature


def protection_over_map(
    grid: ElevationGrid,
    points_m: npt.ArrayLike,
    anchors: Sequence[Anchor],
    *,
    risk: ProtectionRisk | None = None,
    fault: float = 1e-3,
    least_sight: float = 0.5,
    height_sigma_m: float = math.inf,
    clock: bool = False,
    errors: GroundErrors | None = None,
    curvature: Curvature | None = None,
    progress: Callable[[float], None] | None = None,
) -> ForetoldProtection:
    """Levels at antennas (p, 3) east, north, altitude in the grid's frame, of ranges to anchors, or pseudoranges.

    Sight lines are exact, the probability of sight that of ground that errs (errors), as live sessions have it. The
    other arguments are those of ``navigation.monitor.predict_protection``; height_sigma_m: of the antenna, as the map
    tells it. Raises MeasurementError, VisibilityInputError.
    """
    points = np.asarray(points_m, np.float64).reshape(-1, 3)
    places = np.array([(one.east_m, one.north_m, one.altitude_m) for one in anchors]).reshape(-1, 3)
    sigmas = np.array([math.hypot(one.ranging_sigma_m, one.pose_sigma_m) for one in anchors])
    levels = np.full((len(points), 3), math.nan)
    sight = np.full((len(points), len(anchors)), math.nan)
    wrong_by, used = errors or GroundErrors(), Curvature.over(grid, curvature)
    there = np.flatnonzero(np.isfinite(points).all(axis=1))
    for begin in range(0, len(there), POINTS_AT_ONCE):
        some = there[begin : begin + POINTS_AT_ONCE]
        starts, ends = np.repeat(points[some], len(anchors), axis=0), np.tile(places, (len(some), 1))
        seen = lines_of_sight(grid, starts, ends, curvature=used)
        reach = np.hypot(*(ends - starts)[:, :2].T)
        clearance = np.where(seen.over_unknown & ~(seen.clearance_m < 0.0), np.nan, seen.clearance_m)
        away = np.nan_to_num(seen.blocking_distance_m)
        probability = sight_probability(clearance, away, reach, wrong_by)
        if seen.hits_building is not None:
            probability = np.where(seen.hits_building, 0.0, probability)
        sight[some] = probability.reshape(len(some), len(anchors))
        for number, anchor in enumerate(anchors):
            sight[some, number] = np.where(within_reach(anchor, points[some]), sight[some, number], 0.0)
        found = predict_protection(
            points[some],
            places,
            np.nan_to_num(sight[some]),
            sigmas,
            least_sight=least_sight,
            fault=fault,
            height_sigma_m=height_sigma_m,
            clock=clock,
            risk=risk,
        )
        levels[some] = np.column_stack([found.horizontal_m, found.vertical_m, found.unwatched])
        if progress is not None:
            progress((begin + len(some)) / len(there))
    return ForetoldProtection(levels[:, 0], levels[:, 1], levels[:, 2], sight, used)


def within_reach(anchor: Anchor, points_m: Array) -> npt.NDArray[np.bool_]:
    """(p,) whether an anchor's antenna reaches points (p, 3), by its range, sector and elevations."""
    limits: AntennaLimits = anchor.limits
    away = points_m - (anchor.east_m, anchor.north_m, anchor.altitude_m)
    across, length = np.hypot(away[:, 0], away[:, 1]), np.linalg.norm(away, axis=1)
    elevation = np.arctan2(away[:, 2], across)
    within = (length >= limits.min_range_m) & (length <= limits.max_range_m)
    within &= (elevation >= limits.min_elevation_rad) & (elevation <= limits.max_elevation_rad)
    if limits.azimuth_from_rad is not None and limits.azimuth_to_rad is not None:
        turn = 2.0 * math.pi
        width = limits.azimuth_to_rad - limits.azimuth_from_rad
        width = width if 0.0 < width <= turn else width % turn
        within &= (np.arctan2(away[:, 0], away[:, 1]) - limits.azimuth_from_rad) % turn <= width
    reached: npt.NDArray[np.bool_] = within
    return reached
