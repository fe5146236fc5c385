"""Positions of requests brought into the grid's frame: degrees to metres and radians, heights to altitudes."""

from __future__ import annotations

import math

from service.parts.anchors import AnchorIn
from service.parts.map_facts import check_bodies
from service.parts.points import PointIn
from terrain import ElevationGrid, height_at, places_told, to_grid_frame, told_place
from visibility import Anchor, VisibilityInputError, anchor_above_ground

__all__ = ["resolve_anchor", "resolve_point"]


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
