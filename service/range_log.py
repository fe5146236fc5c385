"""Range logs: CSV of what a rover measured, a range in each row, or all ranges of a moment in one."""

from __future__ import annotations

import csv
import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from detection import OdometryIncrement, RangeMeasurement
from service.errors import RequestError
from service.tables import text_of

__all__ = ["COLUMNS", "Row", "read_range_log"]

RANGE = ("anchor_id", "range_m", "sigma_m", "p_sight")
WHEELS = ("wheel_x_m", "wheel_y_m")
ACCELEROMETER = ("accel_x_m", "accel_y_m", "accel_z_m")
ODOMETRY = ("duration_s", *WHEELS, *ACCELEROMETER, "heading_deg")
COLUMNS = ("time_s", *RANGE, *ODOMETRY)
# with all ranges of a moment in one row: range_m.D1, sigma_m.D1, p_sight.D1
WIDE = ("range_m.", "sigma_m.", "p_sight.")
DELIMITERS = ",;\t"


@dataclass(frozen=True, slots=True)
class Row:
    """One row: when, and either a range or a motion that ends then."""

    time_s: float
    measured: RangeMeasurement | None
    motion: OdometryIncrement | None


def read_range_log(path: Path) -> list[Row]:
    """The rows of a log, in the file's order; numbers that no sensor should deliver stay as they are.

    A row with anchor_id is a range; one without is the motion in the duration_s before its time_s. A log with columns
    range_m.ID has in each row the ranges of one moment and the motion before it. Raises RequestError.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            return list(_rows(path.name, file))
    except UnicodeDecodeError as error:
        raise RequestError(f"The log {path.name} is not UTF-8 text.") from error
    except csv.Error as error:
        raise RequestError(f"The log {path.name} is not CSV: {error}.") from error
    except OSError as error:
        raise RequestError(f"The log {str(path)!r} cannot be read: {error.strerror}.") from error


def _rows(name: str, lines: Iterator[str]) -> Iterator[Row]:
    first = next(lines, "")
    delimiter = max(DELIMITERS, key=first.count)
    header = [column.strip() for column in next(csv.reader([first], delimiter=delimiter, strict=True), [])]
    wide = any(column.startswith(WIDE) for column in header)
    _check_header(name, header, wide)
    reader = csv.DictReader(lines, header, skipinitialspace=True, restkey="", strict=True, delimiter=delimiter)
    for raw in reader:
        where = f"{name}, line {reader.line_num + 1}"
        if "" in raw:
            raise RequestError(f"{where}: more cells than columns.")
        cells = {column: (cell or "").strip() for column, cell in raw.items()}
        if wide:
            yield from _wide_rows(where, cells)
        else:
            yield _row(where, cells)


def _check_header(name: str, header: Sequence[str], wide: bool) -> None:
    known = ("time_s", *ODOMETRY) if wide else COLUMNS
    strange = [column for column in header if column not in known and not (wide and column.startswith(WIDE))]
    missing = [column for column in ("time_s",) if column not in header]
    if not wide:
        missing += [column for column in ("anchor_id", "range_m") if column not in header]
    for column in header:
        _, _, anchor_id = column.partition(".")
        if wide and column.startswith(WIDE) and f"range_m.{anchor_id}" not in header:
            missing.append(f"range_m.{anchor_id}")
    twice = [column for column, times in Counter(header).items() if times > 1]
    if strange or missing or twice:
        wrong = f"unknown column {strange[0]!r}" if strange else f"no column {missing[0]!r}" if missing else ""
        wrong = wrong or f"the column {twice[0]!r} twice"
        names = f"{', '.join(COLUMNS)}, or range_m.ID, sigma_m.ID, p_sight.ID for each anchor"
        raise RequestError(f"The log {name} has {wrong}; its first line names columns out of {names}.")


def _wide_rows(where: str, cells: Mapping[str, str]) -> Iterator[Row]:
    """The motion, if the row has one, then a range for every anchor whose cell is not empty."""
    numbers = {column: _number(where, column, cell) for column, cell in cells.items()}
    time_s = numbers["time_s"]
    if time_s is None:
        raise RequestError(f"{where}: time_s is missing.")
    if any(numbers.get(column) is not None for column in ODOMETRY):
        yield Row(time_s, None, _motion(where, {column: numbers.get(column) for column in ODOMETRY}))
    for column, range_m in numbers.items():
        if column.startswith("range_m.") and range_m is not None:
            anchor_id = column.removeprefix("range_m.")
            sigma_m, p_sight = numbers.get(f"sigma_m.{anchor_id}"), numbers.get(f"p_sight.{anchor_id}")
            yield Row(time_s, RangeMeasurement(anchor_id, range_m, sigma_m, p_sight, time_s), None)


def _row(where: str, cells: dict[str, str]) -> Row:
    anchor_id = text_of(cells["anchor_id"])
    numbers = {column: _number(where, column, cells.get(column, "")) for column in COLUMNS if column != "anchor_id"}
    time_s = numbers["time_s"]
    if time_s is None:
        raise RequestError(f"{where}: time_s is missing.")
    moved = [column for column in ODOMETRY if numbers[column] is not None]
    if anchor_id:
        if moved:
            raise RequestError(f"{where}: a row is a range or a motion; this one has anchor_id and {moved[0]}.")
        range_m = numbers["range_m"]
        if range_m is None:
            raise RequestError(f"{where}: range_m is missing; a range that failed is written as nan.")
        return Row(time_s, RangeMeasurement(anchor_id, range_m, numbers["sigma_m"], numbers["p_sight"], time_s), None)
    if not moved:
        raise RequestError(f"{where}: neither a range (anchor_id, range_m) nor a motion (duration_s, wheel_x_m …).")
    return Row(time_s, None, _motion(where, numbers))


def _motion(where: str, numbers: dict[str, float | None]) -> OdometryIncrement:
    duration_s, heading_deg = numbers["duration_s"], numbers["heading_deg"]
    if duration_s is None:
        raise RequestError(f"{where}: a motion needs duration_s.")
    wheels, felt = _vector(where, numbers, WHEELS), _vector(where, numbers, ACCELEROMETER)
    if wheels is None and felt is None:
        raise RequestError(f"{where}: a motion needs {', '.join(WHEELS)} or {', '.join(ACCELEROMETER)}.")
    return OdometryIncrement(
        duration_s,
        None if wheels is None else (wheels[0], wheels[1]),
        None if felt is None else (felt[0], felt[1], felt[2]),
        None if heading_deg is None else math.radians(heading_deg),
    )


def _vector(where: str, numbers: dict[str, float | None], columns: Sequence[str]) -> list[float] | None:
    parts = [number for column in columns if (number := numbers[column]) is not None]
    if parts and len(parts) < len(columns):
        raise RequestError(f"{where}: {', '.join(columns)} go together.")
    return parts or None


def _number(where: str, column: str, cell: str) -> float | None:
    if not cell:
        return None
    try:
        return float(cell)
    except ValueError as error:
        raise RequestError(f"{where}: {column} is {cell[:40]!r}, not a number.") from error
