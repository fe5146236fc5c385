"""Shapes and trajectories in files: GeoJSON, a table whose columns are a request's, or path.csv of a plan."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import JsonValue, ValidationError

from planning.questions.models import NavigationModel
from service.errors import RequestError
from service.files.csv_table import CsvTable, Numbers, check_columns, read_csv_table
from service.files.written import written_number
from service.parts.geojson_reading import Fields, line_of, polygons_of, shapes_of
from service.parts.points import PointIn
from service.parts.sentences import sentence_of
from service.products.paths.answer import VERTEX_COLUMNS

from .foreign_files import foreign_document, is_foreign
from .texts import height_field

__all__ = [
    "Trajectory",
    "path_fields",
    "path_from_file",
    "place_fields",
    "polygon_fields",
    "stand_off_fields",
    "trajectory_from_file",
    "weight_fields",
]

PATH = "path file"
# cells are numbers
DATUM = "altitude_datum"
COLUMNS = tuple(field for field in PointIn.model_fields if field not in ("body", DATUM))
PLANNED = {f"{name.removesuffix('_rad')}_deg" if name.endswith("_rad") else name for name in VERTEX_COLUMNS}
COVARIANCE = ("ee_m2", "en_m2", "eu_m2", "nn_m2", "nu_m2", "uu_m2")


def polygon_fields(path: Path) -> list[Fields]:
    """The polygons of a file. Raises RequestError."""
    return [polygon for polygon, _ in polygons_of(_document(path, "Polygon"), _called(path))]


def weight_fields(path: Path) -> list[Fields]:
    """The polygons of a file with their property ``weight``. Raises RequestError."""
    found = []
    for polygon, properties in polygons_of(_document(path, "Polygon"), _called(path)):
        if "weight" not in properties:
            raise RequestError(f"The file {path.name} holds a polygon without the property weight.")
        found.append({"polygon": polygon, "weight": properties["weight"]})
    return found


def path_fields(path: Path) -> list[Fields]:
    """The places of a file's line, or of the path that a plan wrote. Raises RequestError."""
    if path.suffix.lower() != ".csv":
        return line_of(_document(path, "LineString"), _called(path))
    table = read_csv_table(path, PATH, comments_within=False)
    if not set(table.columns) >= PLANNED:
        raise RequestError(f"The file {path.name} is not path.csv of sightline plan; other paths are GeoJSON lines.")
    return [{"east_m": one["east_m"], "north_m": one["north_m"]} for one in _planned_rows(table)]


def place_fields(path: Path) -> list[Fields]:
    """The points of a file, and the corners of its lines. Raises RequestError."""
    found: list[Fields] = []
    for shape in shapes_of(_document(path, "Point"), _called(path)):
        if shape.kind == "Polygon":
            raise RequestError(f"{_called(path)} holds a Polygon; places are points, or the corners of lines.")
        found += shape.lines[0]
    return found


def stand_off_fields(text: str) -> list[Fields]:
    """FILE,METRES as stand-off distances to everything in the file. Raises RequestError."""
    name, comma, metres = text.rpartition(",")
    try:
        distance_m = written_number(metres)
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


def _document(path: Path, kind: str | None = None) -> object:
    """GeoJSON in a file. kind: of the geometries to take from another program's file, whose others are told."""
    if is_foreign(path):
        return foreign_document(path, kind, _called(path))
    try:
        document: JsonValue = json.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The file {str(path)!r} cannot be read: {error.strerror}.") from error
    except (ValueError, RecursionError) as error:
        raise RequestError(f"The file {path.name} is not JSON: {error}.") from error
    return document


def _called(path: Path) -> str:
    return f"The file {path.name}"


@dataclass(frozen=True, slots=True)
class Trajectory:
    """Points, seconds and covariances (the six of COVARIANCE, m²) at each; planned: it is the path of a plan."""

    points: list[PointIn]
    times_s: list[float] | None = None
    covariances_m2: list[tuple[float, ...]] | None = None
    planned: bool = False

    def fields(self) -> dict[str, object]:
        """As a bubble's request has them; of a planned path with the filter that the plan foresaw.

        So that both tell one figure for one path.
        """
        found: dict[str, object] = {"points": self.points}
        if self.times_s is not None:
            found["times_s"] = self.times_s
        if self.covariances_m2 is not None:
            found["covariances_m2"] = self.covariances_m2
        return {**found, **_filter_of_a_plan()} if self.planned else found


def path_from_file(path: Path, antenna_above_ground_m: float) -> list[PointIn]:
    """The points of a file; those of a line or a planned path are so high above the ground. Raises RequestError."""
    return trajectory_from_file(path, None, {"above_ground_m": antenna_above_ground_m}).points


def trajectory_from_file(path: Path, height: str | None, usual: Mapping[str, float] | None = None) -> Trajectory:
    """The trajectory of a file.

    height: of every point of a line or a planned path, as typed; usual: as a field of a request, where none was.
    Raises RequestError.
    """
    metres = usual if height is None else _metres(height)
    if path.suffix.lower() in (".geojson", ".json") or is_foreign(path):
        if metres is None:
            raise RequestError("A path in GeoJSON, KML, GPX or a .plan needs --height, such as 30agl or 1500msl.")
        return Trajectory([_point(path.name, {**place, **metres}) for place in path_fields(path)])
    table = read_csv_table(path, PATH, comments_within=False)
    if set(table.columns) >= PLANNED:
        return _planned(table, metres)
    if height is not None:
        raise RequestError(
            "--height is for paths in GeoJSON and planned ones; a CSV file has the column above_ground_m or altitude_m."
        )
    points, told = _points_and_columns(table, ("time_s", *COVARIANCE))
    there = [column for column in COVARIANCE if column in told]
    missing = [column for column in COVARIANCE if column not in told]
    if there and missing:
        raise RequestError(f"The path file {path.name} has {there[0]} but not {missing[0]}; a covariance needs all.")
    covariances_m2 = list(zip(*(told[column] for column in COVARIANCE), strict=True)) if there else None
    return Trajectory(points, told.get("time_s"), covariances_m2)


def _planned(table: CsvTable, metres: Mapping[str, float] | Mapping[str, float | str] | None) -> Trajectory:
    """Altitudes of such a table are the ground's: where the antenna is above it, the table does not say."""
    told = _planned_rows(table)
    if metres is None:
        raise RequestError(
            f"{table.name} is a planned path, whose altitudes are the ground's: say with --height how high "
            "the antenna is, such as 1.5agl."
        )
    times_s = [row.pop("time_s") for row in told]
    return Trajectory([_point(table.name, {**place, **metres}) for place in told], times_s, planned=True)


def _planned_rows(table: CsvTable) -> list[dict[str, float]]:
    """east_m, north_m and time_s of each vertex. Raises RequestError."""
    numbers = Numbers(table.delimiter)
    try:
        told = [
            {name: numbers.number(where, name, cells[name]) for name in ("east_m", "north_m", "time_s")}
            for where, cells in table.lines
        ]
    except RequestError as error:
        raise RequestError(f"The path file {table.name} is not as sightline plan writes it: {error}") from error
    if not told:
        raise RequestError(f"The path file {table.name} holds no points.")
    return told


def _points_and_columns(table: CsvTable, more: tuple[str, ...] = ()) -> tuple[list[PointIn], dict[str, list[float]]]:
    """The points of a table, and those of the columns ``more`` that it has. Raises RequestError."""
    check_columns(table, PATH, (*COLUMNS, DATUM, *more))
    numbers = Numbers(table.delimiter)
    told: dict[str, list[float]] = {column: [] for column in more if column in table.columns}
    points = []
    for where, cells in table.lines:
        datum = cells.pop(DATUM, "")
        row = numbers.row(where, cells)
        for column, values in told.items():
            if column not in row:
                raise RequestError(f"{where}: {column} is empty.")
            values.append(row.pop(column))
        points.append(_point(where, {**row, DATUM: datum} if datum else row))
    if not points:
        raise RequestError(f"The path file {table.name} holds no points.")
    return points, told


def _filter_of_a_plan() -> dict[str, object]:
    """The fields of a bubble's request with which it foresees what a plan does unless it is told otherwise."""
    model = NavigationModel()
    return {
        "ranging_interval_s": model.interval_s,
        "initial_position_sigma_m": model.initial_sigma_m,
        "initial_velocity_sigma_m_per_s": model.initial_velocity_sigma_m_per_s,
        "ground_sigma_m": model.ground_sigma_m,
        "motion": {"horizontal_m2_per_s3": model.motion.east_m2_per_s3, "up_m2_per_s3": model.motion.up_m2_per_s3},
        "on_ground": True,
    }


def _metres(height: str) -> dict[str, float | str]:
    return height_field(height, f"--height {height!r} is not of the form 30agl (above ground) or 1500msl (altitude).")


def _point(where: str, fields: Mapping[str, object]) -> PointIn:
    try:
        return PointIn.model_validate(fields)
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error
