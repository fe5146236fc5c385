"""Ranges that come one by one, gathered into rounds while they come."""

from __future__ import annotations

import math
from collections.abc import Collection

from detection import OdometryIncrement, RangeEpoch, RangingAnchor
from service.files.range_log import Row
from service.live.epoch_logs import sum_of

__all__ = ["Rounds"]


class Rounds:
    """A round ends when every anchor was heard, one comes again, or the next range is too late for it.

    anchor_ids: of the anchors. round_s: how long a round lasts by the ranges' own clock; linger_s: how long by ours.
    """

    def __init__(self, anchor_ids: Collection[str], round_s: float = 0.25, linger_s: float = 0.25) -> None:
        self._ids, self._round_s, self._linger_s = frozenset(anchor_ids), round_s, linger_s
        self._rows: list[Row] = []
        self._motions: list[OdometryIncrement] = []
        self._moved: dict[str, RangingAnchor] = {}
        self._begun_s = math.inf

    def take(self, row: Row, now_s: float) -> list[RangeEpoch]:
        """A range or a motion that came now, by our clock; the rounds that end by it."""
        if row.motion is not None:
            self._motions.append(row.motion)
        if row.measured is None:
            return []
        ended = [] if self._belongs(row) else self.end()
        if not self._rows:
            self._begun_s = now_s
        self._rows.append(row)
        return [*ended, *self.end()] if self._ids <= self._heard() else ended

    def move(self, anchor: RangingAnchor) -> None:
        """An anchor is elsewhere from the next round on."""
        self._moved[anchor.id] = anchor

    def late(self, now_s: float) -> list[RangeEpoch]:
        """The round that lasts too long by our clock, if it does."""
        return self.end() if self._rows and now_s - self._begun_s > self._linger_s else []

    def end(self) -> list[RangeEpoch]:
        """The round so far."""
        if not self._rows:
            return []
        ranges = tuple(row.measured for row in self._rows if row.measured is not None)
        epoch = RangeEpoch(self._rows[-1].time_s, ranges, sum_of(self._motions), None, tuple(self._moved.values()))
        self._rows, self._motions, self._moved = [], [], {}
        return [epoch]

    def _heard(self) -> set[str]:
        return {row.measured.anchor_id for row in self._rows if row.measured is not None}

    def _belongs(self, row: Row) -> bool:
        if not self._rows or row.measured is None:
            return True
        return 0.0 <= row.time_s - self._rows[0].time_s <= self._round_s and row.measured.anchor_id not in self._heard()
