"""Positions of requests, brought into the grid's frame: degrees to metres and radians, heights to altitudes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from service.parts.anchors import AnchorIn
from service.parts.map_facts import check_bodies
from service.parts.points import PointIn
from terrain import ElevationGrid, height_at, places_told, to_grid_frame, told_place
from visibility import Anchor, VisibilityInputError, anchor_above_ground

__all__ = ["points_in_grid", "resolve_anchor", "resolve_point"]


def resolve_anchor(grid: ElevationGrid, anchor: AnchorIn) -> Anchor:
    """The anchor in the grid's frame, its angles in radians and its height as an altitude.

    Raises AnchorError (its ground is unknown or not there), FrameError (degrees on a grid without CRS).
    """
    east_m, north_m = _horizontal(grid, anchor)
    limits = anchor.antenna_limits()
    if anchor.altitude_m is not None:
        sigmas_m = anchor.ranging_sigma_m, anchor.pose_sigma_m
        return Anchor(anchor.id, east_m, north_m, anchor.altitude_m, *sigmas_m, limits, anchor.pose_covariance())
    return anchor_above_ground(
        grid,
        anchor.id,
        east_m,
        north_m,
        _given(anchor.above_ground_m),
        ranging_sigma_m=anchor.ranging_sigma_m,
        pose_sigma_m=anchor.pose_sigma_m,
        limits=limits,
        pose_covariance_m2=anchor.pose_covariance(),
    )


def resolve_point(grid: ElevationGrid, point: PointIn, called: str = "Point") -> tuple[float, float, float]:
    """(east_m, north_m, altitude_m) of a point in the grid's frame; ``called`` names it in error sentences.

    Raises VisibilityInputError (its ground is unknown or not there), FrameError (degrees on a grid without CRS).
    """
    east_m, north_m = _horizontal(grid, point)
    if point.altitude_m is not None:
        return east_m, north_m, point.altitude_m
    if not grid.contains(east_m, north_m):
        raise VisibilityInputError(
            f"{called} lies outside the DEM, at {_told(grid, point, east_m, north_m)}, where no ground is known; "
            "give its altitude_m instead of above_ground_m, or check whether it was given in metres or degrees."
        )
    ground_m = float(height_at(grid, east_m, north_m))
    if math.isnan(ground_m):
        raise VisibilityInputError(
            f"{called} lies on unknown ground; give its altitude_m instead of above_ground_m, or move it."
        )
    return east_m, north_m, ground_m + _given(point.above_ground_m)


def _told(grid: ElevationGrid, point: PointIn, east_m: float, north_m: float) -> str:
    """The place of a point as it is given itself."""
    degrees = point.lon_deg is not None
    with places_told(in_metres=not degrees, in_degrees=degrees):
        return told_place(grid, east_m, north_m)


def _horizontal(grid: ElevationGrid, point: PointIn) -> tuple[float, float]:
    if point.lon_deg is not None and point.lat_deg is not None:
        check_bodies(grid, (point.body,))
        return to_grid_frame(grid, point.lon_deg, point.lat_deg)
    return _given(point.east_m), _given(point.north_m)


def _given(value: float | None) -> float:
    """A value that the schema has already proved to be there."""
    if value is None:
        raise VisibilityInputError("A position came without one of its numbers.")
    return value


def points_in_grid(grid: ElevationGrid, points: Sequence[PointIn], called: str) -> npt.NDArray[np.float64]:
    """(n, 3) float64: east, north and altitude of each point, metres in the grid's frame.

    called: what error sentences call a point, with {} for its number.
    Raises FrameError (degrees that have no place on the grid), VisibilityInputError (a height above ground that is
    unknown or not there).
    """
    in_m = np.array([_numbers(point.east_m, point.north_m, point.altitude_m) for point in points])
    in_deg = np.array([_numbers(point.lon_deg, point.lat_deg, point.above_ground_m) for point in points])
    check_bodies(grid, (point.body for point in points))
    by_degrees = ~np.isnan(in_deg[:, 0])
    if by_degrees.any():
        in_m[by_degrees, 0], in_m[by_degrees, 1] = to_grid_frame(grid, in_deg[by_degrees, 0], in_deg[by_degrees, 1])
    by_ground = ~np.isnan(in_deg[:, 2])
    in_m[by_ground, 2] = height_at(grid, in_m[by_ground, 0], in_m[by_ground, 1]) + in_deg[by_ground, 2]
    nowhere = np.isnan(in_m[:, 2])
    if nowhere.any():
        number = int(np.argmax(nowhere))
        outside = not grid.contains(in_m[number, 0], in_m[number, 1])
        where = "lies outside the DEM, where no ground is known" if outside else "lies on unknown ground"
        raise VisibilityInputError(
            f"{called.format(number)} {where}; give its altitude_m instead of above_ground_m, or move it."
        )
    return in_m


def _numbers(*values: float | None) -> tuple[float, ...]:
    return tuple(np.nan if value is None else value for value in values)
