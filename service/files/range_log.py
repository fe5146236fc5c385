"""Range logs: tables of what a rover measured, a range in each row, or all ranges of a moment in one."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from detection import OdometryIncrement, RangeMeasurement
from service.errors import RequestError
from service.files.csv_table import CsvTable, Numbers, holds_nothing, read_csv_table
from service.files.logs.columns import Found, find_columns
from service.files.logs.form import COLUMNS, LENGTHS_M, ODOMETRY, PLAIN, RANGE, TIME_PARTS, WIDE, LogForm
from service.files.logs.times import TimeReader, date_order_of

__all__ = ["COLUMNS", "RangeLog", "Row", "read_range_log"]

WHEELS, ACCELEROMETER = ODOMETRY[1:3], ODOMETRY[3:6]
NEEDED = ("time_s", "anchor_id", "range_m")


@dataclass(frozen=True, slots=True)
class Row:
    """One row: when, and either a range or a motion that ends then."""

    time_s: float
    measured: RangeMeasurement | None
    motion: OdometryIncrement | None


@dataclass(frozen=True, slots=True)
class RangeLog:
    """The rows of a log in the file's order, what was decided and passed over, in sentences, and the form used."""

    rows: list[Row]
    warnings: list[str]
    form: LogForm = PLAIN


def read_range_log(
    path: Path, form: LogForm = PLAIN, anchor_ids: Collection[str] = (), lone_id: str | None = None
) -> RangeLog:
    """The rows of a log, in the file's order; numbers that no sensor should deliver stay as they are.

    A row with anchor_id is a range; one without is the motion in the duration_s before its time_s. A log with columns
    range_m.ID has in each row the ranges of one moment and the motion before it. Columns of other names are recognised
    where no other would do as well, and told; columns that no log has are passed over, and told.
    anchor_ids: of the anchors that are known. lone_id: of the anchor that all ranges go to where no column says it.
    Raises RequestError.
    """
    table = read_csv_table(path, "log", nameless=True)
    form = replace(form, anchor_id=form.anchor_id or lone_id)
    own = _our_names(table, form)
    left = [column for column, name in own.items() if name not in COLUMNS and not name.startswith(WIDE)]
    found = find_columns(table.name, left, set(own.values()), anchor_ids, form.anchor_id is not None)
    names = {**own, **{column: name for name, column in found.names.items()}}
    wide = any(name.startswith(WIDE) for name in names.values())
    known = ("time_s", *ODOMETRY) if wide else COLUMNS
    used = {column: name for column, name in names.items() if name in known or (wide and name.startswith(WIDE))}
    told = (*form.columns.values(), *found.names.values())
    used |= {column: names[column] for column in told if names[column] in TIME_PARTS}
    lone = form.anchor_id if not wide and "anchor_id" not in used.values() else None
    _check_columns(table, names, used, wide, lone)
    passed = [column for column in table.columns if column not in used]
    warnings = [*_recognised(found), *found.told]
    warnings += [f"Columns that no log has were passed over: {', '.join(passed[:8])}."] if passed else []
    form = replace(
        form,
        columns={name: column for column, name in used.items()},
        time_unit=form.time_unit or found.time_unit,
        range_unit=form.range_unit or found.range_unit or "m",
        anchor_id=lone,
    )
    lines = [(where, {name: raw[column] for column, name in used.items()}) for where, raw in table.lines]
    dates = (f"{cells.get('date', '')} {cells['time_s']}".strip() for _, cells in lines)
    form = replace(form, date_order=date_order_of(table.name, dates, form.date_order))
    numbers = Numbers(table.delimiter)
    reader = _LogNumbers(numbers, TimeReader(numbers, form.time_unit, form.date_order), form)
    rows: list[Row] = []
    for where, cells in lines:
        rows += _wide_rows(where, cells, reader) if wide else [_row(where, cells, reader)]
    return RangeLog(rows, warnings, replace(form, time_unit=reader.times.unit))


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


def _recognised(found: Found) -> list[str]:
    units = {"time_s": found.time_unit, "range_m": found.range_unit}
    pairs = [
        f"{column!r}{'' if units.get(name) is None else f' in {units[name]}'} for {name}"
        for name, column in found.names.items()
    ]
    return [f"Taken are {', '.join(pairs[:8])}{' …' if len(pairs) > 8 else ''}."] if pairs else []


def _check_columns(
    table: CsvTable, names: Mapping[str, str], used: Mapping[str, str], wide: bool, lone: str | None
) -> None:
    there = set(used.values())
    mixed = [column for column, name in names.items() if wide and name in RANGE]
    needed = ["time_s"] if wide else [name for name in NEEDED if lone is None or name != "anchor_id"]
    needed += [f"range_m.{name.partition('.')[2]}" for name in there if wide and name.startswith(WIDE)]
    missing = [name for name in needed if name not in there]
    twice = [column for column, count in Counter(table.columns).items() if count > 1 and column in used]
    if not (mixed or missing or twice):
        return
    wrong = f"unknown column {mixed[0]!r}" if mixed else f"no column {missing[0]!r}" if missing else ""
    wrong = wrong or f"the column {twice[0]!r} twice"
    ours = f"{', '.join(COLUMNS)}, or range_m.ID, sigma_m.ID, p_sight.ID for each anchor"
    raise RequestError(
        f"The log {table.name} has {wrong}; its first line names columns out of {ours}.{_cure(table, used, missing)}"
    )


def _cure(table: CsvTable, used: Mapping[str, str], missing: Sequence[str]) -> str:
    """What to type where columns have other names; those that were recognised are named."""
    if not (missing and len(table.columns) > 1):
        return ""
    found = {name: column for column, name in used.items()}
    pairs = [f"{name}={found.get(name, '…')}" for name in NEEDED]
    return f" This one has {', '.join(table.columns[:12])}: say which is which, as in --columns {','.join(pairs)}."


@dataclass(frozen=True, slots=True)
class _LogNumbers:
    """Numbers of a log in the units of its form, as seconds and metres."""

    numbers: Numbers
    times: TimeReader
    form: LogForm

    def time_s(self, where: str, cells: Mapping[str, str]) -> float:
        """When the row was measured. Raises RequestError."""
        if holds_nothing(cells["time_s"]):
            raise RequestError(f"{where}: time_s is missing.")
        return self.times.seconds(where, "time_s", cells["time_s"], cells.get("nanoseconds", ""), cells.get("date", ""))

    def number(self, where: str, column: str, cell: str) -> float | None:
        """None for a cell that holds nothing."""
        if holds_nothing(cell):
            return None
        number = self.numbers.number(where, column, cell)
        return number * LENGTHS_M[self.form.range_unit or "m"] if column.startswith(("range_m", "sigma_m")) else number

    def anchor_id(self, written: str) -> str:
        """The anchor that the log calls so."""
        return self.form.ids.get(written, written)


def _wide_rows(where: str, cells: Mapping[str, str], reader: _LogNumbers) -> Iterator[Row]:
    """The motion, if the row has one, then a range for every anchor whose cell is not empty."""
    time_s = reader.time_s(where, cells)
    numbers = {
        column: reader.number(where, column, cell)
        for column, cell in cells.items()
        if column not in ("time_s", *TIME_PARTS)
    }
    if any(numbers.get(column) is not None for column in ODOMETRY):
        yield Row(time_s, None, _motion(where, {column: numbers.get(column) for column in ODOMETRY}))
    for column, range_m in numbers.items():
        if column.startswith("range_m.") and range_m is not None:
            written = column.removeprefix("range_m.")
            sigma_m, p_sight = numbers.get(f"sigma_m.{written}"), numbers.get(f"p_sight.{written}")
            yield Row(time_s, RangeMeasurement(reader.anchor_id(written), range_m, sigma_m, p_sight, time_s), None)


def _row(where: str, cells: Mapping[str, str], reader: _LogNumbers) -> Row:
    # an anchor may be called NA; only what databases write is no name
    written = "" if cells.get("anchor_id") in (r"\N", "NULL", "null") else cells.get("anchor_id", "")
    anchor_id = reader.anchor_id(written) if written or "anchor_id" in cells else reader.form.anchor_id or ""
    time_s = reader.time_s(where, cells)
    numbers = {column: reader.number(where, column, cells.get(column, "")) for column in (*RANGE[1:], *ODOMETRY)}
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
