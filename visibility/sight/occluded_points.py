"""Which points a camera's image columns see: De Vivo et al. II-B, equations 10 and 11."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at
from visibility.errors import VisibilityInputError
from visibility.sight.camera import Camera
from visibility.sight.curvature import Curvature
from visibility.sight.kernels.crossings import GRAZING_TOLERANCE_M
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE
from visibility.sight.sight_points import horizontal_box

__all__ = ["OUTSIDE_DEM", "OUTSIDE_VIEW", "OccludedPoints", "occluded_points"]

OUTSIDE_VIEW, OUTSIDE_DEM = np.uint8(2), np.uint8(3)


@dataclass(frozen=True, eq=False)
class OccludedPoints:
    """What the image columns of a camera see of the ground; one row per column, one entry per sample going outward.

    azimuth_rad: (columns,) clockwise from grid north.
    distance_m: (samples,) horizontal from the point below the camera, beginning where the DEM begins.
    east_m, north_m, ground_m: (columns, samples); ground NaN = unknown or outside the DEM.
    state: (columns, samples) uint8: VISIBLE 1, HIDDEN 0, UNKNOWN 255, OUTSIDE_VIEW 2 (not in the field of view, so not
        visible), OUTSIDE_DEM 3.
    """

    azimuth_rad: npt.NDArray[np.float64]
    distance_m: npt.NDArray[np.float64]
    east_m: npt.NDArray[np.float64]
    north_m: npt.NDArray[np.float64]
    ground_m: npt.NDArray[np.float64]
    state: npt.NDArray[np.uint8]
    curvature: Curvature


def occluded_points(
    camera: Camera,
    grid: ElevationGrid,
    *,
    receiver_above_ground_m: float = 0.0,
    spacing_m: float | None = None,
    curvature: Curvature | None = None,
) -> OccludedPoints:
    """Resample the DEM along the ground traces of the image columns and tell the occluded points, in O(samples).

    A column's trace is in the vertical plane through the camera and that column's end on the image's lower edge (upper,
    if the camera looks up), so that the traces fan out over the whole footprint. Going outward, a point is visible
    where its place in the image is at least as high as that of everything before it.
    spacing_m: between samples; None takes the smaller cell. Ground between samples is not looked at.
    curvature: None takes what the grid's CRS implies (Curvature.of); FLAT switches it off.
    Raises VisibilityInputError, also for a camera that is rolled or has the point straight below or above it in view.
    """
    spacing_m = min(grid.cell_east_m, grid.cell_north_m) if spacing_m is None else spacing_m
    if not (math.isfinite(spacing_m) and spacing_m > 0.0):
        raise VisibilityInputError(f"spacing_m must be a positive number of metres, not {spacing_m}.")
    if not (math.isfinite(receiver_above_ground_m) and receiver_above_ground_m >= 0.0):
        raise VisibilityInputError(f"receiver_above_ground_m must be >= 0 m, not {receiver_above_ground_m}.")
    curvature = Curvature.over(grid, curvature)
    azimuth_rad = _column_azimuths(camera)
    foot_east_m, foot_north_m, _ = camera.position_m
    nearest_m, furthest_m = _reach_m(grid, foot_east_m, foot_north_m)
    distance_m = np.arange(max(1.0, nearest_m // spacing_m), furthest_m // spacing_m + 1.0) * spacing_m
    east_m = foot_east_m + np.sin(azimuth_rad)[:, None] * distance_m
    north_m = foot_north_m + np.cos(azimuth_rad)[:, None] * distance_m
    ground_m = height_at(grid, east_m, north_m)

    lowered_m = ground_m - curvature.drop_per_m2 * distance_m**2
    up = camera.image(np.stack([east_m, north_m, lowered_m], axis=-1))[..., 0]
    known = np.isfinite(ground_m)
    highest = np.maximum.accumulate(np.where(known, up, -np.inf), axis=1)
    receivers_m = np.stack([east_m, north_m, lowered_m + receiver_above_ground_m + GRAZING_TOLERANCE_M], axis=-1)
    state = np.where(camera.image(receivers_m)[..., 0] >= highest, VISIBLE, HIDDEN)

    row, col = (grid.origin_north_m - north_m) / grid.cell_north_m, (east_m - grid.origin_east_m) / grid.cell_east_m
    on_dem = (row >= 0.0) & (row <= grid.rows - 1) & (col >= 0.0) & (col <= grid.cols - 1)
    behind_unknown = np.logical_or.accumulate(on_dem & ~known, axis=1)
    state[behind_unknown & ((state == VISIBLE) | ~known)] = UNKNOWN
    state[known & ~camera.in_view(receivers_m)] = OUTSIDE_VIEW
    state[~on_dem] = OUTSIDE_DEM
    return OccludedPoints(azimuth_rad, distance_m, east_m, north_m, ground_m, state, curvature)


def _column_azimuths(camera: Camera) -> npt.NDArray[np.float64]:
    """(pixels,) azimuth of each image column's ground trace."""
    up, right, ahead = camera.T_ned_to_camera[:3, :3]  # the camera's axes as directions in ned
    if abs(right[2]) > 1e-9 or up[2] > 0.0:
        raise VisibilityInputError(
            "The camera is rolled, so its image columns do not stand upright; give it an attitude without roll."
        )
    nearest = math.hypot(ahead[0], ahead[1]) - camera.half_width * abs(ahead[2])
    if nearest <= 1e-6:
        raise VisibilityInputError(
            "The camera has the point straight below or above it in view, where image columns have no direction; "
            "narrow its view or use min_visible_altitude."
        )
    column = (np.arange(camera.pixels) - (camera.pixels - 1) / 2.0) * camera.pixel_size_m / camera.focal_length_m
    azimuth_rad: npt.NDArray[np.float64] = math.atan2(ahead[1], ahead[0]) + np.arctan2(column, nearest)
    return azimuth_rad


def _reach_m(grid: ElevationGrid, east_m: float, north_m: float) -> tuple[float, float]:
    """Distance from a position to the nearest and to the furthest point of the DEM."""
    low_m, high_m = horizontal_box(grid)
    here_m = np.array([east_m, north_m])
    before_m, beyond_m = low_m - here_m, here_m - high_m
    nearest_m = np.hypot(*np.maximum(np.maximum(before_m, beyond_m), 0.0))
    return float(nearest_m), float(np.hypot(*np.maximum(np.abs(before_m), np.abs(beyond_m))))
