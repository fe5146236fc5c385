"""Areas and places of requests, as our own fields or as GeoJSON."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Discriminator, Field, Tag

from service.errors import RequestError
from service.files.geojson_shapes import GeoJsonShape, polygons_of, shapes_of
from service.parts.shapes import PlaceIn, PolygonIn

__all__ = ["Areas", "GeoJson", "GoalIn", "StandingPlace", "polygon_or_place"]

MOST_AREAS = 1000
GeoJson = Annotated[
    dict[str, Any],
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
        found += _read(area, f"area {number}") if _is_geojson(area) else [area]
    return found


def _read(area: Any, called: str) -> list[dict[str, Any]]:
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


def polygon_or_place(value: Any) -> Any:
    """A place or a polygon out of GeoJSON; anything else as it is."""
    if not _is_geojson(value):
        return value
    if _shapes(value, "GeoJSON area")[0].kind == "Point":
        return _point(value)
    polygons = _read(value, "area")
    if len(polygons) > 1:
        raise ValueError(f"One polygon is wanted here, not {len(polygons)}.")
    return polygons[0]


def _shapes(value: Any, called: str) -> list[GeoJsonShape]:
    try:
        return shapes_of(value, called)
    except RequestError as error:
        raise ValueError(str(error)) from error


def _place_or_area(value: Any) -> str:
    is_area = isinstance(value, PolygonIn) or (isinstance(value, dict) and "ring" in value)
    return "area" if is_area else "place"


Areas = Annotated[
    list[PolygonIn],
    BeforeValidator(_polygons, json_schema_input_type=list[PolygonIn] | GeoJson | list[GeoJson]),
    Field(max_length=MOST_AREAS),
]
StandingPlace = Annotated[PlaceIn, BeforeValidator(_point, json_schema_input_type=PlaceIn | GeoJson)]
GoalIn = Annotated[
    Annotated[PlaceIn, Tag("place")] | Annotated[PolygonIn, Tag("area")],
    Discriminator(_place_or_area),
    BeforeValidator(polygon_or_place, json_schema_input_type=PlaceIn | PolygonIn | GeoJson),
]
