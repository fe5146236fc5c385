"""Paths through the air for the anchors themselves: above the morphing map, a bubble away from the ground.

De Vivo et al. use the Digital Morphing Map so: air above it is where the vehicle's own positioning is good enough.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import scipy

from planning.errors import PlaceError
from planning.kernels.path_smoothing import flight_cost, pull_flight
from planning.kernels.searches import least_worst_way
from planning.paths.outcomes import FlightOutcome
from planning.questions.problems import FlightProblem
from planning.validation import PathValidation, validate_flight
from terrain import ElevationGrid, told_place
from visibility.sight.roofs import least_heights_clear

from .leaves import surely_shut
from .outcomes import PathStatus, Reason
from .places import Cells, outside_of, squares_touched
from .sampling import OwnProcess, State, Tell, box_space, solved

__all__ = ["plan_flight"]

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]


class Air(NamedTuple):
    """Air that may be flown, as the kernels take it.

    floor_m, ceiling_m: (rows - 1, cols - 1) float64, of each square; +inf and -inf where it may not be flown.
    climb_weight: what a metre of climb costs besides a metre of way.
    """

    floor_m: Floats
    ceiling_m: Floats
    cells: Cells
    climb_weight: float


def plan_flight(problem: FlightProblem, *, stop: Callable[[], bool] | None = None) -> FlightOutcome:
    """Plan a flight that stays above the floor, below the ceiling and a bubble away from the ground.

    Raises PathProblemError, PlaceError, PlanningProcessError.
    """

    begin_s = time.perf_counter()

    def ended() -> bool:
        return (stop is not None and stop()) or time.perf_counter() - begin_s > problem.budget.seconds

    with OwnProcess() as own:
        air = _air(problem)
        ends = [_place_in(problem, air, name) for name in ("start", "goal")]
        along = _over_the_squares(air, *ends)
        if along is None:
            meets = "between start and goal the floor meets the ceiling everywhere"
            if surely_shut(problem):
                return _nothing(problem, PathStatus.UNREACHABLE, f"There is no way: {meets}.", "proof", begin_s)
            sentence = f"No way was found, and that there is none is not proved: {meets} by the worst of each square."
            return _nothing(problem, PathStatus.UNDECIDED, sentence, "grain", begin_s)
        best, planner = pull_flight(air, along), "grid"
        own.begin(FlightTask(air, ends[0], ends[1], problem.budget.iterations, problem.seed))
        completed, sampled = own.answer(ended)
    if sampled is not None:
        shorter = pull_flight(air, sampled)
        if shorter[0] < best[0]:
            best, planner = shorter, "RRTConnect, then BIT*"
    cost, places = best
    corners_m = _metres(problem.grid, places)
    validation = validate_flight(problem, corners_m)
    stopped_by = "count" if completed else "stop" if stop is not None and stop() else "time"
    if not validation.passed:
        sentence = f"A flight was planned that the validator refuses: {validation.sentence}"
        return _nothing(problem, PathStatus.REFUSED, sentence, stopped_by, begin_s, validation)
    clearance_m = next(check.worst for check in validation.checks if check.limit == "distance to the ground")
    length_m = float(np.linalg.norm(np.diff(corners_m, axis=0), axis=1).sum())
    return FlightOutcome(
        PathStatus.FOUND,
        f"A flight of {length_m:,.0f} m was found, {clearance_m:.1f} m and more from the ground.",
        corners_m,
        np.array([place[2] - _floor_at(air, place) for place in places.tolist()]),
        clearance_m,
        float(cost),
        planner,
        stopped_by,
        problem.seed,
        validation,
        time.perf_counter() - begin_s,
    )


def _nothing(
    problem: FlightProblem,
    status: PathStatus,
    sentence: str,
    stopped_by: str,
    begin_s: float,
    validation: PathValidation | None = None,
) -> FlightOutcome:
    elapsed_s, none = time.perf_counter() - begin_s, np.zeros((0, 3))
    return FlightOutcome(
        *(status, sentence, none, np.zeros(0), math.nan, math.nan),
        *("none", stopped_by, problem.seed, validation, elapsed_s),
    )


def _air(problem: FlightProblem) -> Air:
    """Floor and ceiling of each square: the worst of its posts, the ground swollen by the bubble."""
    grid = problem.grid
    heights_m = grid.heights_m.astype(np.float64)
    floor_m, ceiling_m = (
        _swollen(grid, least_heights_clear(grid), problem.bubble_m),
        np.full(grid.shape, problem.ceiling_m),
    )
    if problem.ceiling_above_ground:
        ceiling_m += heights_m
    if problem.above is not None:
        above = problem.above
        top_m = heights_m + above.ceiling_m if above.ceiling_above_ground else above.ceiling_m
        floor_m, ceiling_m = np.maximum(floor_m, above.safe_above_m), np.minimum(ceiling_m, top_m)
    # unknown ground may be of any height
    floor_m[np.isnan(floor_m)], ceiling_m[np.isnan(ceiling_m)] = np.inf, -np.inf
    highest = np.maximum.reduce([floor_m[:-1, :-1], floor_m[1:, :-1], floor_m[:-1, 1:], floor_m[1:, 1:]])
    lowest = np.minimum.reduce([ceiling_m[:-1, :-1], ceiling_m[1:, :-1], ceiling_m[:-1, 1:], ceiling_m[1:, 1:]])
    shut = highest > lowest
    if problem.keep_in:
        shut |= squares_touched(grid, outside_of(grid, problem.keep_in), 0.0)
    highest[shut], lowest[shut] = np.inf, -np.inf
    return Air(highest, lowest, Cells.of(grid), problem.climb_weight)


def _swollen(grid: ElevationGrid, heights_m: Floats, bubble_m: float) -> Floats:
    """Lowest altitude over each post that no sphere of that radius around any ground reaches; NaN near unknown ground.

    Ground between posts is no higher than the highest post of its square, and no nearer than a cell further in.
    """
    if bubble_m == 0.0:
        return heights_m
    down, across = math.ceil(bubble_m / grid.cell_north_m) + 1, math.ceil(bubble_m / grid.cell_east_m) + 1
    north_m = np.maximum(np.abs(np.arange(-down, down + 1)) - 1, 0)[:, None] * grid.cell_north_m
    east_m = np.maximum(np.abs(np.arange(-across, across + 1)) - 1, 0) * grid.cell_east_m
    cap_m = np.sqrt(np.maximum(bubble_m**2 - north_m**2 - east_m**2, 0.0))
    within = north_m**2 + east_m**2 <= bubble_m**2
    unknown = scipy.ndimage.binary_dilation(np.isnan(heights_m), within)
    filled = np.where(np.isnan(heights_m), -np.inf, heights_m)
    swollen: Floats = scipy.ndimage.grey_dilation(filled, footprint=within, structure=cap_m, mode="nearest")
    swollen[unknown] = np.nan
    return swollen


def _place_in(problem: FlightProblem, air: Air, name: str) -> tuple[float, float, float]:
    east_m, north_m, altitude_m = getattr(problem, name)
    if not problem.grid.contains(east_m, north_m):
        raise PlaceError(f"The {name} lies outside the DEM.", name, ("outside the DEM",), None)
    place = (*problem.grid.post_at(east_m, north_m), float(altitude_m))
    if not math.isfinite(flight_cost(air, place, place)):
        floor_m = _floor_at(air, place)
        if math.isinf(floor_m):
            raise _over_shut_air(problem, air, name, place)
        top_m = float(air.ceiling_m[_square(air, place)])
        below = f"below the floor; it may be there from {floor_m:.1f} m up"
        what = below if altitude_m < floor_m else f"above the ceiling; it may be there up to {top_m:.1f} m"
        reasons = (Reason.BUBBLE if problem.above is None else Reason.MORPHING_MAP,)
        raise PlaceError(f"The {name} at {altitude_m:.1f} m is {what}.", name, reasons, (east_m, north_m))
    return place


def _over_shut_air(problem: FlightProblem, air: Air, name: str, place: Point) -> PlaceError:
    """Between floor and ceiling nothing is left there; tells where the nearest air is that may be flown."""
    floor_m, ceiling_m, (cell_east_m, cell_north_m), _ = air
    rows, cols = np.nonzero(np.isfinite(floor_m))
    if len(rows) == 0:
        return PlaceError("No air on the map may be flown.", name, (Reason.MORPHING_MAP,), None)
    away_m = np.hypot((rows + 0.5 - place[0]) * cell_north_m, (cols + 0.5 - place[1]) * cell_east_m)
    row, col = int(rows[away_m.argmin()]), int(cols[away_m.argmin()])
    east_m, north_m = problem.grid.position_of(row + 0.5, col + 0.5)
    sentence = (
        f"The {name} is over air that may not be flown, at no altitude; the nearest that may is over "
        f"{told_place(problem.grid, east_m, north_m, 0.1)}, from {floor_m[row, col]:.1f} to "
        f"{ceiling_m[row, col]:.1f} m."
    )
    return PlaceError(sentence, name, (Reason.MORPHING_MAP,), (east_m, north_m))


def _floor_at(air: Air, place: Point | list[float]) -> float:
    return float(air.floor_m[_square(air, place)])


def _square(air: Air, place: Point | list[float]) -> tuple[int, int]:
    """The square of a place; on the last line of posts the one before it."""
    return int(min(place[0], air.floor_m.shape[0] - 1)), int(min(place[1], air.floor_m.shape[1] - 1))


def _over_the_squares(air: Air, begin: Point, end: Point) -> Floats | None:
    """A flight from square to square as low as it may be; None where it is shut by the worst of each."""
    floor_m, cols = air.floor_m, air.floor_m.shape[1]
    nodes = [
        np.array([min(int(at[0]), floor_m.shape[0] - 1) * cols + min(int(at[1]), cols - 1)], np.int64)
        for at in (begin, end)
    ]
    worst, way = least_worst_way(floor_m, *nodes)
    if not math.isfinite(worst):
        return None
    level_m = max(float(worst), begin[2], end[2])
    rows, columns = np.divmod(way, cols)
    highest = np.minimum.reduce(air.ceiling_m[rows, columns])
    if level_m <= highest:
        middle = np.column_stack([rows + 0.5, columns + 0.5, np.full(len(way), level_m)])
        up = [(begin[0], begin[1], level_m), (end[0], end[1], level_m)]
        return np.concatenate([[begin, up[0]], middle, [up[1], end]])
    return _hugging(air, begin, end, rows, columns)


def _hugging(air: Air, begin: Point, end: Point, rows: npt.NDArray[np.int64], cols: npt.NDArray[np.int64]) -> Floats:
    """The same where a ceiling follows the ground: over each line between squares as low as both allow."""
    floor_m = air.floor_m
    places: list[Point] = [begin]
    for (r0, c0), (r1, c1) in zip(
        zip(rows[:-1], cols[:-1], strict=True), zip(rows[1:], cols[1:], strict=True), strict=True
    ):
        around = floor_m[min(r0, r1) : max(r0, r1) + 1, min(c0, c1) : max(c0, c1) + 1]
        places.append(((r0 + r1 + 1) / 2.0, (c0 + c1 + 1) / 2.0, float(around.max())))
    return np.array([*places, end])


def _metres(grid: ElevationGrid, places: Floats) -> Floats:
    east_m = grid.origin_east_m + places[:, 1] * grid.cell_east_m
    north_m = grid.origin_north_m - places[:, 0] * grid.cell_north_m
    return np.column_stack([east_m, north_m, places[:, 2]])


def _places_of(states: list[State]) -> Floats:
    return np.array([[state[0], state[1], state[2]] for state in states])


@dataclass(frozen=True, eq=False, slots=True)
class FlightTask:
    """Find a flight through the air from a place to a place, (row, col, altitude)."""

    air: Air
    begin: Point
    end: Point
    iterations: int
    seed: int

    def solve(self, tell: Tell) -> Floats | None:
        """Corners (n, 3); the cheaper of RRTConnect's first flight and what BIT* makes of the rest of the budget."""

        def told(states: list[State]) -> None:
            places = _places_of(states)
            cost = pull_flight(self.air, places)[0]
            if cost < min(costs, default=math.inf):
                costs.append(cost)
                tell(places)

        floor_m, ceiling_m = self.air.floor_m, self.air.ceiling_m
        open_m = floor_m[np.isfinite(floor_m)]
        top_m = min(float(ceiling_m.max()), max(float(open_m.max()), self.begin[2], self.end[2]) + 1.0)
        low_m = min(float(open_m.min()), self.begin[2], self.end[2])
        space = box_space(((0.0, floor_m.shape[0]), (0.0, floor_m.shape[1]), (low_m, top_m)))
        found, costs = [], list[float]()
        for planner, share in (("RRTConnect", 0.25), ("BITstar", 0.75)):
            states = solved(space, self, planner, self.begin, self.end, int(share * self.iterations), told)
            if states is not None:
                found.append(_places_of(states))
                told(states)
        return min(found, key=lambda places: pull_flight(self.air, places)[0]) if found else None

    def allowed(self, state: State) -> bool:
        """Whether the air at a state may be flown."""
        place = (state[0], state[1], state[2])
        return math.isfinite(flight_cost(self.air, place, place))

    def cost(self, begin: State, end: State) -> float:
        """Of the straight flight between two states."""
        return float(flight_cost(self.air, (begin[0], begin[1], begin[2]), (end[0], end[1], end[2])))
