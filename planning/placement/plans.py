"""Who moves where and when, and where along the path the goal holds before and after: of one move or of many."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.words import time_words
from terrain import ElevationGrid
from visibility import Anchor

from .leapfrog import Leapfrog, StretchPlan, TimedMove, leapfrog
from .moves import ROUNDING, MoveQuestion
from .repositioning import reposition
from .stretches import good_along, path_between, path_length_m
from .targets import path_targets

__all__ = ["RepositioningPlan", "plan_repositioning"]


@dataclass(frozen=True, slots=True, eq=False)
class RepositioningPlan:
    """The answer to ``plan_repositioning``.

    schedule: moves and stretches; of one move alone, a single stretch for which the rover does not wait.
    point_m: (m, 3) places of the antenna along the path. good: (m, 2) bool, where the goal holds, before and after.
    restored: whether the share asked for is reached on every stretch. sentence: all that in words.
    """

    schedule: Leapfrog
    point_m: npt.NDArray[np.float64]
    good: npt.NDArray[np.bool_]
    restored: bool
    sentence: str


def plan_repositioning(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    path_m: npt.ArrayLike,
    question: MoveQuestion,
    *,
    stretch_m: float | None = None,
    rover_m_per_s: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> RepositioningPlan:
    """What ``reposition`` advises, with ``stretch_m`` what ``leapfrog`` does, and what it brings along the path (n, 2).

    Raises PlacementError, AnchorError.
    """
    path = np.asarray(path_m, np.float64)
    if stretch_m is None:
        one = reposition(grid, anchors, path, question)
        moves = () if one.move is None else (TimedMove(one.move, 0.0, one.move.flight_s, 0),)
        after = one.anchors_after(anchors)
        hidden = set(question.occluded) - {timed.move.anchor.id for timed in moves}
        counted = tuple(anchor for anchor in after if anchor.id not in hidden)
        length_m = path_length_m(path)
        arrive_s = length_m / rover_m_per_s
        only = StretchPlan(0.0, length_m, 0.0, arrive_s, 0.0, after, counted, one.before, one.after)
        schedule = Leapfrog((only,), moves)
    else:
        schedule = leapfrog(
            grid, anchors, path, question, stretch_m=stretch_m, rover_m_per_s=rover_m_per_s, progress=progress
        )
    start = [anchor for anchor in anchors if anchor.id not in question.occluded]
    points_m, good = [], []
    for stretch in schedule.stretches:
        part = path_targets(grid, path_between(path, stretch.from_m, stretch.to_m), question.receiver_above_ground_m)
        points_m.append(part.point_m)
        both = (start, stretch.counted)
        good.append(np.column_stack([good_along(grid, part, who, question.goal, question.sight) for who in both]))
    return RepositioningPlan(
        schedule,
        np.concatenate(points_m),
        np.concatenate(good),
        all(stretch.value >= question.share - ROUNDING for stretch in schedule.stretches),
        _sentence(schedule),
    )


def _sentence(found: Leapfrog) -> str:
    gained = f"{found.share_unmoved:.1%} of the path before, {found.share:.1%} after"
    if not found.moves:
        why = (
            "nothing has to"
            if found.share_unmoved >= 1.0 - ROUNDING
            else "no move of one drone that is needed gives more"
        )
        return f"Nobody moves, since {why}: {gained}."
    if len(found.stretches) == 1 and len(found.moves) == 1:
        return f"{found.moves[0].move.words()}: {gained}."
    return (
        f"{len(found.moves)} move{'' if len(found.moves) == 1 else 's'}, {found.flight_m / 1000:.1f} km of flight, and "
        f"the rover waits {time_words(found.waited_s)}: {gained}."
    )
