"""What sets of candidates are worth whose sight lies in files: only where a set changed are gains worked out again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.kernels import placement_bits
from planning.placement.sight import Floats, pack

from .parcels import Mask, Window, WindowParcel

__all__ = ["Counts", "Seen", "SightFiles", "WindowJudge", "counts_within", "reached_by", "seen_by"]

Counts = npt.NDArray[np.uint8]
MOST_KEPT = 128  # rows and worths that are remembered


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """The posts that one anchor sees. posts: (rows, cols) bool over its window."""

    window: Window
    posts: Mask


@dataclass(slots=True, eq=False)
class SightFiles:
    """Sight of candidates, parcel by parcel in files.

    at: (all, 2) parcel and row of each. seen: (all,) targets in sight. number: (n,) which of all are candidates still.
    total: how many targets there are. fixed: what anchors see that always stand. by_all: (rows, cols) of the whole DEM,
    how many candidates and fixed anchors see each post, mapped from a file.
    """

    parcels: Sequence[WindowParcel]
    at: npt.NDArray[np.intp]
    seen: npt.NDArray[np.int64]
    number: npt.NDArray[np.intp]
    total: int
    fixed: tuple[Seen, ...]
    by_all: Counts
    _kept: dict[int, Seen] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.windows = np.array([parcel.window for parcel in self.parcels], np.intp).reshape(-1, 4)

    windows: npt.NDArray[np.intp] = field(init=False)

    def bits(self, parcel: int) -> npt.NDArray[np.uint64]:
        """(n, words) of a parcel, mapped."""
        mapped: npt.NDArray[np.uint64] = np.load(self.parcels[parcel].path, mmap_mode="r", allow_pickle=False)
        return mapped

    def of(self, member: int) -> Seen:
        """What one candidate sees."""
        if member not in self._kept:
            if len(self._kept) >= MOST_KEPT:
                self._kept.pop(next(iter(self._kept)))
            parcel, row = self.at[self.number[member]]
            self._kept[member] = seen_by(self.parcels[parcel].window, self.bits(parcel)[row])
        return self._kept[member]

    def near(self, window: Window) -> Mask:
        """(p,) bool: parcels whose windows have a post in common with one."""
        top, bottom, left, right = window
        rows = (self.windows[:, 0] < bottom) & (self.windows[:, 1] > top)
        near: Mask = rows & (self.windows[:, 2] < right) & (self.windows[:, 3] > left)
        return near


def seen_by(window: Window, bits: npt.NDArray[np.uint64]) -> Seen:
    """A row of bits over a window."""
    shape = window[1] - window[0], window[3] - window[2]
    row = np.ascontiguousarray(bits).astype("<u8").view(np.uint8)
    return Seen(
        window, np.unpackbits(row, count=shape[0] * shape[1], bitorder="little").astype(np.bool_).reshape(shape)
    )


class WindowJudge:
    """Share of the targets by how many anchors they see, as ``CountJudge`` has it: partial, or only from ``full`` on.

    possible: only targets count that as many candidates could see.
    """

    def __init__(self, files: SightFiles, full: int, *, partial: bool, possible: bool = False) -> None:
        self._files, self._full, self._partial, self._possible = files, full, partial, possible
        self._members: set[int] = set()
        alone = not files.fixed and not possible and (partial or full == 1)
        # with nobody there a candidate brings what it sees, or nothing
        self._gain: npt.NDArray[np.int64] = files.seen.copy() if alone else np.zeros_like(files.seen)
        self._stale: Mask = np.full(len(files.parcels), bool(files.fixed) or possible)
        self._worths: dict[frozenset[int], int] = {}

    def value(self, chosen: list[int]) -> float:
        """Of a set."""
        return float(self._shared(self._worth(chosen)))

    def with_each(self, chosen: list[int], which: npt.NDArray[np.intp]) -> Floats:
        """Of the set with each of some candidates added."""
        files, members = self._files, set(chosen)
        for changed in members ^ self._members:
            self._stale |= files.near(files.of(changed).window)
        self._members = members
        numbers = files.number[which]
        asked = np.unique(files.at[numbers, 0])
        for parcel in asked[self._stale[asked]].tolist():
            self._gain[files.parcels[parcel].rows] = self._gains(parcel, chosen)
            self._stale[parcel] = False
        return np.asarray(self._shared(self._worth(chosen)) + self._shared(self._gain[numbers]))

    def _shared(self, units: Any) -> Any:
        """Shares of the targets, of one number or of many."""
        return units / self._full / self._files.total if self._partial else units / self._files.total

    def _gains(self, parcel: int, chosen: list[int]) -> npt.NDArray[np.int64]:
        """(n,) targets that each candidate of a parcel brings nearer, or to counting."""
        files = self._files
        window = files.parcels[parcel].window
        short = self._short(window, [*files.fixed, *(files.of(member) for member in chosen)])
        bits, out = files.bits(parcel), np.empty(len(files.parcels[parcel].rows))
        placement_bits.weight_under_mask(
            np.ascontiguousarray(bits), np.arange(len(out)), pack(short.reshape(1, -1))[0], np.zeros(0), out
        )
        return out.astype(np.int64)

    def _short(self, window: Window, present: Sequence[Seen]) -> Mask:
        """(rows, cols) posts of a window to which one more anchor in sight brings something."""
        counts = counts_within(window, present)
        short: Mask = counts < self._full if self._partial else counts == self._full - 1
        if self._possible:
            top, bottom, left, right = window
            short &= self._files.by_all[top:bottom, left:right] >= self._full
        return short

    def _worth(self, chosen: list[int]) -> int:
        """Of a set, in targets (times ``full`` where parts of them count): what each brings to those before it."""
        key = frozenset(chosen)
        if key not in self._worths:
            if len(self._worths) >= MOST_KEPT:
                self._worths.pop(next(iter(self._worths)))
            files = self._files
            everyone = [*files.fixed, *(files.of(member) for member in sorted(key))]
            self._worths[key] = added_up(everyone, self._short)
        return self._worths[key]


def added_up(everyone: Sequence[Seen], short: Callable[[Window, Sequence[Seen]], Mask]) -> int:
    """What anchors bring, each to those before it: posts that see it, of those to which one more brings something."""
    return sum(
        int(np.count_nonzero(one.posts & short(one.window, everyone[:number]))) for number, one in enumerate(everyone)
    )


def reached_by(everyone: Sequence[Seen], full: int) -> int:
    """How many posts see at least ``full`` of some anchors."""
    return added_up(everyone, lambda window, present: counts_within(window, present) == full - 1)


def counts_within(window: Window, present: Sequence[Seen]) -> Counts:
    """(rows, cols) how many of some anchors see each post of a window."""
    top, bottom, left, right = window
    counts = np.zeros((bottom - top, right - left), np.uint8)
    for seen in present:
        above, below = max(top, seen.window[0]), min(bottom, seen.window[1])
        west, east = max(left, seen.window[2]), min(right, seen.window[3])
        if above < below and west < east:
            counts[above - top : below - top, west - left : east - left] += seen.posts[
                above - seen.window[0] : below - seen.window[0], west - seen.window[2] : east - seen.window[2]
            ]
    return counts
