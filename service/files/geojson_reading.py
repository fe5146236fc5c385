"""GeoJSON read, from files and requests: geometries as the places, lines and polygons of a request."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import JsonValue

from service.errors import RequestError
from service.files.geojson_frames import DEGREES, Fields, GeoJsonFrame, frame_within

__all__ = ["Fields", "GeoJsonShape", "line_of", "polygons_of", "shapes_of"]

PARTS = {"MultiPoint": "Point", "MultiLineString": "LineString", "MultiPolygon": "Polygon"}
KINDS = ("Point", "LineString", "Polygon")
# collections may lie in collections; deeper than this nobody means it
DEEPEST = 32
# no CRS of a planet has places so far out
LARGEST = 1e12


@dataclass(frozen=True, slots=True)
class GeoJsonShape:
    """One Point, LineString or Polygon; the parts of Multi… and of collections are shapes of their own.

    lines: the point, the line, or the rings, each as the places of a request. feature: what it was a part of.
    """

    kind: str
    lines: tuple[list[Fields], ...]
    feature: Mapping[str, JsonValue]

    @property
    def properties(self) -> Mapping[str, JsonValue]:
        """Of its feature."""
        told = self.feature.get("properties")
        return told if isinstance(told, dict) else {}


def shapes_of(document: Any, called: str) -> list[GeoJsonShape]:
    """Every geometry of a document, however deep in collections. Raises RequestError for what cannot be used.

    called: what error sentences call the document, such as "The file areas.geojson".
    """
    if not isinstance(document, dict):
        raise RequestError(f"{called} is not GeoJSON.")
    found = list(_shapes(document, DEGREES, {}, called, 0))
    if not found:
        raise RequestError(f"{called} holds no GeoJSON geometries.")
    return found


def polygons_of(document: Any, called: str) -> list[tuple[Fields, Mapping[str, JsonValue]]]:
    """(fields, properties) of every polygon. Raises RequestError where there is none, and for anything else in it."""
    shapes = shapes_of(document, called)
    others = sorted({shape.kind for shape in shapes} - {"Polygon"})
    if others and len({shape.kind for shape in shapes}) == len(others):
        raise RequestError(f"{called} holds no polygons.")
    if others:
        raise RequestError(
            f"{called} holds a {others[0]} beside its polygons, which is no area; close it or take it out."
        )
    return [(_polygon_fields(shape), shape.properties) for shape in shapes]


def _polygon_fields(shape: GeoJsonShape) -> Fields:
    ring, *holes = shape.lines
    return {"ring": [*ring], "holes": [[*hole] for hole in holes]}


def line_of(document: Any, called: str) -> list[Fields]:
    """The places of the one line in a document; parts that meet, as where a line is cut at 180°, are one.

    Points that are corners of the line, as in Sightline's own paths, tell nothing more. Raises RequestError.
    """
    line: list[Fields] = []
    points: list[Fields] = []
    for shape in shapes_of(document, called):
        if shape.kind == "Point":
            points += shape.lines[0]
        elif shape.kind == "Polygon":
            raise RequestError(f"{called} holds no LineString only: a path has no Polygon.")
        elif line and not _same(line[-1], shape.lines[0][0]):
            raise RequestError(f"{called} holds several lines that do not meet; a path is one LineString.")
        else:
            line += shape.lines[0][1:] if line else shape.lines[0]
    if not line:
        raise RequestError(f"{called} holds no LineString.")
    corners = {_rounded(place) for place in line}
    if any(_rounded(point) not in corners for point in points):
        raise RequestError(f"{called} holds points beside its line; a path is one LineString.")
    return line


def _shapes(
    part: Any, frame: GeoJsonFrame, feature: Mapping[str, JsonValue], called: str, depth: int
) -> Iterator[GeoJsonShape]:
    if not isinstance(part, dict):
        raise RequestError(f"{called} holds a part that is no GeoJSON object.")
    if depth == 0 and "type" not in part and "geometry" not in part:
        raise RequestError(f"{called} holds no GeoJSON geometries.")
    if depth > DEEPEST:
        raise RequestError(f"{called} holds collections in collections, deeper than {DEEPEST}.")
    kind, frame = str(part.get("type")), frame_within(frame, part, called)
    if kind == "Feature" or "geometry" in part:
        if part.get("geometry") is None:
            raise RequestError(f"{called} holds a feature without a geometry.")
        yield from _shapes(part["geometry"], frame, part, called, depth + 1)
    elif kind in ("FeatureCollection", "GeometryCollection"):
        for one in _list_of(part, "features" if kind == "FeatureCollection" else "geometries", called):
            yield from _shapes(one, frame, feature, called, depth + 1)
    elif kind in PARTS:
        for one in _list_of(part, "coordinates", called):
            yield _shape(PARTS[kind], one, frame, feature, called)
    elif kind in KINDS:
        yield _shape(kind, _list_of(part, "coordinates", called), frame, feature, called)
    else:
        raise RequestError(f"{called} holds a part of the type {kind[:40]!r}, which GeoJSON does not know.")


def _shape(
    kind: str, coordinates: Any, frame: GeoJsonFrame, feature: Mapping[str, JsonValue], called: str
) -> GeoJsonShape:
    lines = {"Point": [[coordinates]], "LineString": [coordinates]}.get(kind, coordinates)
    if not isinstance(lines, list) or not lines:
        raise RequestError(f"{called} holds a polygon without a ring.")
    if not all(isinstance(line, list) and line for line in lines):
        raise RequestError(f"{called} holds a {kind} without places.")
    places = (frame.places([_pair(at, called) for at in line], called) for line in lines)
    return GeoJsonShape(kind, tuple(places), feature)


def _list_of(part: Mapping[str, JsonValue], member: str, called: str) -> list[Any]:
    listed = part.get(member)
    if not isinstance(listed, list):
        raise RequestError(f"{called} holds a {str(part.get('type'))[:40]} without a list {member!r}.")
    return listed


def _pair(at: Any, called: str) -> tuple[float, float]:
    numbers = at[:2] if isinstance(at, list) else []
    if len(numbers) == 1:
        raise RequestError(f"{called} holds a place that has not two coordinates.")
    if len(numbers) < 2 or not all(isinstance(one, int | float) and not isinstance(one, bool) for one in numbers):
        raise RequestError(f"{called} holds a geometry whose coordinates are no numbers.")
    x, y = numbers
    if not (abs(x) <= LARGEST and abs(y) <= LARGEST):
        raise RequestError(f"{called} holds a geometry whose coordinates are no finite numbers.")
    return float(x), float(y)


def _same(one: Fields, other: Fields) -> bool:
    return _rounded(one) == _rounded(other)


def _rounded(place: Fields) -> tuple[float, float]:
    """Equal for the same place, also where one is written as 180° and one as −180°."""
    match place:
        case {"east_m": float(east_m), "north_m": float(north_m)}:
            return round(east_m, 6), round(north_m, 6)
        case {"lon_deg": float(lon_deg), "lat_deg": float(lat_deg)}:
            return round(lon_deg % 360.0, 7), round(lat_deg, 7)
    raise AssertionError("a place has one of the pairs")
