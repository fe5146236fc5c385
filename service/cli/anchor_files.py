"""Anchors in files: JSON as in requests, GeoJSON points, or CSV with the request's field names as header."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.schemas import AnchorIn, sentence_of
from service.tables import text_of

__all__ = ["anchors_from_file"]

FIELDS = frozenset(AnchorIn.model_fields)
# a cell holds one number, a covariance nine
COLUMNS = tuple(field for field in AnchorIn.model_fields if field != "pose_covariance_m2")
LOCAL_METRES = "coordinates_are"


def anchors_from_file(path: Path, *, level: bool = False) -> list[AnchorIn]:
    """The anchors of a .json, .geojson or .csv file. level: heights do not matter, and may be left out.

    Raises RequestError.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"The anchors file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The anchors file {str(path)!r} cannot be read: {error.strerror}.") from error
    suffix = path.suffix.lower()
    if suffix == ".csv":
        described = _csv_rows(path.name, text)
    elif suffix in (".json", ".geojson"):
        described = _json_entries(path.name, text)
    else:
        raise RequestError(f"The anchors file {path.name} must end in .json, .geojson or .csv.")
    if not described:
        raise RequestError(f"The anchors file {path.name} holds no anchors.")
    return [_anchor(path.name, place, fields, level) for place, fields in described]


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
    if isinstance(document, dict) and document.get("type") == "FeatureCollection":
        local = LOCAL_METRES in document
        features = _list_in(name, document, "features")
        return [(f"feature {i}", _feature_fields(name, i, f, local)) for i, f in enumerate(features, 1)]
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


def _feature_fields(name: str, number: int, feature: Any, local: bool) -> dict[str, Any]:
    """The request's fields of one GeoJSON point; properties that no anchor has are somebody else's and pass."""
    geometry = feature.get("geometry") if isinstance(feature, dict) else None
    coordinates = geometry.get("coordinates") if isinstance(geometry, dict) else None
    if not isinstance(geometry, dict) or geometry.get("type") != "Point" or not isinstance(coordinates, list):
        raise RequestError(f"{name}, feature {number}: only Point features can be anchors.")
    if len(coordinates) < 2:
        raise RequestError(f"{name}, feature {number}: a Point needs two coordinates.")
    properties = feature.get("properties") or {}
    pair = ("east_m", "north_m") if local else ("lon_deg", "lat_deg")
    others = FIELDS - {"east_m", "north_m", "lon_deg", "lat_deg"}
    fields = {key: value for key, value in properties.items() if key in others}
    fields.setdefault("id", str(feature.get("id", number)))
    return {**fields, pair[0]: coordinates[0], pair[1]: coordinates[1]}


def _csv_rows(name: str, text: str) -> list[tuple[str, Any]]:
    reader = csv.DictReader(io.StringIO(text), skipinitialspace=True, restkey="", strict=True)
    try:
        header = [column.strip() for column in reader.fieldnames or []]
        strange = [column for column in header if column not in COLUMNS]
        if strange or "id" not in header:
            known = ", ".join(COLUMNS)
            wrong = f"unknown column {strange[0]!r}" if strange else "no column 'id'"
            raise RequestError(f"The anchors file {name} has {wrong}; its first line names columns out of {known}.")
        reader.fieldnames = header
        return [(f"line {reader.line_num}", _csv_fields(name, reader.line_num, row)) for row in reader]
    except csv.Error as error:
        raise RequestError(f"The anchors file {name} is not CSV: {error}.") from error


def _csv_fields(name: str, line: int, row: dict[str, Any]) -> dict[str, Any]:
    if "" in row:
        raise RequestError(f"{name}, line {line}: more cells than columns.")
    fields: dict[str, Any] = {}
    for column, cell in row.items():
        if cell is None or not cell.strip():
            continue
        try:
            fields[column] = text_of(cell.strip()) if column == "id" else float(cell)
        except ValueError as error:
            raise RequestError(f"{name}, line {line}: {column} is {cell.strip()[:40]!r}, not a number.") from error
    return fields
