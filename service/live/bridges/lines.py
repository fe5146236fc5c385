"""Lines of JSON: what a microcontroller can write and read. docs/logs-and-links.md has every field."""

from __future__ import annotations

import json
import time
from collections.abc import Collection, Iterable
from dataclasses import replace

from pydantic import Field, ValidationError

from detection import RangeMeasurement
from planning.watching import WatchedEpoch
from service.files.range_log import Row
from service.live.answers import as_json
from service.live.request import EpochIn, Measured, OdometryIn, Seconds
from service.parts.points import StrictModel
from service.parts.sentences import sentence_of

from .bridge import Asked
from .rounds import Rounds

__all__ = ["LineCodec"]

LONGEST_LINE = 65536
MOST_SENDERS = 16


class RangeLine(StrictModel):
    """One range in a line of its own."""

    time_s: Seconds = Field(description="When it was measured, seconds on the ranging clock.")
    anchor_id: str = Field(max_length=64, description="Which anchor.")
    range_m: Measured = Field(description="Metres.")
    sigma_m: Measured | None = Field(None, description="One-sigma error, metres.")


class MotionLine(StrictModel):
    """One motion in a line of its own; it counts for the round that ends next."""

    time_s: Seconds = Field(description="When it ended, seconds.")
    odometry: OdometryIn = Field(description="As in an epoch.")


class LineCodec:
    """A line is an epoch (as a stream of the service takes it, or with ranges as {"D1": 12.3}), a range, or a motion.

    Each epoch is answered by one line, which is its acknowledgement; what is none by a problem.
    """

    def __init__(self, anchor_ids: Collection[str], rounds: Rounds) -> None:
        self.bad = 0
        self._rounds = rounds
        self._begun: dict[str, bytes] = {}
        self._skipping: set[str] = set()
        self._due: list[bytes] = []
        self._ids = frozenset(anchor_ids)

    def received(self, source: str, data: bytes) -> Iterable[Asked]:
        """The epochs of whole lines; what is left waits for its end."""
        *lines, rest = (self._begun.pop(source, b"") + data).split(b"\n")
        for number, line in enumerate(lines):
            if source in self._skipping and number == 0:
                self._skipping.discard(source)  # the end of the line that was too long
                continue
            if line.strip():
                yield from self._line(line)
        if len(rest) > LONGEST_LINE or source in self._skipping:
            if source not in self._skipping:
                self._problem(f"A line may have {LONGEST_LINE} bytes.")
                self._skipping.add(source)
            rest = b""
        self._begun[source] = rest
        if len(self._begun) > MOST_SENDERS:
            gone = next(iter(self._begun))
            del self._begun[gone]
            self._skipping.discard(gone)

    def idle(self) -> Iterable[Asked]:
        """The round that lasted long enough."""
        return [Asked(epoch, epoch.time_s) for epoch in self._rounds.late(time.monotonic())]

    def due(self) -> Iterable[bytes]:
        """Problems."""
        due, self._due = self._due, []
        return due

    def answer(self, asked: Asked, watched: WatchedEpoch) -> list[bytes]:
        """A line with what a rover needs at once."""
        result = watched.result
        fix = result.position
        told: dict[str, object] = {
            "time_s": result.time_s,
            "sequence": asked.epoch.sequence,
            "planning": result.planning,
            "position_m": None if fix is None else [round(float(metres), 3) for metres in fix.position_m],
            "sigma_m": None if fix is None else round(float(fix.covariance_m2.trace()) ** 0.5, 3),
            "excluded": result.excluded,
            "occluded": {one.anchor_id: round(one.excess_m, 2) for one in result.verdicts if one.occluded},
        }
        told |= {"rejection": result.rejection} if result.rejection else {}
        told |= {"rejected": {one.anchor_id: one.reason for one in result.rejected}} if result.rejected else {}
        told |= {"mirror": True} if fix is not None and fix.mirror_m is not None else {}
        if (estimate := watched.estimate) is not None:
            told["estimate"] = {
                "position_m": [round(metres, 3) for metres in estimate.position_m.tolist()],
                "velocity_m_per_s": [round(rate, 3) for rate in estimate.velocity_m_per_s.tolist()],
                "bubble_m": round(estimate.bubble_m, 3),
            }
        return [as_json(told) + b"\n"]

    def lost(self, asked: Asked) -> list[bytes]:
        """A line that tells it; the epoch may be sent again."""
        return [as_json({"time_s": asked.epoch.time_s, "sequence": asked.epoch.sequence, "lost": True}) + b"\n"]

    def _line(self, line: bytes) -> Iterable[Asked]:
        try:
            fields = json.loads(line)
            if isinstance(fields, dict) and "anchor_id" in fields:
                one = RangeLine.model_validate(fields)
                measured = RangeMeasurement(one.anchor_id, one.range_m, one.sigma_m, None, one.time_s)
                ended = self._rounds.take(Row(one.time_s, measured, None), time.monotonic())
                return [Asked(epoch, epoch.time_s) for epoch in ended]
            if isinstance(fields, dict) and "ranges" not in fields and "odometry" in fields:
                motion = MotionLine.model_validate(fields)
                self._rounds.take(Row(motion.time_s, None, motion.odometry.increment()), time.monotonic())
                return []
            return [self._epoch(fields)]
        except (ValueError, RecursionError) as error:
            said = sentence_of(error) if isinstance(error, ValidationError) else "The line is not JSON."
            self._problem(said)
            return []

    def _epoch(self, fields: object) -> Asked:
        if isinstance(fields, dict) and isinstance(fields.get("ranges"), dict):
            listed = [{"anchor_id": str(name), "range_m": range_m} for name, range_m in fields["ranges"].items()]
            fields = {**fields, "ranges": listed}
        asked = EpochIn.model_validate(fields)
        epoch = asked.epoch()
        if asked.imu is not None:
            self._problem("imu: a bridge takes no inertial readings; a session of the service does.")
        strange = [anchor.id for anchor in epoch.moved if anchor.id not in self._ids]
        if strange:
            self._problem(f"moved: there is no anchor {strange[0]!r}.")
            epoch = replace(epoch, moved=tuple(anchor for anchor in epoch.moved if anchor.id in self._ids))
        return Asked(epoch, epoch.time_s if epoch.sequence is None else epoch.sequence)

    def _problem(self, sentence: str) -> None:
        self.bad += 1
        self._due.append(as_json({"problem": sentence}) + b"\n")
