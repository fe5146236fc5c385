"""The radio link of anchors to a base: lines of sight within a range, possibly over other anchors as relays."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid
from visibility import VISIBLE, lines_of_sight

__all__ = ["Link", "base_hops", "linked_pairs"]

Floats = npt.NDArray[np.float64]
FAR = 1_000_000  # hops of a place that has no link at all
LINES_AT_ONCE = 200_000


@dataclass(frozen=True, slots=True)
class Link:
    """What a link needs: a line of sight no longer than max_range_m.

    bases_m: (b, 3) as tuples: base stations or parent drones, east, north, altitude. relays: how many other anchors a
        link may go over; 0 = every anchor sees a base itself. Raises PlacementError.
    """

    bases_m: tuple[tuple[float, float, float], ...]
    max_range_m: float = math.inf
    relays: int = 0

    def __post_init__(self) -> None:
        if not self.bases_m or not np.isfinite(np.array(self.bases_m, np.float64)).all():
            raise PlacementError("A link needs at least one base with a finite position.")
        if not self.max_range_m > 0.0 or self.relays < 0:
            raise PlacementError(
                f"A link needs max_range_m > 0 and relays >= 0, not {self.max_range_m} and {self.relays}."
            )


def linked_pairs(grid: ElevationGrid, link: Link, one_m: Floats, other_m: Floats) -> npt.NDArray[np.bool_]:
    """(n, m) bool: whether places (n, 3) and (m, 3) have a link; sight over unknown ground is none."""
    apart_m = np.sqrt(((one_m[:, None, :] - other_m[None, :, :]) ** 2).sum(axis=2))
    linked: npt.NDArray[np.bool_] = apart_m <= link.max_range_m
    first, second = np.nonzero(linked)
    for start in range(0, len(first), LINES_AT_ONCE):
        part = slice(start, start + LINES_AT_ONCE)
        sight = lines_of_sight(grid, one_m[first[part]], other_m[second[part]])
        linked[first[part], second[part]] = sight.verdict == VISIBLE
    return linked


def base_hops(grid: ElevationGrid, link: Link, places_m: Floats) -> npt.NDArray[np.int64]:
    """(n,) fewest hops from each place to a base when every other place may relay; FAR = none."""
    hops = np.full(len(places_m), FAR)
    reached = linked_pairs(grid, link, places_m, np.array(link.bases_m, np.float64)).any(axis=1)
    hops[reached] = 1
    for hop in range(2, link.relays + 2):
        last, open_ = np.flatnonzero(hops == hop - 1), np.flatnonzero(hops == FAR)
        if not len(last) or not len(open_):
            break
        for place in last:
            if not len(open_):
                break
            found = linked_pairs(grid, link, places_m[open_], places_m[[place]])[:, 0]
            hops[open_[found]] = hop
            open_ = open_[~found]
    return hops
