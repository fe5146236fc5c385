"""Anchors in files, standing, on tracks or of a detector: JSON as in requests, GeoJSON points, or CSV."""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydantic import JsonValue, ValidationError

from detection import DetectionInputError, RangingAnchor
from gnss import Place, ecef_to_enu_m, place_ecef_m
from service.errors import RequestError
from service.files.csv_table import Numbers, check_columns, read_csv_table, text_of
from service.parts.anchors import AnchorIn, TrackIn, TrackPointIn
from service.parts.geojson_reading import GeoJsonShape, shapes_of
from service.parts.sentences import sentence_of

from .foreign_files import foreign_document, is_foreign
from .texts import ANCHOR_FORM, anchor_from_text

__all__ = [
    "IN_THE_PLANE",
    "anchors_from_file",
    "ranging_anchors",
    "ranging_asked",
    "tracks_from_file",
]

FIELDS = frozenset(AnchorIn.model_fields)
# a cell holds one number, a covariance nine; of a radio the name
COLUMNS = tuple(field for field in AnchorIn.model_fields if field != "pose_covariance_m2")
# as radios' own tables call places in a frame of their own
XYZ = {"x": "east_m", "y": "north_m", "z": "altitude_m", "x_m": "east_m", "y_m": "north_m", "z_m": "altitude_m"}
TEXTS = {"id", "body", "altitude_datum", "radio"}
OF_MISSIONS = ("kind",)  # what the planner's tables tell besides, which changes no answer
PLACE = {"east_m", "north_m", "lon_deg", "lat_deg", "body"}
TRACK_COLUMNS = ("id", *(field for field in TrackPointIn.model_fields if field not in ("body", "altitude_datum")))
ANCHORS, TRACKS = "anchors file", "track file"
MOST_ANCHORS = 10_000  # in a file; a request may have fewer by far
IN_THE_PLANE = "where anchors and rover are at one height, say --dimension 2 and leave heights out"


def anchors_from_file(path: Path, *, level: bool | None = None) -> list[AnchorIn]:
    """The anchors of a .json, .geojson, .csv, .kml, .kmz, .gpx or .plan file; what was left out of it is told.

    level: of a detector, which knows no ground: whether heights do not matter, and may be left out.
    Raises RequestError.
    """
    suffix = path.suffix.lower()
    if suffix == ".csv":
        described = _csv_rows(path)
    elif suffix in (".json", ".geojson"):
        described = _json_entries(path)
    elif is_foreign(path):
        described = _foreign_entries(path)
    else:
        text_of(path, ANCHORS)
        raise RequestError(
            f"The anchors file {path.name} must end in .json, .geojson, .csv, .kml, .kmz, .gpx or .plan."
        )
    if not described:
        raise RequestError(f"The anchors file {path.name} holds no anchors.")
    _refuse_many(path, len(described))
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
    except (ValueError, RecursionError) as error:
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
    entries = _listed_anchors(document)
    if not isinstance(entries, list):
        raise RequestError(
            f"The anchors file {name} must hold a list of anchors, an object with a list 'anchors', or a GeoJSON "
            "FeatureCollection."
        )
    return [(f"{name}, anchor {number}", fields) for number, fields in enumerate(entries, 1)]


def _foreign_entries(path: Path) -> list[tuple[str, object]]:
    called = f"The anchors file {path.name}"
    document = foreign_document(path, "Point", called)
    return [
        (f"{path.name}, point {number}", _fields_of(path.name, number, shape))
        for number, shape in enumerate(shapes_of(document, called), 1)
    ]


def _listed_anchors(document: JsonValue) -> JsonValue:
    """The anchors of a list, a request, a mission, or an answer of ours, which tells more of each than was asked."""
    if not isinstance(document, dict):
        return document
    placed, asked = document.get("placed"), document.get("anchors")
    if "timing" not in document and "format" not in document:
        return asked
    entries = placed if isinstance(placed, list) else asked
    return [_as_asked(one) for one in entries] if isinstance(entries, list) else entries


def _as_asked(told: JsonValue) -> JsonValue:
    """Of what an answer or a mission tells of an anchor the fields of a request; of two heights the altitude."""
    if not isinstance(told, dict):
        return told
    fields: dict[str, JsonValue] = {name: told[name] for name in told if name in FIELDS and told[name] is not None}
    if isinstance(height_from := told.get("height_from"), str):
        fields[height_from] = told.get("height_m")
    if "altitude_m" in fields:
        fields.pop("above_ground_m", None)
    return fields


def _fields_of(name: str, number: int, shape: GeoJsonShape) -> dict[str, object]:
    """The request's fields of one GeoJSON point; properties that no anchor has are somebody else's and pass."""
    if shape.kind != "Point":
        raise RequestError(f"{name}, feature {number}: only Point features can be anchors.")
    own = {key: value for key, value in shape.properties.items() if key in FIELDS - PLACE}
    return {"id": str(shape.feature.get("id", number)), **own, **shape.lines[0][0]}


def _csv_rows(path: Path) -> list[tuple[str, object]]:
    table = read_csv_table(path, ANCHORS, comments_within=False)
    columns = tuple(XYZ.get(column.casefold(), column.casefold()) for column in table.columns)
    named = dict(zip(table.columns, columns, strict=True))
    if taken := [column for column in table.columns if column.casefold() in XYZ]:
        print(
            f"{path.name}: {', '.join(taken)} are taken for {', '.join(named[one] for one in taken)}.", file=sys.stderr
        )
    check_columns(replace(table, columns=columns), ANCHORS, (*COLUMNS, *OF_MISSIONS), needed=("id",))
    numbers = Numbers(table.delimiter)
    found: list[tuple[str, object]] = []
    for where, cells in table.lines:
        _refuse_many(path, len(found) + 1)
        given = {named[name]: cell for name, cell in cells.items() if cell and named[name] not in OF_MISSIONS}
        fields = {name: cell if name in TEXTS else numbers.number(where, name, cell) for name, cell in given.items()}
        found.append((where, fields))
    return found


def _refuse_many(path: Path, number: int) -> None:
    if number > MOST_ANCHORS:
        raise RequestError(f"The anchors file {path.name} holds more than {MOST_ANCHORS:,} anchors.")


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


def ranging_anchors(asked: Sequence[AnchorIn], *, level: bool) -> tuple[list[RangingAnchor], dict[str, float] | None]:
    """Anchors of ``ranging_asked`` in one level metric frame, and where on Earth that is if they came in degrees.

    level: heights do not matter. Raises RequestError.
    """
    if not asked:
        raise RequestError("At least one anchor is needed: --anchor ID,EAST,NORTH,612msl or --anchors FILE.")
    twice = sorted(anchor_id for anchor_id, count in Counter(anchor.id for anchor in asked).items() if count > 1)
    if twice:
        raise RequestError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
    datums = sorted({anchor.altitude_datum for anchor in asked if anchor.altitude_datum is not None})
    if len(datums) > 1 and not level:
        raise RequestError(
            f"Heights of a detector's anchors count from one datum, not from {' and '.join(datums)}: give all as msl, "
            "or all as hae."
        )
    in_degrees = [anchor for anchor in asked if anchor.lon_deg is not None]
    if not in_degrees:
        return [_ranging(anchor, level) for anchor in asked], None
    if len(in_degrees) < len(asked):
        metric = next(anchor for anchor in asked if anchor.lon_deg is None)
        raise RequestError(
            f"Anchor {in_degrees[0].id} is in degrees and {metric.id} in metres; a detector takes all in one frame."
        )
    return _in_local_frame(asked, level)


def ranging_asked(texts: Sequence[str], files: Sequence[Path], *, level: bool) -> list[AnchorIn]:
    """The anchors of all options as they were asked for, with what a detector does not take. Raises RequestError."""
    asked = [_from_text(text, level) for text in texts]
    return asked + [anchor for path in files for anchor in anchors_from_file(path, level=level)]


def _from_text(text: str, level: bool) -> AnchorIn:
    if level and text.count(",") == 2:
        text = f"{text},0msl"
    try:
        return anchor_from_text(text, lonlat=False)
    except RequestError as error:
        if ANCHOR_FORM in str(error):
            raise RequestError(
                f"--anchor {text!r} is not of the form ID,EAST,NORTH,HEIGHT with HEIGHT like 612msl; {IN_THE_PLANE}."
            ) from error
        raise


def _in_local_frame(asked: Sequence[AnchorIn], level: bool) -> tuple[list[RangingAnchor], dict[str, float]]:
    """Anchors in degrees as east, north, up of the place amid them, straight as ranges are: no map's scale is in it.

    Up counts from sea level, or from whatever altitudes count from, at that place.
    """
    degrees = np.array([(anchor.lon_deg, anchor.lat_deg) for anchor in asked], np.float64)
    heights_m = np.array([0.0 if level else _altitude_m(anchor) for anchor in asked])
    if np.ptp(degrees[:, 0]) > 180.0:
        degrees[:, 0] %= 360.0  # they lie on both sides of the antimeridian
    lon_deg, lat_deg = (float(mean) for mean in degrees.mean(axis=0))
    middle = Place(lon_deg, lat_deg, float(heights_m.mean()))
    places = zip(degrees.tolist(), heights_m.tolist(), strict=True)
    at_ecef_m = np.array([place_ecef_m(Place(lon, lat, up_m)) for (lon, lat), up_m in places])
    enu_m = ecef_to_enu_m(middle, at_ecef_m)
    ups_m = np.zeros(len(asked)) if level else enu_m[:, 2] + middle.height_m
    anchors = [
        _made(anchor, east_m, north_m, altitude_m)
        for anchor, (east_m, north_m, _), altitude_m in zip(asked, enu_m.tolist(), ups_m.tolist(), strict=True)
    ]
    place = {"lon_deg": (lon_deg + 180.0) % 360.0 - 180.0, "lat_deg": lat_deg, "up_m": middle.height_m}
    return anchors, place


def _altitude_m(anchor: AnchorIn) -> float:
    if anchor.altitude_m is None:
        raise RequestError(
            f"Anchor {anchor.id}: a detector knows no ground; give its altitude (612msl, altitude_m in a file), or "
            f"{IN_THE_PLANE}."
        )
    return anchor.altitude_m


def _ranging(anchor: AnchorIn, level: bool) -> RangingAnchor:
    if anchor.east_m is None or anchor.north_m is None:
        raise RequestError(f"Anchor {anchor.id}: a detector needs east_m and north_m, or lon_deg and lat_deg.")
    altitude_m = 0.0 if level and anchor.altitude_m is None else _altitude_m(anchor)
    return _made(anchor, anchor.east_m, anchor.north_m, altitude_m)


def _made(anchor: AnchorIn, east_m: float, north_m: float, altitude_m: float) -> RangingAnchor:
    try:
        return RangingAnchor(anchor.id, east_m, north_m, altitude_m, anchor.pose_sigma_m)
    except DetectionInputError as error:
        raise RequestError(str(error)) from error
