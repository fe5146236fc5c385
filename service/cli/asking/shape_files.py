"""Polygons, lines and points of GeoJSON files, as the fields of a request."""

from __future__ import annotations

import json
from pathlib import Path

from pydantic import JsonValue

from service.errors import RequestError
from service.files.geojson_reading import Fields, line_of, polygons_of, shapes_of

__all__ = ["path_fields", "place_fields", "polygon_fields", "stand_off_fields", "weight_fields"]


def polygon_fields(path: Path) -> list[Fields]:
    """The polygons of a file. Raises RequestError."""
    return [polygon for polygon, _ in polygons_of(_document(path), _called(path))]


def weight_fields(path: Path) -> list[Fields]:
    """The polygons of a file with their property ``weight``. Raises RequestError."""
    found = []
    for polygon, properties in polygons_of(_document(path), _called(path)):
        if "weight" not in properties:
            raise RequestError(f"The file {path.name} holds a polygon without the property weight.")
        found.append({"polygon": polygon, "weight": properties["weight"]})
    return found


def path_fields(path: Path) -> list[Fields]:
    """The places of a file's line. Raises RequestError."""
    return line_of(_document(path), _called(path))


def place_fields(path: Path) -> list[Fields]:
    """The points of a file, and the corners of its lines. Raises RequestError."""
    found: list[Fields] = []
    for shape in shapes_of(_document(path), _called(path)):
        if shape.kind == "Polygon":
            raise RequestError(f"{_called(path)} holds a Polygon; places are points, or the corners of lines.")
        found += shape.lines[0]
    return found


def stand_off_fields(text: str) -> list[Fields]:
    """FILE,METRES as stand-off distances to everything in the file. Raises RequestError."""
    name, comma, metres = text.rpartition(",")
    try:
        distance_m = float(metres)
    except ValueError as error:
        raise RequestError(f"--stand-off {text!r} is not of the form FILE,METRES.") from error
    if not comma:
        raise RequestError(f"--stand-off {text!r} is not of the form FILE,METRES.")
    path = Path(name)
    found: list[Fields] = []
    for shape in shapes_of(_document(path), _called(path)):
        if len(shape.lines) > 1:
            raise RequestError(f"{_called(path)} holds a polygon with holes; a stand-off keeps from whole areas.")
        found.append({"places": [*shape.lines[0]], "distance_m": distance_m})
    return found


def _document(path: Path) -> JsonValue:
    try:
        document: JsonValue = json.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The file {str(path)!r} cannot be read: {error.strerror}.") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The file {path.name} is not JSON: {error}.") from error
    return document


def _called(path: Path) -> str:
    return f"The file {path.name}"
