"""Where a path begins, passes and ends, as squares of the grid planner, and when a rover gets to squares."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PathProblemError, PlaceError
from planning.kernels.path_segments import CLEAR, segment_cost
from planning.kernels.searches import costs_from
from planning.questions.problems import Goal, PathProblem, Place
from planning.validation import PathLimit, validate_path

from .checks import Ground, place_error, sight_error
from .fields import CostField, KernelField, reasons_of, running_sums
from .outcomes import Reason
from .places import sampled, squares_with_middle_in
from .sight_maps import SightMaps

__all__ = ["Ends", "arrivals_along", "ends_of", "fastest_arrivals_s", "posts_of", "square_ends"]

Numbers = npt.NDArray[np.float64]
Places = npt.NDArray[np.float64]

# squares around a place from whose middles it is tried to be reached: with limits on pitch or roll few headings may be
# driven, and the middle of a square that lies in one of them may be far
REACHES = (2, 4, 8, 16)
# so many places of a goal area without a square that is allowed as a whole are tried to be stood on
MOST_TRIED = 64
# squares this near a path are met when the path is there
BESIDE = 2


@dataclass(frozen=True, eq=False, slots=True)
class Ends:
    """Squares from which a place is reached, of the grid planner.

    nodes: (n,) row · cols + col. costs: (n,) between their middles and the place. places: (n, 2) fractional posts of
    the place itself, which for an area is the middle of the square.
    """

    nodes: npt.NDArray[np.int64]
    costs: npt.NDArray[np.float64]
    places: Places


def posts_of(field: CostField, places: Sequence[Place]) -> Places:
    """(n, 2) fractional posts of places."""
    return np.array([field.grid.post_at(*place) for place in places], np.float64).reshape(-1, 2)


def ends_of(problem: PathProblem, field: CostField, maps: SightMaps | None = None) -> tuple[Ends, ...]:
    """The start, each way-point, and all goals as one; with maps, exact sight lines are asked for each place as well.

    Raises PlaceError, PathProblemError.
    """
    named = [("start", problem.start), *((f"way-point {n}", at) for n, at in enumerate(problem.way_points, 1))]
    ground, kernel_field = Ground(problem, field, maps), field.for_kernels()
    stops = [_of_place(ground, kernel_field, name, place, name == "start") for name, place in named]
    for (name, place), (_, before) in zip(named[1:], named[:-1], strict=True):
        if place == before:
            raise PathProblemError(f"The {name} is the place before it; leave it out.")
    ahead, last = [], named[-1][1]
    faults: list[PlaceError] = []
    for goal in problem.goals:
        _check_not_there(named[-1][0], last, goal)
        try:
            ahead.append(_of_goal(ground, kernel_field, goal))
        except PlaceError as fault:
            faults.append(fault)
    if not ahead:
        raise faults[0]
    return (*stops, _joined(ahead))


def _check_not_there(name: str, place: Place, goal: Goal) -> None:
    if isinstance(goal, tuple):
        if place == goal:
            raise PathProblemError(f"The {name} and the goal are the same place, so there is no path to plan.")
    elif shapely.intersects_xy(goal, *place):
        raise PathProblemError(f"The {name} lies in the goal area already, so there is no path to plan.")


def _of_place(ground: Ground, kernel_field: KernelField, name: str, place: Place, onward: bool) -> Ends:
    row, col = _standing(ground, name, place)
    ends = square_ends(kernel_field, row, col, onward)
    if len(ends.nodes) == 0 and segment_cost(kernel_field, row, col, row, col)[0] == CLEAR:
        raise place_error(ground, name, (row, col), (Reason.PITCH_OR_ROLL,))
    return ends


def _of_goal(ground: Ground, kernel_field: KernelField, goal: Goal) -> Ends:
    field = ground.field
    if isinstance(goal, tuple):
        return _of_place(ground, kernel_field, "goal", goal, False)
    inside = squares_with_middle_in(field.grid, goal)
    rows, cols = np.nonzero(inside & (field.reasons == 0))
    if len(rows) == 0:
        at = goal.representative_point()
        try:
            if not inside.any():
                return _of_place(ground, kernel_field, "goal", (at.x, at.y), False)
            reasons = reasons_of(int(np.bitwise_or.reduce(field.reasons[inside])))
            raise place_error(ground, "goal", field.grid.post_at(at.x, at.y), reasons, "area")
        except PlaceError:
            # a square is allowed as a whole or not at all; the area may reach into what is allowed of one
            if ground.problem.moves or not any(_stands(ground.problem, place) for place in _places_in(ground, goal)):
                raise
    nodes = (rows * field.reasons.shape[1] + cols).astype(np.int64)
    return Ends(nodes, np.zeros(len(nodes)), np.column_stack([rows, cols]).astype(np.float64) + 0.5)


def _places_in(ground: Ground, area: shapely.Polygon | shapely.MultiPolygon) -> Iterator[Place]:
    """Places all over an area and outside what is no-go, one in each square of the field, of large areas some."""
    grid, left = ground.field.grid, shapely.difference(area, shapely.union_all(ground.problem.no_go))
    if left.is_empty:
        return
    west_m, south_m, east_m, north_m = left.bounds
    (row, col), (last_row, last_col) = grid.post_at(west_m, north_m), grid.post_at(east_m, south_m)
    some_rows = range(max(int(row), 0), min(int(last_row), grid.rows - 2) + 1)
    some_cols = range(max(int(col), 0), min(int(last_col), grid.cols - 2) + 1)
    thinned = max(1, math.ceil(math.sqrt(len(some_rows) * len(some_cols) / MOST_TRIED)))
    for r in some_rows[::thinned]:
        for c in some_cols[::thinned]:
            corners = [grid.position_of(r + down, c + across) for down, across in ((1, 0), (0, 1))]
            piece = shapely.intersection(left, shapely.box(*corners[0], *corners[1]))
            if piece.area > 0.0:
                at = piece.representative_point()
                yield at.x, at.y


def square_ends(kernel_field: KernelField, row: float, col: float, onward: bool) -> Ends:
    """Squares near by whose middle a straight segment joins with a place; onward: from the place, else to it."""
    rows, cols = kernel_field.allowed.shape
    nodes: list[int] = []
    costs: list[float] = []
    for reach in REACHES:
        for r in range(max(int(row) - reach, 0), min(int(row) + reach + 1, rows)):
            for c in range(max(int(col) - reach, 0), min(int(col) + reach + 1, cols)):
                there = (r + 0.5, c + 0.5)
                code, cost = segment_cost(kernel_field, *((row, col, *there) if onward else (*there, row, col)))[:2]
                if code == CLEAR and kernel_field.allowed[r, c] == 1:
                    nodes.append(r * cols + c)
                    costs.append(cost)
        if nodes:
            break
    place = np.tile([row, col], (len(nodes), 1)).reshape(-1, 2)
    return Ends(np.array(nodes, np.int64), np.array(costs, np.float64), place)


def _joined(ends: Sequence[Ends]) -> Ends:
    """All of several ends; of a square that is in two of them the cheaper."""
    nodes, costs = np.concatenate([e.nodes for e in ends]), np.concatenate([e.costs for e in ends])
    order = np.lexsort((costs, nodes))
    first = order[np.unique(nodes[order], return_index=True)[1]]
    return Ends(nodes[first], costs[first], np.concatenate([e.places for e in ends])[first])


def _standing(ground: Ground, name: str, place: Place) -> tuple[float, float]:
    """The fractional post of a place that can be stood on; raises PlaceError."""
    field = ground.field
    grid = field.grid
    row, col = grid.post_at(*place)
    if not grid.contains(*place):
        raise place_error(ground, name, (row, col), ())
    row, col = min(max(row, 0.0), grid.rows - 1.0), min(max(col, 0.0), grid.cols - 1.0)
    if segment_cost(field.for_kernels(), row, col, row, col)[0] != CLEAR:
        bits = 0
        for r, c in {field.square_at(max(row - d, 0.0), max(col - e, 0.0)) for d in (0, 1e-9) for e in (0, 1e-9)}:
            bits |= int(field.reasons[r, c])
        closed = reasons_of(bits)
        # a square that exact sight lines took away on some path says little of this place in it
        hidden = sight_error(ground, name, (row, col)) if closed == (Reason.SIGHT_LINE,) else None
        tried = {Reason.SIGHT_LINE, Reason.BUBBLE} & set(closed)
        # of anchors that move it is not known when the rover gets there
        if tried or ground.problem.moves or not _stands(ground.problem, place):
            raise hidden or place_error(ground, name, (row, col), closed)
    hidden = sight_error(ground, name, (row, col))
    if hidden is not None:
        raise hidden
    return row, col


def _stands(problem: PathProblem, place: Place) -> bool:
    """Whether the validator lets the rover be at a place in a square of which some is forbidden."""

    of_ways = (PathLimit.START, PathLimit.WAY_POINTS, PathLimit.GOAL, PathLimit.BUBBLE)
    return all(check.limit in of_ways for check in validate_path(problem, [place]).failures)


def fastest_arrivals_s(problem: PathProblem, field: CostField) -> Numbers:
    """(rows - 1, cols - 1) soonest arrival over what the ground and the areas allow; +inf = never."""
    timed = _timed(field)
    row, col = problem.grid.post_at(*problem.start)
    ends = square_ends(timed, row, col, True)
    arrival_s: Numbers = costs_from(timed, ends.nodes, ends.costs, False)[0].reshape(field.reasons.shape)
    return arrival_s


def arrivals_along(field: CostField, fastest_s: Numbers, places: npt.NDArray[np.float64]) -> Numbers:
    """Arrivals when a path is taken: its own times on it and beside it, elsewhere the soonest, as much later."""
    fine, _ = sampled(places, 1.0)
    times_s = running_sums(field.for_kernels(), fine).time_s
    rows, cols = np.minimum(fine.astype(np.intp), np.array(field.reasons.shape) - 1).T
    soonest_s = fastest_s[rows, cols]
    some = np.isfinite(soonest_s) & (soonest_s > 0.0)
    later = float(np.median(times_s[some] / soonest_s[some])) if some.any() else 1.0
    arrival_s = fastest_s * max(later, 1.0)
    for down in range(-BESIDE, BESIDE + 1):
        for across in range(-BESIDE, BESIDE + 1):
            r = np.clip(rows + down, 0, field.reasons.shape[0] - 1)
            c = np.clip(cols + across, 0, field.reasons.shape[1] - 1)
            known = np.isfinite(arrival_s[r, c])
            arrival_s[r[known], c[known]] = times_s[known]
    return arrival_s


def _timed(field: CostField) -> KernelField:
    """The field whose cost is seconds, and where anchors forbid nothing."""
    whole = field.for_kernels()
    seconds = whole.rates._replace(
        least_per_m=float(whole.pace.min()), per_m=0.0, per_climbed_m=0.0, per_s=1.0, per_dark_s=0.0
    )
    return whole._replace(
        allowed=(field.obstacles() == 0).astype(np.uint8),
        added=np.zeros_like(whole.added),
        hidden=np.zeros_like(whole.hidden),
        rates=seconds,
    )
