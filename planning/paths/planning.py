"""From a problem to an outcome: maps, field, proof on the grid, planners, and the check of what comes out."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from planning.errors import NoCoverageError, PlaceError
from planning.questions.problems import PathProblem
from planning.validation import PathValidation, validate_path

from .checks import without_broken_squares, without_refused_squares
from .corridors import EIGHT, SIXTEEN, CorridorTask, Way, cost_of, grid_way, straightened
from .describing import Endings, described
from .ends import Ends, arrivals_along, ends_of, fastest_arrivals_s
from .fields import CostField, cost_field
from .looking_closer import look_closer
from .outcomes import Grain, Path, PathOutcome, PathStatus, Reason
from .proof import closed_in, proof_of
from .sampling import OwnProcess
from .sight_maps import SightMaps, sight_maps
from .turning import TurningTask

__all__ = ["plan_path"]

Stop = Callable[[], bool]
Places = npt.NDArray[np.float64]

# a path that exact sight lines refuse somewhere is planned again without those squares, at most so often
MOST_REPAIRS = 40
# with moving anchors, times of arrival and the path that they come of are found in turn, so often
ARRIVAL_ROUNDS = 3
# the same for one that is driven with a turning radius
TURNING_REPAIRS = 4
# how much more the very first way may cost than the cheapest, for being found sooner
GREED = 3.0
# half the width of the corridor in which the sampling planner looks for a cheaper way, in cells
CORRIDOR = 0.5
# what the validator forgives of a slope
SLOPE_GRAIN_RAD = 1e-6


def plan_path(
    problem: PathProblem,
    *,
    progress: Callable[[float], None] | None = None,
    stop: Stop | None = None,
) -> PathOutcome:
    """Plan a path that keeps every limit at every point, as cheap as the budget allows.

    progress: called with the finished share 0..1. stop: asked again and again; once it says True the plan ends, as when
    its time is up, with the best path that was found and passes the validator. Raises PathProblemError, AreaError,
    PlaceError, NoCoverageError, PlanningProcessError, AnchorError.
    """
    with contextlib.ExitStack() as processes:
        # loads while maps and grid are worked at
        turns = problem.rover.min_turning_radius_m > 0.0
        own = processes.enter_context(OwnProcess()) if problem.budget.sampling and not turns else None
        begin_s = time.perf_counter()
        plan = _Plan(problem, own, progress or _nobody, stop or (lambda: False), sight_maps(problem), begin_s)
        return plan.outcome()


class _Plan(Endings):
    """One run of ``plan_path``: what is known so far."""

    def __init__(
        self,
        problem: PathProblem,
        own: OwnProcess | None,
        told: Callable[[float], None],
        stop: Stop,
        maps: SightMaps | None,
        begin_s: float,
        *,
        explains: bool = True,
    ) -> None:
        super().__init__(problem, told, stop, begin_s)
        self.own, self.maps, self.explains = own, maps, explains

    def outcome(self) -> PathOutcome:
        """The whole way from maps to answer."""
        problem, maps = self.problem, self.maps
        self.told(0.3)
        field = cost_field(problem, maps)
        self.ready_s = time.perf_counter()
        if problem.moves:
            field = self._at_arrival(field, maps)
        self.warnings = maps.warnings if maps is not None else ()
        for _ in range(MOST_REPAIRS):
            self.field = field
            try:
                ends = ends_of(problem, field, maps)
            except PlaceError as fault:
                # the place itself has the sight that is asked for, and no way from it or to it that was tried
                if fault.reasons != (Reason.SIGHT_LINE,):
                    raise
                return self.undecided(closed_in(problem, fault.place), "exact sight lines refused what was tried")
            way, leg = self._grid_way(field, ends)
            if way is None:
                return self._closer(field, maps, ends, leg)
            if problem.rover.min_turning_radius_m > 0.0:
                return self._turning(field, maps, ends, way)
            repaired = without_broken_squares(problem, field, maps, way.places)
            if repaired is None:
                self.told(0.6)
                path, validation = self._judged(field, maps, way)
                repaired = without_refused_squares(field, validation)
                if validation.passed:
                    return self._improved(field, maps, ends, way, (path, validation))
            if repaired is None:
                return self.refused(validation)
            if self.ended():
                return self.out_of_budget("The plan was ended before it had a path that keeps every limit.")
            field = repaired
        return self.out_of_budget(
            f"Sight lines or bubble refused {MOST_REPAIRS} paths in a row; give limits on positioning more room."
        )

    def _at_arrival(self, field: CostField, maps: SightMaps | None) -> CostField:
        """The field that the rover meets: each square at the time at which a path to the goal passes by."""
        fastest_s = fastest_arrivals_s(self.problem, field)
        arrival_s = fastest_s
        for _ in range(ARRIVAL_ROUNDS):
            field = cost_field(self.problem, maps, arrival_s)
            way, _ = grid_way(field.for_kernels(), ends_of(self.problem, field), EIGHT)
            if way is None:
                break
            arrival_s = arrivals_along(field, fastest_s, way.places)
        return field

    def _grid_way(self, field: CostField, ends: tuple[Ends, ...]) -> tuple[Way | None, int]:
        """The grid's cheapest way at any angle; some way is known long before it."""
        kernel_field = field.for_kernels()
        if math.isnan(self.first_path_s):
            first, _ = grid_way(kernel_field, ends, EIGHT, GREED)
            if first is not None:
                self.first_path_s = time.perf_counter() - self.ready_s
        way, leg = grid_way(kernel_field, ends, SIXTEEN)
        return (None if way is None else straightened(kernel_field, way, _fixed(ends), stop=self.ended)), leg

    def _judged(self, field: CostField, maps: SightMaps | None, way: Way) -> tuple[Path, PathValidation]:
        """The path over a way, and what the validator says of it."""

        path = described(self.problem, field, maps, way.places)
        return path, validate_path(self.problem, np.column_stack([path.east_m, path.north_m]))

    def _improved(
        self,
        field: CostField,
        maps: SightMaps | None,
        ends: tuple[Ends, ...],
        way: Way,
        judged: tuple[Path, PathValidation],
    ) -> PathOutcome:
        """The grid's way, or the cheaper one that the sampling planner found in the corridor around it."""
        problem, kernel_field, planner, completed = self.problem, field.for_kernels(), "any-angle grid", True
        if self.own is not None:
            half_m, iterations = CORRIDOR * max(kernel_field.cells), problem.budget.iterations
            self.own.begin(CorridorTask(kernel_field, way.places, _fixed(ends), half_m, iterations, problem.seed))
            completed, places = self.own.answer(self.ended)
            sampled = None if places is None else Way(places, cost_of(kernel_field, places))
            if sampled is not None and not completed:
                # what was told on the way was not pulled straight yet
                sampled = straightened(kernel_field, sampled, _fixed(ends), rounds=1)
            if (
                sampled is not None
                and sampled.cost < way.cost
                and without_broken_squares(problem, field, maps, sampled.places) is None
            ):
                also_judged = self._judged(field, maps, sampled)
                if also_judged[1].passed:
                    judged, planner = also_judged, "BIT* in the corridor of the any-angle grid"
        return self.found(*judged, way.cost, planner, completed)

    def _turning(self, field: CostField, maps: SightMaps | None, ends: tuple[Ends, ...], way: Way) -> PathOutcome:
        """The way as it can be driven with the rover's turning radius."""
        problem, rover, kernel_field = self.problem, self.problem.rover, field.for_kernels()
        for _ in range(TURNING_REPAIRS):
            task = TurningTask(
                kernel_field,
                way.places,
                _fixed(ends),
                rover.min_turning_radius_m,
                rover.can_reverse,
                problem.start_heading_rad,
                problem.budget.iterations,
                problem.seed,
            )
            with OwnProcess() as own:
                own.begin(task)
                completed, places = own.answer(self.ended)
            if places is None and not completed:
                return self.out_of_budget(
                    f"There is a way, but the time was over before one with a turning radius of "
                    f"{rover.min_turning_radius_m:g} m was found."
                )
            if places is None:
                otherwise = "" if rover.can_reverse else ", or let the rover reverse"
                return self.out_of_budget(
                    f"There is a way, but none with a turning radius of {rover.min_turning_radius_m:g} m was found in "
                    f"{problem.budget.iterations} iterations; give more{otherwise}."
                )
            repaired = without_broken_squares(problem, field, maps, places)
            if repaired is None:
                driven = Way(places, cost_of(kernel_field, places))
                path, validation = self._judged(field, maps, driven)
                if not validation.passed:
                    return self.refused(validation)
                planner = "BIT* over Reeds-Shepp curves" if rover.can_reverse else "BIT* over Dubins curves"
                return self.found(path, validation, way.cost, planner, completed)
            field, kernel_field = repaired, repaired.for_kernels()
        return self.out_of_budget("Sight lines refused every path with that turning radius.")

    def _closer(self, field: CostField, maps: SightMaps | None, ends: tuple[Ends, ...], leg: int) -> PathOutcome:
        """The squares hold no way: one between them, the proof that there is none, or neither."""
        problem, closer = self.problem, look_closer(self.problem, field, maps, self.ended)
        if closer.found is not None:
            if problem.rover.min_turning_radius_m == 0.0:
                return self.found(*closer.found, math.nan, "triangles of the ground", True)
            return self.out_of_budget(
                f"There is a way, but only through gaps that are narrower than two squares, and none with a turning "
                f"radius of {problem.rover.min_turning_radius_m:g} m was looked for there."
            )
        if self.ended():
            return self.out_of_budget("The plan was ended before it had a path or the proof that there is none.")
        if not self.explains:
            return self.answer(PathStatus.UNREACHABLE if closer.cut else PathStatus.UNDECIDED, "", "none", "proof")
        cut = proof_of(problem, field, ends, leg if closer.leg < 0 else closer.leg, self._shows)
        if not closer.cut:
            return self.undecided(cut, closer.why)
        return self.unreachable(replace(cut, grain=Grain(closer.grain_m, SLOPE_GRAIN_RAD)))

    def _shows(self, problem: PathProblem) -> bool | None:
        """Whether a path is found for a problem that was relaxed; None where that was not tried to its end."""
        if self.ended() or problem.rover.min_turning_radius_m > 0.0:
            return None
        try:
            plan = _Plan(problem, None, _nobody, self.stop, self.maps, self.begin_s, explains=False)
            status = plan.outcome().status
        except (PlaceError, NoCoverageError):
            return False
        return None if status is PathStatus.OUT_OF_BUDGET else status is PathStatus.FOUND


def _nobody(_: float) -> None:
    """Tells nobody of progress."""


def _fixed(ends: tuple[Ends, ...]) -> tuple[Places, ...]:
    """The way-points, which stay on the way."""
    return tuple(end.places[0] for end in ends[1:-1])
