"""Polygons, lines and points of GeoJSON files, as the fields of a request."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from service.errors import RequestError

__all__ = ["path_fields", "place_fields", "polygon_fields", "stand_off_fields", "weight_fields"]

LOCAL_METRES = "coordinates_are"
Field = dict[str, float]


def polygon_fields(path: Path) -> list[dict[str, Any]]:
    """The polygons of a file. Raises RequestError."""
    found = [polygon for kind, rings, local, _ in _geometries(path) for polygon in _polygons(path, kind, rings, local)]
    if not found:
        raise RequestError(f"The file {path.name} holds no polygons.")
    return found


def weight_fields(path: Path) -> list[dict[str, Any]]:
    """The polygons of a file with their property ``weight``. Raises RequestError."""
    found = []
    for kind, rings, local, properties in _geometries(path):
        for polygon in _polygons(path, kind, rings, local):
            if "weight" not in properties:
                raise RequestError(f"The file {path.name} holds a polygon without the property weight.")
            found.append({"polygon": polygon, "weight": properties["weight"]})
    if not found:
        raise RequestError(f"The file {path.name} holds no polygons.")
    return found


def path_fields(path: Path) -> list[Field]:
    """The places of a file's first line. Raises RequestError."""
    for kind, line, local, _ in _geometries(path):
        if kind == "LineString":
            return _places(path, line, local)
    raise RequestError(f"The file {path.name} holds no LineString.")


def place_fields(path: Path) -> list[Field]:
    """The points of a file, and the corners of its lines. Raises RequestError."""
    found: list[Field] = []
    for kind, coordinates, local, _ in _geometries(path):
        if kind == "Point":
            found += _places(path, [coordinates], local)
        elif kind in ("MultiPoint", "LineString"):
            found += _places(path, coordinates, local)
    if not found:
        raise RequestError(f"The file {path.name} holds no points.")
    return found


def stand_off_fields(text: str) -> list[dict[str, Any]]:
    """FILE,METRES as stand-off distances to everything in the file. Raises RequestError."""
    name, comma, metres = text.rpartition(",")
    try:
        distance_m = float(metres)
    except ValueError as error:
        raise RequestError(f"--stand-off {text!r} is not of the form FILE,METRES.") from error
    if not comma:
        raise RequestError(f"--stand-off {text!r} is not of the form FILE,METRES.")
    path, found = Path(name), []
    for kind, coordinates, local, _ in _geometries(path):
        lines = {"Point": [[coordinates]], "LineString": [coordinates], "Polygon": coordinates[:1]}.get(
            kind, coordinates
        )
        if kind == "MultiPoint":
            lines = [[point] for point in coordinates]
        elif kind == "MultiPolygon":
            lines = [polygon[0] for polygon in coordinates]
        found += [{"places": _places(path, line, local), "distance_m": distance_m} for line in lines]
    return found


def _polygons(path: Path, kind: str, rings: Any, local: bool) -> list[dict[str, Any]]:
    found = []
    for polygon in [rings] if kind == "Polygon" else rings if kind == "MultiPolygon" else []:
        if not isinstance(polygon, list) or not polygon:
            raise RequestError(f"The file {path.name} holds a polygon without a ring.")
        ring, *holes = [_places(path, one, local) for one in polygon]
        found.append({"ring": ring, "holes": holes})
    return found


def _geometries(path: Path) -> list[tuple[str, Any, bool, dict[str, Any]]]:
    """(type, coordinates, whether they are local metres, properties) of every geometry."""
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The file {str(path)!r} cannot be read: {error.strerror}.") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The file {path.name} is not JSON: {error}.") from error
    if not isinstance(document, dict):
        raise RequestError(f"The file {path.name} is not GeoJSON.")
    features = document.get("features") if document.get("type") == "FeatureCollection" else [document]
    found = []
    for feature in features if isinstance(features, list) else []:
        geometry = feature.get("geometry", feature) if isinstance(feature, dict) else None
        if isinstance(geometry, dict) and isinstance(geometry.get("coordinates"), list):
            properties = feature.get("properties")
            told = properties if isinstance(properties, dict) else {}
            found.append((str(geometry.get("type")), geometry["coordinates"], LOCAL_METRES in document, told))
    if not found:
        raise RequestError(f"The file {path.name} holds no GeoJSON geometries.")
    return found


def _places(path: Path, line: Any, local: bool) -> list[Field]:
    pair = ("east_m", "north_m") if local else ("lon_deg", "lat_deg")
    try:
        return [{pair[0]: float(point[0]), pair[1]: float(point[1])} for point in line]
    except (TypeError, ValueError, IndexError) as error:
        raise RequestError(f"The file {path.name} holds a geometry whose coordinates are no numbers.") from error
