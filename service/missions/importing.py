"""Places in anybody's file brought onto a ground: metres in its CRS, altitudes in its datum, and what was lost."""

from __future__ import annotations

import math
import sys
from codecs import BOM_UTF8
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import get_args

from pydantic import BaseModel, Field, ValidationError
from pydantic_core import from_json

from service.errors import RequestError
from service.files.csv_table import Numbers, check_columns, read_csv_table
from service.files.foreign.features import Allowance
from service.files.foreign.reading import FOREIGN_SUFFIXES, read_foreign_file
from service.missions.document import MissionPlace
from service.parts.altitude_datums import in_dem_datum
from service.parts.anchors import AnchorIn
from service.parts.geojson_reading import Fields, GeoJsonShape, shapes_of
from service.parts.points import PointIn, StrictModel
from service.parts.radios import RadioName
from terrain import ElevationGrid, FrameError, height_at, to_grid_frame

__all__ = ["ImportOut", "ImportedLine", "ImportedPoint", "import_places"]

SUFFIXES = (".geojson", ".json", ".csv", *FOREIGN_SUFFIXES)
TEXTS = frozenset({"id", "body", "altitude_datum", "kind", "what", "radio"})
COLUMNS = (*(field for field in AnchorIn.model_fields if field != "pose_covariance_m2"), "kind", "what")
HEIGHTS = ("above_ground_m", "altitude_m", "altitude_datum")
NUMBERS = ("max_range_m", "azimuth_from_deg", "azimuth_to_deg", "ranging_sigma_m")
RADIOS: dict[str, RadioName] = {name: name for name in get_args(RadioName)}
MOST_PLACES = 10_000
# what rounding places and altitudes of a file may shift a height above the ground by
CENTIMETRES_M = 0.02
SHOWN = 5


class ImportedPoint(MissionPlace):
    """A point of the file, with the fields of an anchor as far as the file has them."""

    id: str = Field(description="What the file calls it, or its number in the file.")
    what: str | None = Field(None, description="What the file says it is: way-point, landing, rally point …")
    kind: str | None = Field(None, description="What carries it, when the file says drone, mast or beacon.")
    above_ground_m: float | None = Field(None, description="Height above the ground, metres, when that is given.")
    altitude_m: float | None = Field(None, description="Altitude in the DEM's vertical datum, metres, when given.")
    max_range_m: float | None = Field(None, description="Longest slant range, metres, when given.")
    azimuth_from_deg: float | None = Field(None, description="Start of its sector, degrees from grid north.")
    azimuth_to_deg: float | None = Field(None, description="End of its sector, degrees from grid north.")
    ranging_sigma_m: float | None = Field(None, description="One-sigma error of its ranges, metres, when given.")
    radio: RadioName | None = Field(None, description="Budget of its radio by name, when the file has one of ours.")


class ImportedLine(BaseModel):
    """A line of the file, or the outer ring of an area, whose last corner is not the first again."""

    id: str = Field(description="What the file calls it, or its number in the file.")
    what: str | None = Field(None, description="What the file says it is: route, track, no-go, keep-in, survey …")
    places: list[MissionPlace] = Field(description="Its corners in order.")


class ImportOut(BaseModel):
    """All places of a file on one ground."""

    format: str = Field(description="What the file was read as.")
    points: list[ImportedPoint] = Field(description="Points on the ground.")
    lines: list[ImportedLine] = Field(description="Lines with all corners on the ground.")
    areas: list[ImportedLine] = Field(description="Outer rings of areas that meet the ground.")
    told: list[str] = Field(description="What was left out, assumed or converted, in sentences.")


class _Heights(StrictModel):
    points: list[PointIn]


def import_places(path: Path, grid: ElevationGrid) -> ImportOut:
    """The places of a file of a format that is known by its suffix. Raises RequestError, FrameError, and more.

    VerticalDatumError: an altitude that cannot be brought to the grid's datum.
    """
    format_name, shapes, told = _shapes(path)
    points, more = _points(path.name, [shape for shape in shapes if shape.kind == "Point"], grid)
    told += more
    lines, outside = _lines((shape for shape in shapes if shape.kind == "LineString"), grid, needs_all=True)
    areas, missed = _lines((shape for shape in shapes if shape.kind == "Polygon"), grid, needs_all=False)
    told += _named("Outside the ground, and left out", [*outside, *missed])
    holes = [_id(number, shape) for number, shape in enumerate(shapes, 1) if len(shape.lines) > 1]
    told += _named("Holes in areas were closed", holes)
    return ImportOut(format=format_name, points=points, lines=lines, areas=areas, told=told)


def _shapes(path: Path) -> tuple[str, list[GeoJsonShape], list[str]]:
    suffix, called = path.suffix.lower(), f"The file {path.name}"
    if suffix in FOREIGN_SUFFIXES:
        foreign = read_foreign_file(path, MOST_PLACES)
        if not foreign.features:
            raise RequestError(f"{called} holds no places.")
        document = {"type": "FeatureCollection", "features": [*foreign.features]}
        return foreign.format, shapes_of(document, called, MOST_PLACES), [*foreign.told]
    if suffix == ".csv":
        return "CSV", _of_table(path), []
    if suffix not in SUFFIXES:
        raise RequestError(f"{called} must end in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}.")
    try:
        document = from_json(path.read_bytes().removeprefix(BOM_UTF8))
    except ValueError as error:
        raise RequestError(f"{called} is not JSON: {str(error)[:200]}.") from error
    entries = document.get("anchors", document) if isinstance(document, dict) else document
    if isinstance(entries, list):
        Allowance(called, MOST_PLACES).refuse(len(entries))
        return "anchors", [_shape(one, f"{called}, anchor {number}") for number, one in enumerate(entries, 1)], []
    return "GeoJSON", shapes_of(document, called, MOST_PLACES), []


def _of_table(path: Path) -> list[GeoJsonShape]:
    table = read_csv_table(path, "file", comments_within=False)
    check_columns(table, "file", COLUMNS)
    numbers, allowance = Numbers(table.delimiter), Allowance(f"The file {path.name}", MOST_PLACES)
    shapes = []
    for where, cells in table.lines:
        allowance.take(1)
        given = {name: cell for name, cell in cells.items() if cell}
        texts = {name: cell for name, cell in given.items() if name in TEXTS}
        told = {name: numbers.number(where, name, cell) for name, cell in given.items() if name not in TEXTS}
        shapes.append(_shape({**texts, **told}, where))
    return shapes


def _shape(fields: object, where: str) -> GeoJsonShape:
    """A point of the fields of a request."""
    if not isinstance(fields, dict):
        raise RequestError(f"{where}: a place must be an object.")
    place = {name: fields[name] for name in ("east_m", "north_m", "lon_deg", "lat_deg") if name in fields}
    return GeoJsonShape("Point", ([place],), {"id": fields.get("id"), "properties": fields})


def _points(name: str, shapes: Sequence[GeoJsonShape], grid: ElevationGrid) -> tuple[list[ImportedPoint], list[str]]:
    ids = [_id(number, shape) for number, shape in enumerate(shapes, 1)]
    placed: list[PointIn] = []
    for id, shape in zip(ids, shapes, strict=True):
        given = {field: value for field in HEIGHTS if (value := shape.properties.get(field)) is not None}
        # a place without a height is looked at as one on the ground, and has none in the answer
        height = given if set(given) & set(HEIGHTS[:2]) else {"above_ground_m": 0.0}
        try:
            placed.append(PointIn.model_validate({**shape.lines[0][0], **height}))
        except ValidationError as error:
            raise RequestError(f"{name}, {id}: {error.errors()[0]['msg'].removeprefix('Value error, ')}") from error
    brought, told = in_dem_datum(grid, _Heights(points=placed))
    found: list[ImportedPoint] = []
    outside: list[str] = []
    radios: dict[str, str] = {}
    for id, shape, point in zip(ids, shapes, brought.points, strict=True):
        properties, where = shape.properties, f"{name}, {id}"
        numbers = {field: _number(properties, field, where) for field in NUMBERS}
        place = _metres(point.model_dump(), grid)
        if not _is_within(place, grid):
            outside.append(id)
            continue
        has_height = any(properties.get(field) is not None for field in HEIGHTS[:2])
        above_m, altitude_m = (point.above_ground_m if has_height else None), point.altitude_m
        if altitude_m is not None and properties.get("height_from") == "above_ground_m":
            above_m, altitude_m = _above_ground(place, altitude_m, _number(properties, "height_m", where), grid)
        radio = _word(properties.get("radio"))
        if radio is not None and radio not in RADIOS:
            radios[id] = radio
        found.append(
            ImportedPoint(
                east_m=place.east_m,
                north_m=place.north_m,
                id=id,
                what=_word(properties.get("what")),
                kind=_word(properties.get("kind")),
                above_ground_m=above_m,
                altitude_m=altitude_m,
                max_range_m=numbers["max_range_m"],
                azimuth_from_deg=numbers["azimuth_from_deg"],
                azimuth_to_deg=numbers["azimuth_to_deg"],
                ranging_sigma_m=numbers["ranging_sigma_m"],
                radio=RADIOS.get(radio or ""),
            )
        )
    told = (*told, *_named("Outside the ground, and left out", outside))
    named = [f"{id} ({radio})" for id, radio in radios.items()]
    return found, [*told, *_named(f"Radios other than {', '.join(RADIOS)} are left out", named)]


def _above_ground(
    place: MissionPlace, altitude_m: float, given_m: float | None, grid: ElevationGrid
) -> tuple[float | None, float | None]:
    """(height above the ground, None) of what a file has as an altitude; (None, altitude) over unknown ground.

    given_m: the height as the file tells it besides, which stands unless its altitude was changed since.
    """
    above_m = altitude_m - float(height_at(grid, place.east_m, place.north_m))
    if math.isnan(above_m):
        return None, altitude_m
    as_given = given_m is not None and abs(above_m - given_m) <= CENTIMETRES_M
    return (given_m if as_given else round(above_m, 2)), None


def _lines(
    shapes: Iterable[GeoJsonShape], grid: ElevationGrid, *, needs_all: bool
) -> tuple[list[ImportedLine], list[str]]:
    """(lines, or outer rings of areas; the names of those that are not on the ground)."""
    found: list[ImportedLine] = []
    outside: list[str] = []
    for number, shape in enumerate(shapes, 1):
        places = [_metres(place, grid) for place in shape.lines[0]]
        if shape.kind == "Polygon" and places[0] == places[-1]:
            places = places[:-1]
        within = [_is_within(place, grid) for place in places]
        if all(within) if needs_all else any(within):
            line = ImportedLine(id=_id(number, shape), what=_word(shape.properties.get("what")), places=places)
            found.append(line)
        else:
            outside.append(_id(number, shape))
    return found, outside


def _metres(place: Fields, grid: ElevationGrid) -> MissionPlace:
    match place:
        case {"east_m": float() | int() as east_m, "north_m": float() | int() as north_m}:
            return MissionPlace(east_m=float(east_m), north_m=float(north_m))
        case {"lon_deg": float() | int() as lon_deg, "lat_deg": float() | int() as lat_deg}:
            east_m, north_m = to_grid_frame(grid, float(lon_deg), float(lat_deg))
            if not (math.isfinite(east_m) and math.isfinite(north_m)):
                raise FrameError(f"The CRS of the DEM cannot express {lon_deg:g}°, {lat_deg:g}°.")
            return MissionPlace(east_m=round(east_m, 3), north_m=round(north_m, 3))
    raise RequestError("A place needs east_m and north_m, or lon_deg and lat_deg.")


def _is_within(place: MissionPlace, grid: ElevationGrid) -> bool:
    west, south, east, north = grid.bounds_m
    return west <= place.east_m <= east and south <= place.north_m <= north


def _id(number: int, shape: GeoJsonShape) -> str:
    told = shape.feature.get("id") or shape.properties.get("id") or shape.properties.get("name")
    return str(number) if told is None else str(told)[:64]


def _named(what: str, ids: Sequence[str]) -> list[str]:
    if not ids:
        return []
    more = f" and {len(ids) - SHOWN} more" if len(ids) > SHOWN else ""
    return [f"{what}: {', '.join(ids[:SHOWN])}{more}."]


def _word(value: object) -> str | None:
    return value[:64] if isinstance(value, str) else None


def _number(properties: Mapping[str, object], field: str, where: str) -> float | None:
    """What a place says of itself, None where it says nothing. Raises RequestError."""
    value = properties.get(field)
    # a comparison, for a whole number may be too large for isfinite
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max:
        return float(value)
    if value is None:
        return None
    raise RequestError(f"{where}: {field} is {str(value)[:40]!r}, not a finite number.")
