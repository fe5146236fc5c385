"""Epochs in the order they may be used: later ones only, once each; anew where the sender's clock was set back."""

from __future__ import annotations

import math

from .epochs import RangeEpoch
from .verdicts import Rejection

__all__ = ["EpochOrder"]

# So many old epochs in a row, in order among themselves, are no stragglers: the sender's clock was set back.
CLOCK_SET_BACK = 10


class EpochOrder:
    """Remembers the times of the last epochs; changed in place."""

    def __init__(self, window: int) -> None:
        self._window = window
        self._times_s: list[float] = []
        self._sequence: int | None = None
        self._old: list[float] = []

    @property
    def time_s(self) -> float | None:
        """Of the last epoch that was used."""
        return self._times_s[-1] if self._times_s else None

    def rejection(self, epoch: RangeEpoch) -> Rejection | None:
        """Why an epoch cannot be used as a whole after those before it, or None."""
        if not math.isfinite(epoch.time_s):
            return Rejection.BAD_TIME
        if self.time_s is None:
            return None
        same_sequence = epoch.sequence is not None and epoch.sequence == self._sequence
        if epoch.time_s == self.time_s or same_sequence:
            return Rejection.DUPLICATE
        if epoch.time_s > self.time_s:
            return None
        return Rejection.LATE if epoch.time_s < self._times_s[0] else Rejection.OUT_OF_ORDER

    def accept(self, epoch: RangeEpoch) -> None:
        """Take an epoch as the last one."""
        self._times_s = [*self._times_s[-self._window + 1 :], epoch.time_s] if self._window > 1 else [epoch.time_s]
        self._sequence, self._old = epoch.sequence, []

    def was_set_back(self, epoch: RangeEpoch) -> bool:
        """Whether this old epoch ends a run of old ones that are in order; then all before them is forgotten."""
        if self._old and epoch.time_s <= self._old[-1]:
            self._old = []
        self._old.append(epoch.time_s)
        if len(self._old) < CLOCK_SET_BACK:
            return False
        self._times_s, self._sequence, self._old = [], None, []
        return True
