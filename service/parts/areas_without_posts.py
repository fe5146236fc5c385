"""Areas of a request that lie beside the DEM or between its posts: told, for hardly anybody means them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import shapely

from service.parts.shapes import PlaceIn, PolygonIn, StandOffIn
from service.parts.shapes_in_grid import polygon_in_grid, stand_off_in_grid
from terrain import ElevationGrid, FrameError

__all__ = ["told_of_areas"]

Area = PolygonIn | StandOffIn
POSTS_AT_ONCE = 1_000_000


def told_of_areas(grid: ElevationGrid, areas: Mapping[str, Sequence[Area]]) -> tuple[str, ...]:
    """A sentence for each area that touches no post. Raises RequestError, FrameError for what is no area."""
    return tuple(
        _sentence(grid, area, f"{field}[{number}]")
        for field, some in areas.items()
        for number, area in enumerate(some)
        if not _touches(grid, _shape(grid, area, f"{field}[{number}]"))
    )


def _sentence(grid: ElevationGrid, area: Area, called: str) -> str:
    told = f"{called} touches no post of the DEM"
    try:
        swapped = _touches(grid, _shape(grid, _swapped(area), called))
    except (FrameError, ValueError):  # what is no place when swapped is no hint
        swapped = False
    return f"{told}; with longitude and latitude swapped it would touch some: are they?" if swapped else f"{told}."


def _shape(grid: ElevationGrid, area: Area, called: str) -> shapely.Geometry:
    if isinstance(area, PolygonIn):
        return polygon_in_grid(grid, area, called)
    shape, distance_m = stand_off_in_grid(grid, area)
    return shape.buffer(distance_m)


def _swapped(area: Area) -> Area:
    """The same with the pairs of degrees the other way round. Raises ValueError where those are no degrees."""

    def turned(places: Sequence[PlaceIn]) -> list[PlaceIn]:
        pairs = ({"lon_deg": place.lat_deg, "lat_deg": place.lon_deg, "body": place.body} for place in places)
        return [PlaceIn.model_validate(pair) for pair in pairs]

    if isinstance(area, PolygonIn):
        return PolygonIn(ring=turned(area.ring), holes=[turned(hole) for hole in area.holes])
    return StandOffIn(places=turned(area.places), distance_m=area.distance_m)


def _touches(grid: ElevationGrid, shape: shapely.Geometry) -> bool:
    """Whether any post lies in a shape or on its border."""
    shapely.prepare(shape)
    return any(bool(shapely.intersects_xy(shape, *posts).any()) for posts in _posts_around(grid, shape))


def _posts_around(grid: ElevationGrid, shape: shapely.Geometry) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(east_m, north_m) of the posts within the bounds of a shape, some rows at a time."""
    west_m, south_m, east_m, north_m = shape.bounds
    first_row, first_col = (int(np.ceil(at)) for at in grid.post_at(west_m, north_m))
    last_row, last_col = (int(np.floor(at)) for at in grid.post_at(east_m, south_m))
    cols = np.arange(max(first_col, 0), min(last_col, grid.cols - 1) + 1)
    rows = np.arange(max(first_row, 0), min(last_row, grid.rows - 1) + 1)
    step = max(1, POSTS_AT_ONCE // max(1, len(cols)))
    for start in range(0, len(rows) if len(cols) else 0, step):
        yield grid.position_of(*np.meshgrid(rows[start : start + step], cols, indexing="ij"))
