"""What anchors are worth over a stretch of path, line by line: as a share, and point by point."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import Anchor

from .goals import Goal
from .judges import CountJudge, GeometryJudge, Problem, shown_value
from .placing import anchor_rows, positions_of
from .sight import SightOptions, SightTable
from .stretches import SeenStretch
from .targets import Targets
from .working_out import sight_table

__all__ = ["good_along", "problem_along", "value_over", "worth_over"]

Floats = npt.NDArray[np.float64]


def value_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> float:
    """The goal's share over all points of a stretch, line by line."""
    return worth_over(stretch, anchors, goal)[0]


def worth_over(stretch: SeenStretch, anchors: Sequence[Anchor], goal: Goal) -> tuple[float, float]:
    """(the same, the mean part of the anchors that the goal needs in sight), both 0..1."""
    bits = stretch.seen_from(positions_of(anchors), stretch.targets)
    problem = problem_along(stretch.targets, goal, anchors, bits, np.zeros((0, 4)), None)
    everyone = list(range(len(anchors)))
    partly = CountJudge(problem, goal.needed_with_spare, partial=True).value(everyone)
    return shown_value(problem, everyone), partly


def good_along(
    grid: ElevationGrid, targets: Targets, anchors: Sequence[Anchor], goal: Goal, sight: SightOptions
) -> npt.NDArray[np.bool_]:
    """(m,) which points have what a goal that is a share asks for."""
    if not anchors:
        return np.zeros(len(targets), np.bool_)
    exact = SightOptions("exact", sight.curvature, sight.max_range_m, sight.unknown)
    bits = sight_table(grid, targets, positions_of(anchors), exact).table.bits
    problem = problem_along(targets, goal, anchors, bits, np.zeros((0, 4)), None)
    return np.asarray(GeometryJudge(problem).of_targets(list(range(len(anchors)))) > 0.5)


def problem_along(
    targets: Targets,
    goal: Goal,
    others: Sequence[Anchor],
    others_bits: npt.NDArray[np.uint64],
    rows: Floats,
    bits: npt.NDArray[np.uint64] | None,
) -> Problem:
    """Others fixed and places as candidates; or the others as candidates where there are no places."""
    points = len(targets)
    words = others_bits.shape[1]
    none = SightTable(np.zeros((0, words), np.uint64), points)
    seen = SightTable(others_bits, points)
    if bits is None:
        return Problem(targets, goal, anchor_rows(others, goal), seen, np.zeros((0, 4)), none)
    return Problem(targets, goal, rows, SightTable(bits, points), anchor_rows(others, goal), seen)
