"""Anchors in files: JSON as in requests, GeoJSON points, or CSV with the request's field names as header."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.files.geojson_shapes import GeoJsonShape, shapes_of
from service.files.read_tables import read_table
from service.parts.anchors import AnchorIn
from service.parts.sentences import sentence_of

__all__ = ["anchors_from_file"]

FIELDS = frozenset(AnchorIn.model_fields)
# a cell holds one number, a covariance nine
COLUMNS = tuple(field for field in AnchorIn.model_fields if field != "pose_covariance_m2")
TEXTS = {"id", "body", "altitude_datum"}
PLACE = {"east_m", "north_m", "lon_deg", "lat_deg", "body"}


def anchors_from_file(path: Path, *, level: bool = False) -> list[AnchorIn]:
    """The anchors of a .json, .geojson or .csv file. level: heights do not matter, and may be left out.

    Raises RequestError.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        described = _csv_rows(path)
    elif suffix in (".json", ".geojson"):
        described = _json_entries(path.name, _text_of(path))
    else:
        _text_of(path)
        raise RequestError(f"The anchors file {path.name} must end in .json, .geojson or .csv.")
    if not described:
        raise RequestError(f"The anchors file {path.name} holds no anchors.")
    return [_anchor(path.name, place, fields, level) for place, fields in described]


def _text_of(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"The anchors file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The anchors file {str(path)!r} cannot be read: {error.strerror}.") from error


def _anchor(name: str, place: str, fields: Any, level: bool) -> AnchorIn:
    if not isinstance(fields, dict):
        raise RequestError(f"{name}, {place}: an anchor must be an object with id, position and height.")
    if level and not {"altitude_m", "above_ground_m"} & set(fields):
        fields = {**fields, "altitude_m": 0.0}
    try:
        return AnchorIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"{name}, {place}: {sentence_of(error)}") from error


def _json_entries(name: str, text: str) -> list[tuple[str, Any]]:
    try:
        document = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The anchors file {name} is not JSON: {error}.") from error
    if isinstance(document, dict) and "type" in document:
        try:
            shapes = shapes_of(document, f"The anchors file {name}")
        except RequestError as error:
            raise RequestError(f"{str(error).removesuffix('.')}; only Point features can be anchors.") from error
        return [(f"feature {number}", _fields_of(name, number, shape)) for number, shape in enumerate(shapes, 1)]
    entries = document if isinstance(document, list) else _list_in(name, document, "anchors")
    return [(f"anchor {i}", fields) for i, fields in enumerate(entries, 1)]


def _list_in(name: str, document: Any, member: str) -> list[Any]:
    entries = document.get(member) if isinstance(document, dict) else None
    if not isinstance(entries, list):
        raise RequestError(
            f"The anchors file {name} must hold a list of anchors, an object with a list 'anchors', or a GeoJSON "
            "FeatureCollection."
        )
    return entries


def _fields_of(name: str, number: int, shape: GeoJsonShape) -> dict[str, Any]:
    """The request's fields of one GeoJSON point; properties that no anchor has are somebody else's and pass."""
    if shape.kind != "Point":
        raise RequestError(f"{name}, feature {number}: only Point features can be anchors.")
    fields = {key: value for key, value in shape.properties.items() if key in FIELDS - PLACE}
    fields.setdefault("id", str(shape.feature.get("id", number)))
    return {**fields, **shape.lines[0][0]}


def _csv_rows(path: Path) -> list[tuple[str, Any]]:
    table = read_table(path, "The anchors file")
    strange = [column for column in table.header if column not in COLUMNS]
    if strange or "id" not in table.header:
        known = ", ".join(COLUMNS)
        wrong = f"unknown column {strange[0]!r}" if strange else "no column 'id'"
        raise RequestError(f"The anchors file {path.name} has {wrong}; its first line names columns out of {known}.")
    return [
        (
            f"line {line}",
            {name: cell if name in TEXTS else table.number(line, name, cell) for name, cell in cells.items()},
        )
        for line, cells in table.rows
    ]
