"""Positions, places, areas and layers of air of a request, brought into the grid's frame."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from service.errors import RequestError
from service.parts.anchors import AnchorIn, SightParameters
from service.parts.map_facts import check_bodies
from service.parts.points import PlaceIn, PointIn, PolygonIn, StandOffIn, WeightIn
from terrain import ElevationGrid, FrameError, height_at, places_told, to_grid_frame, told_place
from visibility import Anchor, VisibilityInputError, altitude_layers, anchor_above_ground
from visibility.air import AltitudeLayers
from visibility.air.morphing_maps import check_ceiling

__all__ = [
    "air_layers",
    "anchors_in_grid",
    "places_in_grid",
    "points_in_grid",
    "polygon_in_grid",
    "resolve_anchor",
    "resolve_point",
    "stand_off_in_grid",
    "told_of_areas",
    "weights_in_grid",
]

Area = PolygonIn | StandOffIn
POSTS_AT_ONCE = 1_000_000
MOST_LAYERS = 100


def resolve_anchor(grid: ElevationGrid, anchor: AnchorIn) -> Anchor:
    """The anchor in the grid's frame, its angles in radians and its height as an altitude.

    Raises AnchorError (its ground is unknown or not there), FrameError (degrees on a grid without CRS).
    """
    east_m, north_m = _horizontal(grid, anchor)
    limits = anchor.antenna_limits()
    radio = None if anchor.radio is None else anchor.radio.radio()
    if anchor.altitude_m is not None:
        sigmas_m = anchor.ranging_sigma_m, anchor.pose_sigma_m
        covariance_m2 = anchor.pose_covariance()
        at_m = east_m, north_m, anchor.altitude_m
        return Anchor(anchor.id, *at_m, *sigmas_m, limits, covariance_m2, radio=radio)
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
        radio=radio,
    )


def anchors_in_grid(grid: ElevationGrid, asked: SightParameters) -> tuple[Anchor, ...]:
    """The anchors of a request, with their radios where it asks for what is usable: there their signals decide.

    Raises as ``resolve_anchor`` does.
    """
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in asked.anchors)
    return anchors if asked.usable else tuple(replace(anchor, radio=None) for anchor in anchors)


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


def places_in_grid(grid: ElevationGrid, places: Sequence[PlaceIn] | Sequence[PointIn]) -> npt.NDArray[np.float64]:
    """(n, 2) east, north, metres. Raises FrameError for degrees that have no place on the grid."""
    in_m = np.array([(p.east_m, p.north_m) for p in places], np.float64).reshape(-1, 2)
    in_deg = np.array([(p.lon_deg, p.lat_deg) for p in places], np.float64).reshape(-1, 2)
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


def air_layers(
    grid: ElevationGrid,
    ceiling_m: float,
    above_ground: bool,
    *,
    floor_m: float | None = None,
    layer_m: float | None = None,
) -> AltitudeLayers:
    """Layers from floor_m (None = the lowest ground) up to the ceiling, three or more where layer_m is None.

    layer_m: None = as thick as the DEM's cells are wide, but no more than MOST_LAYERS layers.
    Raises VisibilityInputError.
    """
    check_ceiling(grid, ceiling_m, above_ground)
    if floor_m is None:
        floor_m = 0.0 if above_ground else float(np.nanmin(grid.heights_m))
    height_m = ceiling_m - floor_m
    if layer_m is None:
        layer_m = min(max(min(grid.cell_east_m, grid.cell_north_m), height_m / (MOST_LAYERS - 1)), height_m / 2.0)
    if height_m <= 0.0:
        raise VisibilityInputError(f"The floor at {floor_m:g} m is not below the ceiling at {ceiling_m:g} m.")
    return altitude_layers(floor_m, ceiling_m, layer_m, above_ground=above_ground)
