"""Which candidates may join a set: far enough from every member, and linked to a base over members."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

from .rules import FAR, Link, linked_pairs

__all__ = ["Together", "may_stand_beside"]

Floats = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
CLEAR_OF_ANOTHER_M = 5.0


class Together:
    """The rules that hold between the anchors of a set.

    position_m: (n, 3) candidates; those from ``fixed_from`` on are fixed anchors, members of every set.
    What sees what is worked out for a member when it first joins a set, and remembered.
    """

    def __init__(
        self, grid: ElevationGrid, position_m: Floats, fixed_m: Floats, min_separation_m: float, link: Link | None
    ) -> None:
        self._grid, self._position_m, self._fixed_m = grid, position_m, fixed_m
        self._separation_m, self._link = min_separation_m, link
        self._apart: dict[int, Mask] = {}
        self._linked: dict[int, Mask] = {}
        self._clear_of_fixed: Mask = np.asarray(self._far_from(fixed_m).all(axis=1))
        self._direct: Mask = np.ones(len(position_m), np.bool_)
        if link is not None and link.relays:
            self._direct = np.asarray(linked_pairs(grid, link, position_m, np.array(link.bases_m)).any(axis=1))

    @classmethod
    def anything_goes(cls, candidates: int) -> Together:
        """No rule at all."""
        nowhere = ElevationGrid(np.zeros((1, 1), np.float32), 1.0, 1.0)
        return cls(nowhere, np.zeros((candidates, 3)), np.zeros((0, 3)), 0.0, None)

    @property
    def free(self) -> bool:
        """Whether any set is allowed."""
        return self._separation_m == 0.0 and not self.relayed

    @property
    def separated(self) -> bool:
        """Whether anchors must keep apart."""
        return self._separation_m > 0.0

    @property
    def relayed(self) -> bool:
        """Whether links may go over other anchors."""
        return self._link is not None and self._link.relays > 0

    def may_join(self, chosen: list[int]) -> Mask:
        """(n,) which candidates make an allowed set with those chosen, which may itself lack a link."""
        allowed: Mask = self._clear_of_fixed.copy()
        for member in chosen:
            allowed[member] = False
            if self._separation_m > 0.0:
                allowed &= self._apart_from(member)
        return allowed & self._keeps_links(chosen) if self.relayed else allowed

    def allows(self, chosen: list[int]) -> bool:
        """Whether a whole set keeps the rules."""
        return all(bool(self.may_join([*chosen[:n], *chosen[n + 1 :]])[member]) for n, member in enumerate(chosen))

    def conflicts(self) -> npt.NDArray[np.intp]:
        """(pairs, 2) candidates that may not stand together."""
        pairs = [
            (member, int(other))
            for member in range(len(self._position_m))
            for other in np.flatnonzero(~self._apart_from(member))
            if other > member
        ]
        return np.array(pairs, np.intp).reshape(-1, 2)

    def _far_from(self, place_m: Floats) -> Mask:
        """(n, f) bool: which candidates are far enough from places (f, 3)."""
        apart_m2 = ((self._position_m[:, None, :] - place_m[None, :, :]) ** 2).sum(axis=2)
        far: Mask = apart_m2 >= self._separation_m**2
        return far

    def _apart_from(self, member: int) -> Mask:
        if member not in self._apart:
            self._apart[member] = self._far_from(self._position_m[[member]])[:, 0]
        return self._apart[member]

    def _sees(self, member: int) -> Mask:
        if member not in self._linked:
            assert self._link is not None
            place_m = self._position_m[[member]]
            self._linked[member] = linked_pairs(self._grid, self._link, place_m, self._position_m)[0]
        return self._linked[member]

    def _keeps_links(self, chosen: list[int]) -> Mask:
        """Which candidates, once in, leave every member within so many hops of a base."""
        assert self._link is not None
        most = self._link.relays + 1
        hops = self._hops(chosen, {member: 1 for member in chosen if self._direct[member]}, most)
        cut_off = [member for member in chosen if member not in hops]
        own = np.where(self._direct, 1, FAR)
        for member, hop in hops.items():
            own[self._sees(member)] = np.minimum(own[self._sees(member)], hop + 1)
        allowed: Mask = own <= most
        if not cut_off:
            return allowed
        # the newcomer has to bring back those that are cut off
        useful = np.zeros(len(own), np.bool_)
        for member in cut_off:
            useful |= self._sees(member)
        for newcomer in np.flatnonzero(allowed & useful).tolist():
            found = self._hops(cut_off, {newcomer: int(own[newcomer])}, most)
            useful[newcomer] = all(member in found for member in cut_off)
        return allowed & useful

    def _hops(self, members: list[int], reached: dict[int, int], most: int) -> dict[int, int]:
        """Hops of the members that can be reached from those in ``reached``, which it is added to."""
        frontier = list(reached)
        while frontier:
            following = []
            for member in frontier:
                if reached[member] >= most:
                    continue
                sees = self._sees(member)
                for other in members:
                    if other not in reached and sees[other]:
                        reached[other] = reached[member] + 1
                        following.append(other)
            frontier = following
        return reached


def may_stand_beside(
    grid: ElevationGrid, place_m: Floats, standing_m: Floats, min_separation_m: float, link: Link | None
) -> Mask:
    """(n,) which places (n, 3) are far enough from those who stand (k, 3), and leave every link over them whole.

    Also without a rule nobody flies into another.
    """
    apart = Together(grid, place_m, standing_m, max(min_separation_m, CLEAR_OF_ANOTHER_M), None).may_join([])
    if link is None or link.relays == 0:
        return apart
    some = np.flatnonzero(apart)
    linked = Together(grid, np.concatenate([standing_m, place_m[some]]), np.zeros((0, 3)), 0.0, link)
    apart[some] = linked.may_join(list(range(len(standing_m))))[len(standing_m) :]
    return apart
