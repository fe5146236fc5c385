"""Range logs as epochs: rows gathered as a detector takes them, or messages, JSON Lines with an epoch in each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from detection import OdometryIncrement, RangeEpoch
from service.errors import RequestError
from service.files.range_log import PLAIN, LogForm, Row, read_range_log
from service.live.request import EpochIn
from service.parts.sentences import sentence_of

__all__ = ["SUFFIXES", "EpochLog", "epochs_of", "read_epochs"]

SUFFIXES = (".jsonl", ".ndjson")


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


@dataclass(frozen=True, slots=True)
class EpochLog:
    """The epochs of a log, and what was passed over in it, in sentences."""

    epochs: list[RangeEpoch]
    warnings: list[str]


def read_epochs(path: Path, epoch_s: float = 0.0, form: LogForm = PLAIN) -> EpochLog:
    """The epochs of a log of either kind: messages by the ending of its name, else CSV.

    epoch_s: how rows of CSV belong together, see ``epochs_of``. form: what of them is otherwise than documented.
    Raises RequestError.
    """
    if path.suffix.lower() not in SUFFIXES:
        log = read_range_log(path, form)
        return EpochLog(epochs_of(log.rows, epoch_s), log.warnings)
    if epoch_s:
        raise RequestError(f"--epoch is for CSV; in {path.name} each line is an epoch.")
    if form != PLAIN:
        raise RequestError(f"--columns and units are for CSV; {path.name} holds messages, in seconds and metres.")
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RequestError(f"The log {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The log {str(path)!r} cannot be read: {error.strerror}.") from error
    epochs = [_epoch(f"{path.name}, line {number}", line) for number, line in enumerate(lines, 1) if line.strip()]
    return EpochLog(epochs, [])


def _epoch(where: str, line: str) -> RangeEpoch:
    try:
        return EpochIn.model_validate_json(line).epoch()
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error
