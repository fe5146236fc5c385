"""Range logs: CSV of what a rover measured, row by row, gathered into epochs as a detector takes them."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from detection import OdometryIncrement, RangeEpoch, RangeMeasurement
from service.errors import RequestError

__all__ = ["COLUMNS", "epochs_of", "read_range_log"]

RANGE = ("anchor_id", "range_m", "sigma_m", "p_sight")
WHEELS = ("wheel_x_m", "wheel_y_m")
ACCELEROMETER = ("accel_x_m", "accel_y_m", "accel_z_m")
ODOMETRY = ("duration_s", *WHEELS, *ACCELEROMETER, "heading_deg")
COLUMNS = ("time_s", *RANGE, *ODOMETRY)


@dataclass(frozen=True, slots=True)
class Row:
    """One row: when, and either a range or a motion that ends then."""

    time_s: float
    measured: RangeMeasurement | None
    motion: OdometryIncrement | None


def read_range_log(path: Path) -> list[Row]:
    """The rows of a log, in the file's order; numbers that no sensor should deliver stay as they are.

    A row with anchor_id is a range; one without is the motion in the duration_s before its time_s. Raises RequestError.
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


def epochs_of(rows: Sequence[Row], epoch_s: float = 0.0) -> list[RangeEpoch]:
    """Gather rows into epochs, each with the motion since the one before.

    epoch_s: ranges within so many seconds belong together, until an anchor comes again; 0 = those of equal time.
    """
    epochs: list[RangeEpoch] = []
    ranges: list[Row] = []
    motions: list[Row] = []
    for row in rows:
        if row.measured is None:
            motions.append(row)
            continue
        if ranges and not _belongs(row, ranges, epoch_s):
            motions = _close(epochs, ranges, motions)
            ranges = []
        ranges.append(row)
    if ranges:
        _close(epochs, ranges, motions)
    return epochs


def _close(epochs: list[RangeEpoch], ranges: Sequence[Row], motions: Sequence[Row]) -> list[Row]:
    """Add the epoch of these ranges with the motion until its last one; returns the motions after that."""
    end_s = ranges[-1].time_s
    later = [row for row in motions if row.time_s > end_s]
    until = [row.motion for row in motions if row.motion is not None and not row.time_s > end_s]
    measured = tuple(row.measured for row in ranges if row.measured is not None)
    epochs.append(RangeEpoch(end_s, measured, _sum(until)))
    return later


def _belongs(row: Row, before: Sequence[Row], epoch_s: float) -> bool:
    since_s = row.time_s - before[0].time_s
    if epoch_s == 0.0 or row.measured is None:
        return since_s == 0.0
    known = {earlier.measured.anchor_id for earlier in before if earlier.measured is not None}
    return 0.0 <= since_s <= epoch_s and row.measured.anchor_id not in known


def _sum(motions: Sequence[OdometryIncrement]) -> OdometryIncrement | None:
    """One motion out of several in a row: displacements add up as vectors; what one of them lacks the sum lacks."""
    if not motions:
        return None
    duration_s = sum(motion.duration_s for motion in motions)
    wheels = [motion.wheel_m for motion in motions if motion.wheel_m is not None]
    felt = [motion.accelerometer_m for motion in motions if motion.accelerometer_m is not None]
    wheel_m = _total(wheels) if len(wheels) == len(motions) else None
    accelerometer_m = _total(felt) if len(felt) == len(motions) else None
    return OdometryIncrement(
        duration_s,
        None if wheel_m is None else (wheel_m[0], wheel_m[1]),
        None if accelerometer_m is None else (accelerometer_m[0], accelerometer_m[1], accelerometer_m[2]),
        _heading_rad(motions),
    )


def _total(vectors: Sequence[Sequence[float]]) -> tuple[float, ...]:
    return tuple(math.fsum(parts) for parts in zip(*vectors, strict=True))


def _heading_rad(motions: Sequence[OdometryIncrement]) -> float | None:
    """Where all of them together led, each as long as its displacement; None unless each has a heading."""
    if len(motions) == 1:
        return motions[0].heading_rad
    east_m = north_m = 0.0
    for motion in motions:
        level_m = motion.wheel_m or (motion.accelerometer_m or ())[:2]
        if motion.heading_rad is None or not level_m:
            return None
        east_m += math.hypot(*level_m) * math.sin(motion.heading_rad)
        north_m += math.hypot(*level_m) * math.cos(motion.heading_rad)
    return math.atan2(east_m, north_m)


def _rows(name: str, lines: Iterator[str]) -> Iterator[Row]:
    reader = csv.DictReader(lines, skipinitialspace=True, restkey="", strict=True)
    header = [column.strip() for column in reader.fieldnames or []]
    strange = [column for column in header if column not in COLUMNS]
    missing = [column for column in ("time_s", "anchor_id", "range_m") if column not in header]
    if strange or missing:
        wrong = f"unknown column {strange[0]!r}" if strange else f"no column {missing[0]!r}"
        raise RequestError(f"The log {name} has {wrong}; its first line names columns out of {', '.join(COLUMNS)}.")
    reader.fieldnames = header
    for cells in reader:
        where = f"{name}, line {reader.line_num}"
        if "" in cells:
            raise RequestError(f"{where}: more cells than columns.")
        yield _row(where, {column: (cell or "").strip() for column, cell in cells.items()})


def _row(where: str, cells: dict[str, str]) -> Row:
    anchor_id = cells["anchor_id"]
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
