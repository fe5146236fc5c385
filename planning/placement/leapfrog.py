"""Anchors that follow a rover along a long path: which drone moves where, and when, stretch by stretch."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from planning.errors import PlacementError
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import check_anchors

from .goals import Goal
from .moves import ROUNDING, Move, MoveQuestion
from .repositioning import reposition_for
from .stretches import SeenStretch, path_between, path_length_m, value_over

__all__ = ["Leapfrog", "StretchPlan", "TimedMove", "leapfrog"]


@dataclass(frozen=True, slots=True)
class TimedMove:
    """A move with its times, seconds since the rover's start, and the stretch that it is for."""

    move: Move
    start_s: float
    end_s: float
    stretch: int


@dataclass(frozen=True, slots=True)
class StretchPlan:
    """A stretch of the path: where it lies, metres along the path, when it is driven, and who stands where.

    waited_s: how long the rover waits at its start for drones. counted: the anchors without those that stay occluded.
    unmoved, value: the goal's share over the stretch with the anchors as they were at the start of the path, and as
    they stand then.
    """

    from_m: float
    to_m: float
    depart_s: float
    arrive_s: float
    waited_s: float
    anchors: tuple[Anchor, ...]
    counted: tuple[Anchor, ...]
    unmoved: float
    value: float


@dataclass(frozen=True, slots=True)
class Leapfrog:
    """The answer to ``leapfrog``; shares are of the path's length."""

    stretches: tuple[StretchPlan, ...]
    moves: tuple[TimedMove, ...]

    @property
    def share(self) -> float:
        """Part of the path within limits when the drones follow."""
        return self._mean([stretch.value for stretch in self.stretches])

    @property
    def share_unmoved(self) -> float:
        """The same when nobody moves."""
        return self._mean([stretch.unmoved for stretch in self.stretches])

    @property
    def flight_m(self) -> float:
        """Metres that all drones fly."""
        return sum(timed.move.flight_m for timed in self.moves)

    @property
    def waited_s(self) -> float:
        """Seconds that the rover waits for drones."""
        return sum(stretch.waited_s for stretch in self.stretches)

    @property
    def arrive_s(self) -> float:
        """When the rover is at the end."""
        return self.stretches[-1].arrive_s

    def _mean(self, values: list[float]) -> float:
        lengths = np.array([stretch.to_m - stretch.from_m for stretch in self.stretches])
        return float(np.array(values) @ lengths / lengths.sum())


def leapfrog(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    path_m: npt.ArrayLike,
    question: MoveQuestion,
    *,
    stretch_m: float,
    rover_m_per_s: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> Leapfrog:
    """Moves of anchors along a path (n, 2), so that a share of the goal holds over each stretch of it.

    Before each stretch drones move, one after the other, until the share holds or no move gains. A drone that the
    stretch before does not need flies while the rover still drives there; for any other the rover waits, since a drone
    on its way is no anchor. The rover drives on over a stretch that cannot be served.
    Raises PlacementError, AnchorError.
    """
    if not (math.isfinite(stretch_m) and stretch_m > 0.0 and math.isfinite(rover_m_per_s) and rover_m_per_s > 0.0):
        raise PlacementError(f"stretch_m and rover_m_per_s must be > 0, not {stretch_m} and {rover_m_per_s}.")
    check_anchors(grid, anchors)
    goal, movable = question.goal, question.movable
    path = np.asarray(path_m, np.float64)
    length_m = path_length_m(path)
    edges_m = np.linspace(0.0, length_m, max(math.ceil(length_m / stretch_m - 1e-9), 1) + 1)
    hidden = frozenset(question.occluded)
    standing, start = tuple(anchors), _without(anchors, hidden)
    plans: list[StretchPlan] = []
    moves: list[TimedMove] = []
    last: SeenStretch | None = None
    clock_s = 0.0
    for number, (from_m, to_m) in enumerate(pairwise(edges_m.tolist())):
        stretch = SeenStretch.of(
            grid, path_between(path, from_m, to_m), question.receiver_above_ground_m, question.sight
        )
        ready_s = clock_s
        moved: set[str] = set()
        for _ in range(len(anchors)):
            # who has moved for this stretch stays: another flight would be for less than the first
            free = [a.id for a in anchors if a.id not in moved and (movable is None or a.id in movable)]
            found = reposition_for(stretch, standing, replace(question, occluded=hidden, movable=free), toward=True)
            if found.move is None:
                break
            earliest_s = _free_from(last, plans, moves, found.move, goal, clock_s)
            end_s = earliest_s + found.move.flight_s
            moves.append(TimedMove(found.move, earliest_s, end_s, number))
            ready_s = max(ready_s, end_s)
            standing = found.anchors_after(standing)
            hidden -= {found.move.anchor.id}
            moved.add(found.move.anchor.id)
        arrive_s = ready_s + float(to_m - from_m) / rover_m_per_s
        plans.append(
            StretchPlan(
                float(from_m),
                float(to_m),
                ready_s,
                arrive_s,
                ready_s - clock_s,
                standing,
                _without(standing, hidden),
                value_over(stretch, start, goal),
                value_over(stretch, _without(standing, hidden), goal),
            )
        )
        clock_s, last = arrive_s, stretch
        if progress is not None:
            progress((number + 1) / (len(edges_m) - 1))
    return Leapfrog(tuple(plans), tuple(moves))


def _without(anchors: Sequence[Anchor], ids: Collection[str]) -> tuple[Anchor, ...]:
    return tuple(anchor for anchor in anchors if anchor.id not in ids)


def _free_from(
    last: SeenStretch | None,
    plans: list[StretchPlan],
    moves: list[TimedMove],
    move: Move,
    goal: Goal,
    clock_s: float,
) -> float:
    """When a drone may leave: while the rover drives the stretch before, if that holds without it, else afterwards.

    A drone that has moved for the same stretch already leaves when it has arrived.
    """
    arrived_s = max((timed.end_s for timed in moves if timed.move.anchor.id == move.anchor.id), default=0.0)
    if last is None:
        return arrived_s
    before = plans[-1]
    away = {timed.move.anchor.id for timed in moves if timed.stretch == len(plans)} | {move.anchor.id}
    left = _without(before.counted, away)
    free_s = before.depart_s if value_over(last, left, goal) >= before.value - ROUNDING else clock_s
    return max(free_s, arrived_s)
