"""What is in a log and how it would be taken: streams and their fields, ranges by anchor, motions, the mapping."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from service.errors import RequestError
from service.files.drives.reading import read_drive
from service.files.drives.rows import DriveRows
from service.files.logs.form import PLAIN, LogForm, map_of
from service.files.logs.messages import Stream, leaves_of
from service.files.logs.opening import kind_of, open_messages
from service.live.epoch_logs import SUFFIXES, EpochLog, read_epochs

__all__ = ["LogSurvey", "StreamSurvey", "survey_log"]


@dataclass(frozen=True, slots=True)
class StreamSurvey:
    """Messages of one name: their type and number, what they are taken for, "" for nothing, and what they hold."""

    name: str
    kind: str
    count: int
    taken_for: str
    fields: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LogSurvey:
    """A log as it would be taken. problem: why ``detect`` would refuse it, "" where it would not; then there are no
    epochs. drive: what ``navigate`` would take of it, None where it has no inertial readings."""

    log: str
    kind: str
    streams: tuple[StreamSurvey, ...]
    epochs: int
    motions: int
    from_s: float | None
    to_s: float | None
    ranges: dict[str, int]
    mapping: LogForm
    warnings: tuple[str, ...]
    problem: str
    drive: DriveRows | None = None

    def document(self) -> dict[str, object]:
        """The same as JSON."""
        streams = [
            {
                "stream": one.name,
                "type": one.kind,
                "messages": one.count,
                "taken_for": one.taken_for or None,
                "fields": list(one.fields),
            }
            for one in self.streams
        ]
        return {
            "log": self.log,
            "kind": self.kind,
            "streams": streams,
            "epochs": self.epochs,
            "epochs_with_motion": self.motions,
            "from_s": self.from_s,
            "to_s": self.to_s,
            "ranges": self.ranges,
            "drive": None if self.drive is None else _drive_document(self.drive),
            "mapping": json.loads(map_of(self.mapping)),
            "warnings": list(self.warnings),
            "problem": self.problem or None,
        }


def survey_log(
    paths: Sequence[Path], epoch_s: float = 0.0, form: LogForm = PLAIN, anchor_ids: Collection[str] = ()
) -> LogSurvey:
    """What ``read_epochs`` would make of a log; one of messages is described also where that would refuse it.

    Raises RequestError.
    """
    first = paths[0]
    kind = kind_of(first) if len(paths) == 1 else None
    log = None if kind is None else open_messages(first)
    read, problem = EpochLog([], [], form), ""
    drive = _drive(paths, form, anchor_ids)
    try:
        read = read_epochs(paths, epoch_s, form, anchor_ids)
    except RequestError as error:
        if log is None and drive is None:
            raise
        problem = str(error)
    ranges = Counter(measured.anchor_id for epoch in read.epochs for measured in epoch.ranges)
    lines = "JSON Lines" if first.suffix.lower() in SUFFIXES else "table"
    return LogSurvey(
        first.name,
        kind or lines,
        () if log is None else tuple(_stream(stream, read.form, drive) for stream in log.streams),
        len(read.epochs),
        sum(epoch.odometry is not None for epoch in read.epochs),
        read.epochs[0].time_s if read.epochs else None,
        read.epochs[-1].time_s if read.epochs else None,
        dict(sorted(ranges.items())),
        read.form,
        tuple(read.warnings if log is None or not problem else log.told),
        problem,
        drive,
    )


def _drive(paths: Sequence[Path], form: LogForm, anchor_ids: Collection[str]) -> DriveRows | None:
    """What ``navigate`` would take; None: nothing, for it would refuse the log."""
    try:
        return read_drive(paths, form, anchor_ids)
    except RequestError:
        return None


def _drive_document(drive: DriveRows) -> dict[str, object]:
    return {
        "readings": len(drive.times_s),
        "from_s": drive.times_s[0],
        "to_s": drive.times_s[-1],
        "fixes": len(drive.fixes),
        "ranges": len(drive.ranges),
        "speeds": len(drive.speeds),
        "axes": drive.axes,
        "told": drive.told,
    }


def _stream(stream: Stream, form: LogForm, drive: DriveRows | None) -> StreamSurvey:
    taken: list[str] = [one.role for one in form.streams if one.stream == stream.name]
    if drive is not None and stream.name in drive.streams:
        taken.append(drive.streams[stream.name])
    roles = ", ".join(taken)
    paths = tuple(path for path, _ in leaves_of(stream.first))
    return StreamSurvey(stream.name, stream.kind, stream.count, roles, paths)
