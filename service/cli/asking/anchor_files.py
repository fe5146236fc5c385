"""Anchors in files, standing or on tracks: JSON as in requests, GeoJSON points, or CSV with a request's field names."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from pydantic import JsonValue, ValidationError

from service.errors import RequestError
from service.files.csv_table import Numbers, check_columns, read_csv_table, text_of
from service.files.geojson_reading import GeoJsonShape, shapes_of
from service.parts.anchors import AnchorIn, TrackIn, TrackPointIn
from service.parts.sentences import sentence_of

__all__ = ["IN_THE_PLANE", "anchors_from_file", "tracks_from_file"]

FIELDS = frozenset(AnchorIn.model_fields)
# a cell holds one number, a covariance nine
COLUMNS = tuple(field for field in AnchorIn.model_fields if field != "pose_covariance_m2")
TEXTS = {"id", "body"}
PLACE = {"east_m", "north_m", "lon_deg", "lat_deg", "body"}
TRACK_COLUMNS = ("id", *(field for field in TrackPointIn.model_fields if field != "body"))
ANCHORS, TRACKS = "anchors file", "track file"
IN_THE_PLANE = "where anchors and rover are at one height, say --dimension 2 and leave heights out"


def anchors_from_file(path: Path, *, level: bool | None = None) -> list[AnchorIn]:
    """The anchors of a .json, .geojson or .csv file.

    level: of a detector, which knows no ground: whether heights do not matter, and may be left out.
    Raises RequestError.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        described = _csv_rows(path)
    elif suffix in (".json", ".geojson"):
        described = _json_entries(path)
    else:
        text_of(path, ANCHORS)
        raise RequestError(f"The anchors file {path.name} must end in .json, .geojson or .csv.")
    if not described:
        raise RequestError(f"The anchors file {path.name} holds no anchors.")
    return [_anchor(where, fields, level) for where, fields in described]


def tracks_from_file(path: Path) -> list[TrackIn]:
    """The tracks of a .json or .csv file. Raises RequestError."""
    entries = _tracks_of_json(path) if path.suffix.lower() == ".json" else _tracks_of_csv(path)
    if not entries:
        raise RequestError(f"The track file {path.name} holds no tracks.")
    try:
        return [TrackIn.model_validate(entry) for entry in entries]
    except ValidationError as error:
        raise RequestError(f"The track file {path.name}: {sentence_of(error)}") from error


def _anchor(where: str, fields: object, level: bool | None) -> AnchorIn:
    if not isinstance(fields, Mapping):
        raise RequestError(f"{where}: an anchor must be an object with id, position and height.")
    if level is not None and not {"altitude_m", "above_ground_m"} & set(fields):
        if not level:
            raise RequestError(f"{where}: an anchor of a detector in space needs altitude_m; {IN_THE_PLANE}.")
        fields = {**fields, "altitude_m": 0.0}
    try:
        return AnchorIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error


def _document(path: Path, what: str) -> JsonValue:
    try:
        document: JsonValue = json.loads(text_of(path, what))
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The {what} {path.name} is not JSON: {error}.") from error
    return document


def _json_entries(path: Path) -> list[tuple[str, object]]:
    """(where it stands, the fields of a request) of each."""
    name, document = path.name, _document(path, ANCHORS)
    if isinstance(document, dict) and "type" in document:
        try:
            shapes = shapes_of(document, f"The anchors file {name}")
        except RequestError as error:
            raise RequestError(f"{str(error).removesuffix('.')}; only Point features can be anchors.") from error
        return [
            (f"{name}, feature {number}", _fields_of(name, number, shape)) for number, shape in enumerate(shapes, 1)
        ]
    entries = document.get("anchors") if isinstance(document, dict) else document
    if not isinstance(entries, list):
        raise RequestError(
            f"The anchors file {name} must hold a list of anchors, an object with a list 'anchors', or a GeoJSON "
            "FeatureCollection."
        )
    return [(f"{name}, anchor {number}", fields) for number, fields in enumerate(entries, 1)]


def _fields_of(name: str, number: int, shape: GeoJsonShape) -> dict[str, object]:
    """The request's fields of one GeoJSON point; properties that no anchor has are somebody else's and pass."""
    if shape.kind != "Point":
        raise RequestError(f"{name}, feature {number}: only Point features can be anchors.")
    own = {key: value for key, value in shape.properties.items() if key in FIELDS - PLACE}
    return {"id": str(shape.feature.get("id", number)), **own, **shape.lines[0][0]}


def _csv_rows(path: Path) -> list[tuple[str, object]]:
    table = read_csv_table(path, ANCHORS, comments_within=False)
    check_columns(table, ANCHORS, COLUMNS, needed=("id",))
    numbers = Numbers(table.delimiter)
    return [
        (
            where,
            {
                name: cell if name in TEXTS else numbers.number(where, name, cell)
                for name, cell in cells.items()
                if cell
            },
        )
        for where, cells in table.lines
    ]


def _tracks_of_json(path: Path) -> list[JsonValue]:
    document = _document(path, TRACKS)
    entries = document.get("tracks") if isinstance(document, dict) else document
    if not isinstance(entries, list):
        raise RequestError(f"The track file {path.name} must hold a list of tracks, or an object with a list 'tracks'.")
    return entries


def _tracks_of_csv(path: Path) -> list[dict[str, object]]:
    table = read_csv_table(path, TRACKS, comments_within=False)
    check_columns(table, TRACKS, TRACK_COLUMNS, needed=("id",))
    numbers = Numbers(table.delimiter)
    points: dict[str, list[dict[str, float]]] = {}
    for where, cells in table.lines:
        point = numbers.row(where, {column: cell for column, cell in cells.items() if column != "id"})
        points.setdefault(cells["id"], []).append(point)
    return [{"id": id, "points": listed} for id, listed in points.items()]
