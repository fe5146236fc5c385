"""Range logs as epochs: rows of tables and of messages gathered as a detector takes them, or an epoch a line."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from pathlib import Path

from pydantic import ValidationError

from detection import OdometryIncrement, RangeEpoch
from service.errors import RequestError
from service.files.logs.form import PLAIN, LogForm
from service.files.logs.known import choose_streams
from service.files.logs.message_rows import Rows
from service.files.logs.opening import kind_of, open_messages
from service.files.range_log import Row, read_range_log
from service.live.imu import ImuIn
from service.live.request import EpochIn
from service.parts.sentences import sentence_of

__all__ = ["SUFFIXES", "EpochLog", "epochs_of", "read_epochs", "sum_of"]

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
    epochs.append(RangeEpoch(end_s, measured, sum_of(until)))
    return later


def _belongs(row: Row, before: Sequence[Row], epoch_s: float) -> bool:
    since_s = row.time_s - before[0].time_s
    if epoch_s == 0.0 or row.measured is None:
        return since_s == 0.0
    known = {earlier.measured.anchor_id for earlier in before if earlier.measured is not None}
    return 0.0 <= since_s <= epoch_s and row.measured.anchor_id not in known


def sum_of(motions: Sequence[OdometryIncrement]) -> OdometryIncrement | None:
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
    """The epochs of a log, what was passed over in it, in sentences, and how it was taken.

    imu: the inertial readings of those epochs that hold some.
    """

    epochs: list[RangeEpoch]
    warnings: list[str]
    form: LogForm = PLAIN
    imu: tuple[ImuIn, ...] = ()


def read_epochs(
    path: Path | Sequence[Path], epoch_s: float = 0.0, form: LogForm = PLAIN, anchor_ids: Collection[str] = ()
) -> EpochLog:
    """The epochs of a log: a table, lines of JSON, or a log of messages, by what it holds; several tables are one log.

    epoch_s: how rows belong together, see ``epochs_of``. form: what of them is otherwise than documented. anchor_ids:
    of the anchors that are known, by which columns and files may be named. Raises RequestError.
    """
    paths = _files([path] if isinstance(path, Path) else list(path))
    if len(paths) > 1:
        return _several(paths, epoch_s, form, anchor_ids)
    (only,) = paths
    if only.suffix.lower() in SUFFIXES:
        return _messages(only, epoch_s, form)
    if kind_of(only) is not None:
        return _streams(only, epoch_s, form)
    log = read_range_log(only, form, anchor_ids)
    return EpochLog(epochs_of(log.rows, epoch_s), log.warnings, log.form)


def _files(paths: Sequence[Path]) -> list[Path]:
    """A folder that is no bag stands for the tables in it."""
    found = []
    for path in paths:
        tables = sorted(path.glob("*.csv")) if path.is_dir() and kind_of(path) is None else []
        found += tables or [path]
    return found


def _several(paths: Sequence[Path], epoch_s: float, form: LogForm, anchor_ids: Collection[str]) -> EpochLog:
    rows: list[Row] = []
    warnings: list[str] = []
    logs = []
    for path, anchor_id in zip(paths, _named(paths, anchor_ids), strict=True):
        if path.suffix.lower() in SUFFIXES or kind_of(path) is not None:
            raise RequestError(f"Several files are one log only where all are tables; {path.name} is none.")
        logs.append(read_range_log(path, form, anchor_ids, anchor_id))
        rows += logs[-1].rows
        warnings += [said if said in warnings else f"{path.name}: {said}" for said in logs[-1].warnings]
        if logs[-1].form.anchor_id is not None:
            warnings.append(f"{path.name}: its ranges are taken as those of anchor {anchor_id}.")
    rows.sort(key=lambda row: row.time_s)
    return EpochLog(epochs_of(rows, epoch_s), warnings, form)


def _named(paths: Sequence[Path], anchor_ids: Collection[str]) -> list[str]:
    """Of each file what its name has and those of the others have not, or the anchor whose id is part of it."""
    stems = [path.stem for path in paths]
    begin = _alike(stems)
    end = _alike([stem[begin:][::-1] for stem in stems])
    named = []
    for stem in stems:
        parts = {part for part in re.split(r"[\W_]+", stem) if part in anchor_ids}
        named.append(parts.pop() if len(parts) == 1 else stem[begin : len(stem) - end] or stem)
    return named


def _alike(texts: Sequence[str]) -> int:
    """How many characters all begin with."""
    return sum(1 for _ in takewhile(lambda characters: len(set(characters)) == 1, zip(*texts, strict=False)))


def _streams(path: Path, epoch_s: float, form: LogForm) -> EpochLog:
    log = open_messages(path)
    chosen = choose_streams(log)
    maps, told = (form.streams, ()) if form.streams else (chosen.maps, chosen.told)
    there = {stream.name for stream in log.streams}
    strange = next((one.stream for one in maps if one.stream not in there), None)
    if strange is not None:
        raise RequestError(f"The log {path.name} has no stream {strange!r}; it has {', '.join(sorted(there)[:12])}.")
    if not any(one.role == "ranges" for one in maps):
        raise RequestError(
            f"In the log {path.name} ({log.format}) no messages are known to be ranges; it has "
            f"{', '.join(sorted(there)[:12])}: see sightline log {path.name}, and say which by --map FILE."
        )
    made = Rows.of(maps, form.ids)
    rows = [row for message in log.read({one.stream for one in maps}) for row in made.take(message)]
    rows.sort(key=lambda row: row.time_s)
    return EpochLog(epochs_of(rows, epoch_s), [*log.told, *told], replace(form, streams=tuple(maps)))


def _messages(path: Path, epoch_s: float, form: LogForm) -> EpochLog:
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
    asked = [_epoch(f"{path.name}, line {number}", line) for number, line in enumerate(lines, 1) if line.strip()]
    return EpochLog([one.epoch() for one in asked], [], imu=tuple(one.imu for one in asked if one.imu is not None))


def _epoch(where: str, line: str) -> EpochIn:
    try:
        return EpochIn.model_validate_json(line)
    except ValidationError as error:
        raise RequestError(f"{where}: {sentence_of(error)}") from error
