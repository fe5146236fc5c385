"""Areas and places of requests: polygons, boxes and circles, in degrees or metres, as our own fields or as GeoJSON."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, TypeVar

import numpy as np
from pydantic import BaseModel, BeforeValidator, Discriminator, Field, JsonValue, Tag, ValidationError

from service.errors import RequestError
from service.parts.geojson_reading import Fields, GeoJsonShape, polygons_of, shapes_of
from service.parts.points import BoxDegreesIn, BoxMetresIn, CircleIn, PlaceIn, PolygonIn
from terrain import DEGREES, GRID_METRES, Area, Box, Circle, Outline, area_in_degrees

__all__ = ["AnyArea", "AreaAsPolygon", "AreaChoice", "Areas", "GeoJson", "GoalIn", "StandingPlace", "area_of"]

Shape = TypeVar("Shape", bound=BaseModel)

MOST_AREAS = 1000
# sides along a parallel are straight on no map: so many pieces follow them
PIECES = 16
CORNERS = 180
GeoJson = Annotated[
    dict[str, object],
    Field(
        description="A GeoJSON geometry, Feature or FeatureCollection, in longitude and latitude.",
        json_schema_extra={"properties": {"type": {"type": "string"}}, "required": ["type"]},
    ),
]


def _is_geojson(value: Any) -> bool:
    return isinstance(value, dict) and "type" in value


def _polygons(value: Any) -> Any:
    """Polygons out of GeoJSON, wherever it stands in a list of areas."""
    areas = [value] if isinstance(value, dict) else value
    if not isinstance(areas, list):
        return value
    found: list[Any] = []
    for number, area in enumerate(areas):
        found += _read(area, f"area {number}") if _is_geojson(area) else [_polygon_fields_of(area)]
    return found


def _read(area: Any, called: str) -> list[Fields]:
    try:
        return [polygon for polygon, _ in polygons_of(area, f"GeoJSON {called}")]
    except RequestError as error:
        raise ValueError(str(error)) from error


def _point(value: Any) -> Any:
    """A place out of a GeoJSON Point."""
    if not _is_geojson(value):
        return value
    shapes = _shapes(value, "GeoJSON")
    if len(shapes) > 1 or shapes[0].kind != "Point":
        given = f"{len(shapes)} geometries" if len(shapes) > 1 else f"a {shapes[0].kind}"
        raise ValueError(f"A place is a GeoJSON Point, not {given}.")
    return shapes[0].lines[0][0]


def _goal(value: Any) -> Any:
    """A place or a polygon, out of GeoJSON too."""
    return _polygon_fields_of(_polygon_or_place(value, "goal", "; give them as several goals"))


def _polygon_or_place(value: Any, called: str = "area", else_do: str = "") -> Any:
    """A place or a polygon out of GeoJSON; anything else as it is. else_do: what to do with several polygons."""
    if not _is_geojson(value):
        return value
    if _shapes(value, f"GeoJSON {called}")[0].kind == "Point":
        return _point(value)
    polygons = _read(value, called)
    if len(polygons) > 1:
        raise ValueError(f"The {called} is one polygon, not {len(polygons)}{else_do}.")
    return polygons[0]


def _shapes(value: Any, called: str) -> list[GeoJsonShape]:
    try:
        return shapes_of(value, called)
    except RequestError as error:
        raise ValueError(str(error)) from error


def _place_or_area(value: Any) -> str:
    is_area = isinstance(value, PolygonIn) or (isinstance(value, dict) and "ring" in value)
    return "<area>" if is_area else "<place>"


def _polygon_fields_of(value: Any) -> Any:
    """A box or a circle as the fields of a polygon; anything else as it is. Raises ValueError for one that is none."""
    fields = value if isinstance(value, dict) else {}
    if "radius_m" in fields:
        return _ring_of_circle(_model(CircleIn, fields))
    if "west_m" in fields:
        box = _model(BoxMetresIn, fields)
        return _ring("east_m", "north_m", _around(box.west_m, box.south_m, box.east_m, box.north_m))
    if "west_deg" in fields:
        degrees = _model(BoxDegreesIn, fields)
        east = degrees.east_deg + (360.0 if degrees.east_deg < degrees.west_deg else 0.0)
        return _ring("lon_deg", "lat_deg", _around(degrees.west_deg, degrees.south_deg, east, degrees.north_deg))
    return value


def _model(model: type[Shape], fields: Mapping[str, object]) -> Shape:
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        first = error.errors()[0]
        raise ValueError(f"{'.'.join(map(str, first['loc']))}: {first['msg']}") from error


def _ring_of_circle(circle: CircleIn) -> Fields:
    if circle.east_m is not None and circle.north_m is not None:
        angle = np.linspace(0.0, 2.0 * math.pi, CORNERS, endpoint=False)
        radius_m = circle.radius_m / math.cos(math.pi / CORNERS)
        pairs = np.column_stack([circle.east_m + radius_m * np.cos(angle), circle.north_m + radius_m * np.sin(angle)])
        return _ring("east_m", "north_m", pairs.tolist())
    assert circle.lon_deg is not None, "the validator has seen to it"
    assert circle.lat_deg is not None, "the validator has seen to it"
    if circle.body not in (None, "Earth"):
        raise ValueError("A circle in degrees is one of the Earth here; give east_m and north_m.")
    around = area_in_degrees(Circle(circle.lon_deg, circle.lat_deg, circle.radius_m, DEGREES))
    # said to be the Earth's, so that on a DEM of another body it is refused, not drawn with another radius
    return _ring("lon_deg", "lat_deg", list(around.exterior.coords)[:-1], {"body": "Earth"})


def _around(west: float, south: float, east: float, north: float) -> list[list[float]]:
    x, y = np.linspace(west, east, PIECES + 1), np.linspace(south, north, PIECES + 1)
    sides = [
        np.column_stack([x[:-1], np.full(PIECES, south)]),
        np.column_stack([np.full(PIECES, east), y[:-1]]),
        np.column_stack([x[:0:-1], np.full(PIECES, north)]),
        np.column_stack([np.full(PIECES, west), y[:0:-1]]),
    ]
    ring: list[list[float]] = np.concatenate(sides).tolist()
    return ring


def _ring(x_name: str, y_name: str, pairs: Sequence[Sequence[float]], more: Mapping[str, str] | None = None) -> Fields:
    places: list[JsonValue] = [{x_name: float(x), y_name: float(y), **(more or {})} for x, y in pairs]
    return {"ring": places}


def _kind(value: Any) -> str:
    if isinstance(value, AnyArea):
        return f"<{type(value).__name__}>"
    fields = value if isinstance(value, dict) else {}
    if "ring" in fields:
        return "<PolygonIn>"
    if "radius_m" in fields:
        return "<CircleIn>"
    return "<BoxMetresIn>" if "west_m" in fields else "<BoxDegreesIn>"


AnyArea = BoxDegreesIn | BoxMetresIn | CircleIn | PolygonIn
AreaChoice = Annotated[
    Annotated[BoxDegreesIn, Tag("<BoxDegreesIn>")]
    | Annotated[BoxMetresIn, Tag("<BoxMetresIn>")]
    | Annotated[CircleIn, Tag("<CircleIn>")]
    | Annotated[PolygonIn, Tag("<PolygonIn>")],
    Discriminator(_kind),
    BeforeValidator(_polygon_or_place, json_schema_input_type=AnyArea | GeoJson),
]
AreaAsPolygon = Annotated[PolygonIn, BeforeValidator(_polygon_fields_of, json_schema_input_type=AnyArea)]
Areas = Annotated[
    list[PolygonIn],
    BeforeValidator(_polygons, json_schema_input_type=list[AnyArea] | GeoJson | list[GeoJson]),
    Field(max_length=MOST_AREAS),
]
StandingPlace = Annotated[PlaceIn, BeforeValidator(_point, json_schema_input_type=PlaceIn | GeoJson)]
GoalIn = Annotated[
    Annotated[PlaceIn, Tag("<place>")] | Annotated[PolygonIn, Tag("<area>")],
    Discriminator(_place_or_area),
    BeforeValidator(_goal, json_schema_input_type=PlaceIn | AnyArea | GeoJson),
]


def area_of(asked: AnyArea, metres: str = GRID_METRES) -> Area:
    """The area that a request means. metres: which frame its metres are in. Raises AreaError, RequestError."""
    if isinstance(asked, BoxDegreesIn):
        return Box(asked.west_deg, asked.south_deg, asked.east_deg, asked.north_deg, DEGREES)
    if isinstance(asked, BoxMetresIn):
        return Box(asked.west_m, asked.south_m, asked.east_m, asked.north_m, metres)
    if isinstance(asked, CircleIn):
        (x, y), frame = _pair(asked, metres)
        return Circle(x, y, asked.radius_m, frame)
    rings = [tuple(_pair(place, metres) for place in ring) for ring in (asked.ring, *asked.holes)]
    frames = {frame for ring in rings for _, frame in ring}
    if len(frames) > 1:
        raise RequestError("The corners of an area must all be in degrees or all in metres.")
    outer, *holes = (tuple(pair for pair, _ in ring) for ring in rings)
    return Outline(outer, tuple(holes), frames.pop())


def _pair(place: PlaceIn, metres: str) -> tuple[tuple[float, float], str]:
    if place.lon_deg is not None and place.lat_deg is not None:
        return (place.lon_deg, place.lat_deg), DEGREES
    assert place.east_m is not None, "the validator has seen to it"
    assert place.north_m is not None, "the validator has seen to it"
    return (place.east_m, place.north_m), metres
