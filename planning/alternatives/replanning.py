"""A plan made again from wherever the rover is by now: sight, field and the costs to the goals are worked out once."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planning.errors import PathProblemError, PlaceError
from planning.kernels.searches import costs_from
from planning.paths.checks import without_broken_squares, without_refused_squares
from planning.paths.corridors import EIGHT, Way, cost_of, drop_repeats, grid_way, straightened
from planning.paths.describing import Endings, described
from planning.paths.ends import Ends, ends_of, square_ends
from planning.paths.fields import CostField, KernelField, cost_field
from planning.paths.outcomes import PathOutcome
from planning.paths.places import sampled
from planning.paths.planning import plan_path
from planning.paths.sight_maps import SightMaps, minimum_of, sight_maps
from planning.questions.problems import PathProblem, Place
from planning.validation import validate_path

__all__ = ["PreparedPlan", "prepare_replanning"]

PLANNER = "ways to the goals known before, pulled straight"
ROUNDS = 2  # of pulling straight
MOST_REPAIRS = 8  # so often a way leads around squares in which exact sight lines refused the one before
LEAVES_BEFORE = 24  # cells before and after such squares that a way is left alone


@dataclass(frozen=True, eq=False, slots=True)
class PreparedPlan:
    """What a problem's plans from any start have in common; ``prepare_replanning`` makes it.

    cost: (rows - 1, cols - 1) of the cheapest way over the eight neighbours from the middle of each square to a goal,
    in the units of the weights, +inf = none. prepared_s: what it took, seconds.
    """

    problem: PathProblem
    cost: npt.NDArray[np.float64]
    prepared_s: float
    _onward: npt.NDArray[np.int64]
    _field: CostField
    _maps: SightMaps | None

    def plan_from(self, start: Place, *, anew: bool = True, stop: Callable[[], bool] | None = None) -> PathOutcome:
        """The plan from another start, (east_m, north_m): by the known costs, or anew where these are no help.

        Around squares that exact sight lines, the bubble or the validator refuse it leads by a search of its own. Anew
        where that does not help, and where the known costs lead nowhere; sight is known then too, but it takes what a
        plan takes. anew: whether that is done; else the outcome is out of budget, at once. Raises what ``plan_path``
        raises.
        """
        begin_s = time.perf_counter()
        problem, field = replace(self.problem, start=start), self._field
        ending = Endings(problem, _nobody, stop or _never, begin_s)
        ending.field = field
        ending.warnings = self._maps.warnings if self._maps is not None else ()
        way: Way | None = self._way(*ends_of(problem, field, self._maps))
        new: list[npt.NDArray[np.float64]] = [] if way is None else [way.places]
        for _ in range(MOST_REPAIRS):
            if way is None or ending.ended():
                break
            repaired = self._without_broken(problem, field, new)
            if repaired is None:
                path = described(problem, field, self._maps, way.places)
                validation = validate_path(problem, np.column_stack([path.east_m, path.north_m]))
                if validation.passed:
                    ending.first_path_s = time.perf_counter() - begin_s
                    return ending.found(path, validation, math.nan, PLANNER, True)
                repaired = without_refused_squares(field, validation)
            if repaired is None:
                break
            refused = (repaired.reasons != 0) & (field.reasons == 0)
            field = repaired
            mended = _mended(field.for_kernels(), way.places, refused)
            way, new = mended if mended is not None else (_around(problem, field, self._maps), [])
            # sight along what stayed is known; a bubble grows along the whole way
            if way is not None and (not new or problem.limits.bubble_epsilon > 0.0):
                new = [way.places]
        if anew:
            return plan_path(problem, stop=stop)
        return ending.out_of_budget("The costs that are known lead to no path from there that passes; plan it anew.")

    def _without_broken(
        self, problem: PathProblem, field: CostField, parts: list[npt.NDArray[np.float64]]
    ) -> CostField | None:
        """The field without the squares in which parts of a way break a limit; None where none does."""
        found: CostField | None = None
        for places in parts:
            found = without_broken_squares(problem, found or field, self._maps, places) or found
        return found

    def _way(self, begin: Ends, end: Ends) -> Way | None:
        """The known way from the best square near the start, pulled straight; None where there is none."""
        costs = begin.costs + self.cost.ravel()[begin.nodes]
        if not len(costs) or not np.isfinite(costs).any():
            return None
        nodes = [int(begin.nodes[int(np.argmin(costs))])]
        while (onward := int(self._onward[nodes[-1]])) >= 0:
            nodes.append(onward)
        middles = np.column_stack(np.divmod(nodes, self.cost.shape[1])) + 0.5
        last = end.places[np.flatnonzero(end.nodes == nodes[-1])[0]]
        places = drop_repeats(np.concatenate([begin.places[:1], middles, last[None, :]]))
        kernel_field = self._field.for_kernels()
        places = _turns(places)
        return straightened(kernel_field, Way(places, cost_of(kernel_field, places)), rounds=ROUNDS)


def _around(problem: PathProblem, field: CostField, maps: SightMaps | None) -> Way | None:
    """The cheapest way over a field from which squares were taken; None where there is none."""
    try:
        ends = ends_of(problem, field, maps)
    except PlaceError:
        return None
    kernel_field = field.for_kernels()
    way, _ = grid_way(kernel_field, ends, EIGHT)
    return None if way is None else straightened(kernel_field, Way(_turns(way.places), way.cost), rounds=ROUNDS)


def _mended(
    field: KernelField, places: npt.NDArray[np.float64], refused: npt.NDArray[np.bool_]
) -> tuple[Way, list[npt.NDArray[np.float64]]] | None:
    """(a way that leaves one, a little before squares that were refused, and comes back a little after; what is new).

    None where that cannot be: the cheapest way around may be another one altogether.
    """
    fine, corner = sampled(places, 1.0)
    near = _beside(fine, refused)
    if not len(near):
        return None
    parts: list[npt.NDArray[np.float64]] = []
    new: list[npt.NDArray[np.float64]] = []
    done = -1
    for some in np.split(near, np.flatnonzero(np.diff(near) > 2 * LEAVES_BEFORE) + 1):
        first, last = max(int(some[0]) - LEAVES_BEFORE, 0), min(int(some[-1]) + LEAVES_BEFORE, len(fine) - 1)
        (row, col), (last_row, last_col) = fine[first].tolist(), fine[last].tolist()
        ends = square_ends(field, row, col, True), square_ends(field, last_row, last_col, False)
        local, _ = grid_way(field, ends, EIGHT)
        if local is None:
            return None
        straight = straightened(field, Way(_turns(local.places), local.cost), rounds=ROUNDS)
        parts += [fine[corner[(corner > done) & (corner < first)]], straight.places]
        new.append(straight.places)
        done = last
    whole = drop_repeats(np.concatenate([*parts, fine[corner[corner > done]]]))
    cost = cost_of(field, whole)
    return (Way(whole, cost), new) if math.isfinite(cost) else None


def _beside(fine: npt.NDArray[np.float64], refused: npt.NDArray[np.bool_]) -> npt.NDArray[np.intp]:
    """Numbers of the places (n, 2) in squares that were refused, or next to one."""
    rows, cols = refused.shape
    at = np.floor(fine).astype(np.intp)
    touched = np.zeros(len(fine), np.bool_)
    for down in (-1, 0, 1):
        for across in (-1, 0, 1):
            row, col = np.clip(at[:, 0] + down, 0, rows - 1), np.clip(at[:, 1] + across, 0, cols - 1)
            touched |= refused[row, col]
    return np.flatnonzero(touched)


def _turns(places: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Where a way (n, 2) turns, and its ends: what lies straight between is the same way with more to pull at."""
    step = np.diff(places, axis=0)
    turning = np.abs(step[1:, 0] * step[:-1, 1] - step[1:, 1] * step[:-1, 0]) > 1e-9
    turning |= (step[1:] * step[:-1]).sum(axis=1) < 0.0
    return np.ascontiguousarray(places[np.concatenate([[True], turning, [True]])])


def prepare_replanning(problem: PathProblem) -> PreparedPlan:
    """The costs from everywhere to the goals of a problem, for plans from wherever the rover is.

    Of the problem's start only the goals' checks are made. Raises PathProblemError where anchors move, places are to be
    passed, or the rover does not turn on the spot; else what ``plan_path`` raises.
    """
    if problem.moves or problem.way_points or problem.rover.min_turning_radius_m > 0.0:
        raise PathProblemError(
            "Plans are prepared for anchors that stand, without way-points, and for a rover that turns on the spot."
        )
    begin_s = time.perf_counter()
    minimum = minimum_of(problem)
    if problem.maps is None and minimum is not None:
        problem = replace(problem, maps=minimum)
    maps = sight_maps(problem)
    field = cost_field(problem, maps)
    goals = ends_of(problem, field, maps)[-1]
    cost, onward = costs_from(field.for_kernels(), goals.nodes, goals.costs, True)
    taken_s = time.perf_counter() - begin_s
    return PreparedPlan(problem, cost.reshape(field.reasons.shape), taken_s, onward, field, maps)


def _nobody(_: float) -> None:
    """Tells nobody of progress."""


def _never() -> bool:
    """Nobody stops it."""
    return False
