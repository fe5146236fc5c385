"""A whole path found by closer looks, leg by leg, and judged by the validator."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.questions.problems import PathProblem, Place
from planning.validation import PathValidation, validate_path

from .checks import hidden_places
from .closer_look import CloserLook
from .corridors import SIXTEEN, cost_of, drop_repeats, grid_way, straightened
from .describing import described
from .ends import square_ends
from .fields import CostField
from .judging import Judge
from .outcomes import Path
from .places import metres_of, sampled
from .sight_maps import SightMaps

__all__ = ["Closer", "look_closer"]

Places = npt.NDArray[np.float64]

# so many ways are handed to the validator before it is given up
MOST_REFUSALS = 24


@dataclass(frozen=True, eq=False, slots=True)
class Closer:
    """What closer looks ended with: a path that the validator passes, a proof to a grain in metres, or neither.

    leg: the one that is cut, or was not decided. why: what kept a way and a proof from being found.
    """

    found: tuple[Path, PathValidation] | None
    cut: bool
    grain_m: float
    leg: int
    why: str


def look_closer(problem: PathProblem, field: CostField, maps: SightMaps | None, ended: Callable[[], bool]) -> Closer:
    """Search between the squares of a field, which hold no way."""
    judge = Judge(problem, field, maps)
    stops = [problem.start, *problem.way_points]
    goals = [*((stop,) for stop in stops[1:]), problem.goals]
    legs = [CloserLook(judge, begin, there, ended) for begin, there in zip(stops, goals, strict=True)]
    for _ in range(MOST_REFUSALS):
        ways = []
        for number, leg in enumerate(legs):
            look = leg.look()
            if look.places is None:
                return Closer(None, look.cut, look.grain_m, number, look.why)
            ways.append(look.places)
        # the shorter one first; what is refused of the other is what the next way keeps away from
        for shaped in ([_eased(field, way) for way in ways], ways):
            found, refused = _judged(problem, field, maps, drop_repeats(np.concatenate(shaped)))
            if found is not None:
                return Closer(found, False, 0.0, -1, "")
        some = [leg.refuse(refused) for leg in legs]
        if not any(some):
            break
    return Closer(None, False, math.nan, 0, "the validator refused what was found")


def _judged(
    problem: PathProblem, field: CostField, maps: SightMaps | None, places: Places
) -> tuple[tuple[Path, PathValidation] | None, list[Place]]:
    """The path over a way if the validator passes it, else where it does not."""

    hidden = hidden_places(problem, field, maps, places, everywhere=True)
    if len(hidden):
        return None, list(zip(*(axis.tolist() for axis in metres_of(problem.grid, hidden)), strict=True))
    path = described(problem, field, maps, places, everywhere=True)
    validation = validate_path(problem, np.column_stack([path.east_m, path.north_m]))
    if validation.passed:
        return (path, validation), []
    return None, [check.first_m for check in validation.failures if check.first_m is not None]


def _eased(field: CostField, way: Places) -> Places:
    """A way with the grid's cheapest in place of each stretch that lies over squares that may be driven anyway."""
    kernel_field = field.for_kernels()
    fine, corners = sampled(way, 1.0)
    free = np.array([math.isfinite(cost_of(kernel_field, fine[n : n + 2])) for n in range(len(fine) - 1)])
    # a stretch begins and ends where that changes
    turns = np.flatnonzero(np.diff(free)) + 1
    cuts = [0, *turns.tolist(), len(fine) - 1]
    eased = []
    for begin, end in itertools.pairwise(cuts):
        own = corners[(corners > begin) & (corners < end)]
        stretch = fine[[begin, *own.tolist(), end]]
        if free[begin] and end - begin > 1:
            (row, col), (last_row, last_col) = stretch[0].tolist(), stretch[-1].tolist()
            ends = square_ends(kernel_field, row, col, True), square_ends(kernel_field, last_row, last_col, False)
            over, _ = grid_way(kernel_field, ends, SIXTEEN)
            if over is not None:
                straight = straightened(kernel_field, over)
                stretch = straight.places if straight.cost < cost_of(kernel_field, stretch) else stretch
        eased.append(stretch)
    return drop_repeats(np.concatenate(eased))
