"""Range logs: CSV of what a rover measured, a range in each row, or all ranges of a moment in one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from detection import OdometryIncrement, RangeMeasurement
from service.errors import RequestError
from service.files.csv_table import CsvTable, Numbers, holds_nothing, read_csv_table

__all__ = ["COLUMNS", "LENGTHS_M", "PLAIN", "TIMES_S", "LogForm", "RangeLog", "Row", "read_range_log"]

RANGE = ("anchor_id", "range_m", "sigma_m", "p_sight")
WHEELS = ("wheel_x_m", "wheel_y_m")
ACCELEROMETER = ("accel_x_m", "accel_y_m", "accel_z_m")
ODOMETRY = ("duration_s", *WHEELS, *ACCELEROMETER, "heading_deg")
COLUMNS = ("time_s", *RANGE, *ODOMETRY)
# with all ranges of a moment in one row: range_m.D1, sigma_m.D1, p_sight.D1
WIDE = ("range_m.", "sigma_m.", "p_sight.")
NEEDED = ("time_s", "anchor_id", "range_m")
LENGTHS_M = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "ft": 0.3048}
TIMES_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# Parts of names by which other programs' columns are offered where one of ours is missing, likeliest first.
HINTS = {
    "time_s": ("time", "stamp", "secs"),
    "anchor_id": ("anchor", "beacon", "dest", "id"),
    "range_m": ("range", "dist"),
}


@dataclass(frozen=True, slots=True)
class Row:
    """One row: when, and either a range or a motion that ends then."""

    time_s: float
    measured: RangeMeasurement | None
    motion: OdometryIncrement | None


@dataclass(frozen=True, slots=True)
class LogForm:
    """What of a log is otherwise than documented. columns: our name of a column to that in the file.

    time_unit, range_unit: of time_s, and of range_m and sigma_m, out of TIMES_S and LENGTHS_M.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    time_unit: str = "s"
    range_unit: str = "m"

    def __post_init__(self) -> None:
        for what, unit, units in (("time", self.time_unit, TIMES_S), ("range", self.range_unit, LENGTHS_M)):
            if unit not in units:
                raise RequestError(f"A {what} unit is one of {', '.join(units)}, not {unit!r}.")
        for name, column in self.columns.items():
            if name not in COLUMNS and not (name.startswith(WIDE) and name.partition(".")[2]):
                raise RequestError(f"{name!r} is no column of a log: take {', '.join(COLUMNS)}, or range_m.ID.")
            if not column:
                raise RequestError(f"Column {name} needs the name of a column in the file.")


@dataclass(frozen=True, slots=True)
class RangeLog:
    """The rows of a log in the file's order, and what was passed over in it, in sentences."""

    rows: list[Row]
    warnings: list[str]


PLAIN = LogForm()


def read_range_log(path: Path, form: LogForm = PLAIN) -> RangeLog:
    """The rows of a log, in the file's order; numbers that no sensor should deliver stay as they are.

    A row with anchor_id is a range; one without is the motion in the duration_s before its time_s. A log with columns
    range_m.ID has in each row the ranges of one moment and the motion before it. Columns that no log has are passed
    over, and told. Raises RequestError.
    """
    table = read_csv_table(path, "log")
    names = _our_names(table, form)
    wide = any(name.startswith(WIDE) for name in names.values())
    known = ("time_s", *ODOMETRY) if wide else COLUMNS
    used = {column: name for column, name in names.items() if name in known or (wide and name.startswith(WIDE))}
    _check_columns(table, names, used, wide)
    passed = [column for column in table.columns if column not in used]
    warnings = [f"Columns that no log has were passed over: {', '.join(passed[:8])}."] if passed else []
    numbers = _LogNumbers(Numbers(table.delimiter), form)
    rows: list[Row] = []
    for where, raw in table.lines:
        cells = {name: raw[column] for column, name in used.items()}
        rows += _wide_rows(where, cells, numbers) if wide else [_row(where, cells, numbers)]
    return RangeLog(rows, warnings)


def _our_names(table: CsvTable, form: LogForm) -> dict[str, str]:
    """Our name of each column of a table: by the form where that says one, else its own."""
    missing = [column for column in form.columns.values() if column not in table.columns]
    if missing:
        raise RequestError(
            f"The log {table.name} has no column {missing[0]!r} as --columns says; it has {', '.join(table.columns)}."
        )
    renamed = {column: name for name, column in form.columns.items()}
    own = {column: column for column in table.columns if column not in renamed and column not in form.columns}
    return {**own, **renamed}


def _check_columns(table: CsvTable, names: Mapping[str, str], used: Mapping[str, str], wide: bool) -> None:
    there = set(used.values())
    mixed = [column for column, name in names.items() if wide and name in RANGE]
    needed = ["time_s"] if wide else list(NEEDED)
    needed += [f"range_m.{name.partition('.')[2]}" for name in there if wide and name.startswith(WIDE)]
    missing = [name for name in needed if name not in there]
    twice = [column for column, count in Counter(table.columns).items() if count > 1 and column in used]
    if not (mixed or missing or twice):
        return
    wrong = f"unknown column {mixed[0]!r}" if mixed else f"no column {missing[0]!r}" if missing else ""
    wrong = wrong or f"the column {twice[0]!r} twice"
    ours = f"{', '.join(COLUMNS)}, or range_m.ID, sigma_m.ID, p_sight.ID for each anchor"
    raise RequestError(
        f"The log {table.name} has {wrong}; its first line names columns out of {ours}.{_cure(table, missing)}"
    )


def _cure(table: CsvTable, missing: Sequence[str]) -> str:
    """What to type where columns have other names; names that look like it are offered."""
    if not (missing and len(table.columns) > 1):
        return ""
    pairs = []
    for name in NEEDED:
        likely = [column for hint in HINTS[name] for column in table.columns if hint in column.casefold()]
        pairs.append(f"{name}={name if name in table.columns else likely[0] if likely else '…'}")
    return f" This one has {', '.join(table.columns[:12])}: say which is which, as in --columns {','.join(pairs)}."


@dataclass(frozen=True, slots=True)
class _LogNumbers:
    """Numbers of a log in the units of its form, as seconds and metres."""

    numbers: Numbers
    form: LogForm

    def number(self, where: str, column: str, cell: str) -> float | None:
        """None for a cell that holds nothing."""
        if holds_nothing(cell):
            return None
        if column == "time_s":
            return self.numbers.time_s(where, column, cell, TIMES_S[self.form.time_unit])
        number = self.numbers.number(where, column, cell)
        return number * LENGTHS_M[self.form.range_unit] if column.startswith(("range_m", "sigma_m")) else number


def _wide_rows(where: str, cells: Mapping[str, str], reader: _LogNumbers) -> Iterator[Row]:
    """The motion, if the row has one, then a range for every anchor whose cell is not empty."""
    numbers = {column: reader.number(where, column, cell) for column, cell in cells.items()}
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


def _row(where: str, cells: Mapping[str, str], reader: _LogNumbers) -> Row:
    # an anchor may be called NA; only what databases write is no name
    anchor_id = "" if cells["anchor_id"] in (r"\N", "NULL", "null") else cells["anchor_id"]
    numbers = {
        column: reader.number(where, column, cells.get(column, "")) for column in COLUMNS if column != "anchor_id"
    }
    time_s = numbers["time_s"]
    if time_s is None:
        raise RequestError(f"{where}: time_s is missing.")
    moved = [column for column in ODOMETRY if numbers[column] is not None]
    if anchor_id:
        if moved:
            raise RequestError(f"{where}: a row is a range or a motion; this one has anchor_id and {moved[0]}.")
        range_m = numbers["range_m"]
        if range_m is None and cells["range_m"]:
            range_m = math.nan  # NULL: it failed
        if range_m is None:
            raise RequestError(f"{where}: range_m is missing; a range that failed is written as nan.")
        return Row(time_s, RangeMeasurement(anchor_id, range_m, numbers["sigma_m"], numbers["p_sight"], time_s), None)
    if not moved:
        raise RequestError(f"{where}: neither a range (anchor_id, range_m) nor a motion (duration_s, wheel_x_m …).")
    return Row(time_s, None, _motion(where, numbers))


def _motion(where: str, numbers: Mapping[str, float | None]) -> OdometryIncrement:
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


def _vector(where: str, numbers: Mapping[str, float | None], columns: Sequence[str]) -> list[float] | None:
    parts = [number for column in columns if (number := numbers[column]) is not None]
    if parts and len(parts) < len(columns):
        raise RequestError(f"{where}: {', '.join(columns)} go together.")
    return parts or None
