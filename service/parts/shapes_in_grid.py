"""Places and shapes of a request brought into the grid's frame."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from service.errors import RequestError
from service.parts.map_facts import check_bodies
from service.parts.points import PlaceIn, PolygonIn, StandOffIn, WeightIn
from terrain import ElevationGrid, to_grid_frame

__all__ = ["places_in_grid", "polygon_in_grid", "stand_off_in_grid", "weights_in_grid"]


def places_in_grid(grid: ElevationGrid, places: Sequence[PlaceIn]) -> npt.NDArray[np.float64]:
    """(n, 2) east, north, metres. Raises FrameError for degrees that have no place on the grid."""
    in_m = np.array([(p.east_m, p.north_m) for p in places], np.float64)
    in_deg = np.array([(p.lon_deg, p.lat_deg) for p in places], np.float64)
    check_bodies(grid, (p.body for p in places))
    by_degrees = ~np.isnan(in_deg[:, 0])
    if by_degrees.any():
        in_m[by_degrees, 0], in_m[by_degrees, 1] = to_grid_frame(grid, in_deg[by_degrees, 0], in_deg[by_degrees, 1])
    return in_m


def polygon_in_grid(grid: ElevationGrid, polygon: PolygonIn, called: str) -> shapely.Polygon:
    """A polygon with an area. Raises RequestError, FrameError."""
    found = shapely.Polygon(places_in_grid(grid, polygon.ring), [places_in_grid(grid, hole) for hole in polygon.holes])
    if not found.is_valid or found.area == 0.0:
        why = shapely.is_valid_reason(found) if not found.is_valid else "it has no area"
        raise RequestError(f"{called} is no polygon: {why}.")
    return found


def stand_off_in_grid(grid: ElevationGrid, stand_off: StandOffIn) -> tuple[shapely.Geometry, float]:
    """(a point, line or closed area, metres to keep from it). Raises FrameError."""
    places_m = places_in_grid(grid, stand_off.places)
    if len(places_m) == 1:
        return shapely.Point(places_m[0]), stand_off.distance_m
    if len(places_m) > 3 and np.array_equal(places_m[0], places_m[-1]):
        return shapely.make_valid(shapely.Polygon(places_m)), stand_off.distance_m
    return shapely.LineString(places_m), stand_off.distance_m


def weights_in_grid(grid: ElevationGrid, weights: Sequence[WeightIn], called: str) -> npt.NDArray[np.float64] | None:
    """(rows, cols) what each post counts, the later polygon first; None where all count the same.

    Raises RequestError, FrameError.
    """
    if not weights:
        return None
    worth = np.ones(grid.shape)
    east_m = grid.origin_east_m + np.arange(grid.cols) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(grid.rows) * grid.cell_north_m
    for number, one in enumerate(weights):
        polygon = polygon_in_grid(grid, one.polygon, f"{called}[{number}].polygon")
        shapely.prepare(polygon)
        worth[shapely.intersects_xy(polygon, *np.meshgrid(east_m, north_m))] = one.weight
    return worth
