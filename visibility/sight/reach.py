"""What an anchor's antenna reaches: range, azimuth and elevation limits over a grid."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.sight.anchors import ALL_ROUND, Anchor, AntennaLimits
from visibility.sight.curvature import Curvature
from visibility.sight.kernels import reach as kernel

__all__ = ["limit_numbers", "points_within_reach", "raise_to_reach", "within_reach"]

# rounding of an angle, radians, and of a range, as a share of it, leaves nobody out
SLACK = 1e-9


def raise_to_reach(
    grid: ElevationGrid, anchor: Anchor, curvature: Curvature, altitude_m: npt.NDArray[np.float32]
) -> None:
    """Raise minimum altitudes (rows, cols) in place to the lowest that the anchor's antenna reaches; +inf = none."""
    if anchor.limits != ALL_ROUND:
        eye = (*grid.post_at(anchor.east_m, anchor.north_m), anchor.altitude_m)
        cells_m = (grid.cell_north_m, grid.cell_east_m)
        kernel.raise_to_reach(altitude_m, eye, cells_m, limit_numbers(anchor.limits), curvature.drop_per_m2)


def within_reach(
    grid: ElevationGrid, anchor: Anchor, curvature: Curvature, receiver_m: npt.NDArray[np.float32]
) -> npt.NDArray[np.bool_]:
    """(rows, cols) bool: whether receivers at altitude receiver_m are within the antenna's limits, terrain apart."""
    within = np.ones(receiver_m.shape, np.bool_)
    if anchor.limits != ALL_ROUND:
        eye = (*grid.post_at(anchor.east_m, anchor.north_m), anchor.altitude_m)
        cells_m = (grid.cell_north_m, grid.cell_east_m)
        kernel.within_reach(receiver_m, eye, cells_m, limit_numbers(anchor.limits), curvature.drop_per_m2, within)
    return within


def points_within_reach(
    anchor: Anchor, points_m: npt.NDArray[np.float64], curvature: Curvature
) -> npt.NDArray[np.bool_]:
    """(n,) bool: whether points (n, 3) east, north, altitude are within the antenna's limits, terrain apart."""
    if anchor.limits == ALL_ROUND:
        return np.ones(len(points_m), np.bool_)
    shortest_m, longest_m, azimuth_from_rad, width_rad, lowest, highest = limit_numbers(anchor.limits)
    east_m, north_m = points_m[:, 0] - anchor.east_m, points_m[:, 1] - anchor.north_m
    flat_m = np.hypot(east_m, north_m)
    up_m = points_m[:, 2] - anchor.altitude_m - curvature.drop_per_m2 * flat_m**2
    range_m, elevation_rad = np.hypot(flat_m, up_m), np.arctan2(up_m, flat_m)
    within = (range_m >= shortest_m * (1.0 - SLACK)) & (range_m <= longest_m * (1.0 + SLACK))
    within &= (elevation_rad >= math.atan(lowest) - SLACK) & (elevation_rad <= math.atan(highest) + SLACK)
    turned_rad = (np.arctan2(east_m, north_m) - azimuth_from_rad + SLACK) % (2.0 * math.pi)
    within &= (turned_rad <= width_rad + 2.0 * SLACK) | (flat_m == 0.0)
    return np.asarray(within, np.bool_)


def limit_numbers(limits: AntennaLimits) -> tuple[float, ...]:
    """Limits as the kernels take them; an unlimited angle becomes an infinite tangent."""
    azimuth_from_rad, azimuth_width_rad = 0.0, 2.0 * math.pi
    if limits.azimuth_from_rad is not None and limits.azimuth_to_rad is not None:
        azimuth_from_rad = limits.azimuth_from_rad
        azimuth_width_rad = limits.azimuth_to_rad - limits.azimuth_from_rad
        if not 0.0 < azimuth_width_rad <= 2.0 * math.pi:
            azimuth_width_rad %= 2.0 * math.pi
    lowest = -math.inf if limits.min_elevation_rad <= -math.pi / 2 else math.tan(limits.min_elevation_rad)
    highest = math.inf if limits.max_elevation_rad >= math.pi / 2 else math.tan(limits.max_elevation_rad)
    return limits.min_range_m, limits.max_range_m, azimuth_from_rad, azimuth_width_rad, lowest, highest
