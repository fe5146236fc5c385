"""The sampling planner in its own process: cheaper, within every limit, the same twice, and gone when it is stopped."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest

from planning import PlanningProcessError
from planning.paths import PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from planning.paths.corridors import Corridor, CorridorTask, cost_of, grid_way
from planning.paths.ends import ends_of
from planning.paths.fields import cost_field
from planning.paths.places import Cells
from planning.paths.sampling import OwnProcess
from terrain.synthetic import fractal


def hilly_problem(seed: int = 0, **changes: object) -> PathProblem:
    grid = fractal(96, 5, relief_m=250.0, cell_m=30.0)
    rover = RoverModel(max_slope_rad=math.radians(60.0))
    west_m, south_m, east_m, north_m = grid.bounds_m
    given = {"rover": rover, "seed": seed, "budget": PlanBudget(iterations=15_000)} | changes
    return PathProblem(grid, (west_m + 311.0, south_m + 287.0), (east_m - 407.0, north_m - 333.0), **given)


def test_the_path_is_the_same_twice_and_no_dearer_than_the_grids() -> None:
    first, second = plan_path(hilly_problem()), plan_path(hilly_problem())
    assert first.status is PathStatus.FOUND
    assert first.stopped_by == "count"
    assert first.path is not None
    assert second.path is not None
    np.testing.assert_array_equal(first.path.east_m, second.path.east_m)
    np.testing.assert_array_equal(first.path.north_m, second.path.north_m)
    assert first.ratio <= 1.0
    grid_alone = plan_path(hilly_problem(budget=PlanBudget(sampling=False)))
    assert grid_alone.path is not None
    assert grid_alone.path.cost >= first.path.cost
    assert grid_alone.ratio == pytest.approx(1.0)


@pytest.fixture(scope="module")
def grids_cost() -> float:
    path = plan_path(hilly_problem(budget=PlanBudget(sampling=False))).path
    assert path is not None
    return path.cost


def test_a_plan_that_is_stopped_answers_with_the_best_that_was_told_until_then(
    grids_cost: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[OwnProcess] = []

    class Watched(OwnProcess):
        def __init__(self) -> None:
            super().__init__()
            begun.append(self)

    monkeypatch.setattr("planning.paths.planning.OwnProcess", Watched)
    endless = hilly_problem(budget=PlanBudget(iterations=100_000_000))
    outcome = plan_path(endless, stop=lambda: begun[0].best is not None)
    assert (outcome.status, outcome.stopped_by) == (PathStatus.FOUND, "stop")
    assert outcome.planner.startswith("BIT*")
    assert outcome.path is not None
    assert outcome.path.cost < grids_cost
    assert outcome.validation is not None
    assert outcome.validation.passed


def test_a_plan_that_is_stopped_before_it_samples_answers_with_the_grids_way(grids_cost: float) -> None:
    outcome = plan_path(hilly_problem(budget=PlanBudget(iterations=100_000_000)), stop=lambda: True)
    assert (outcome.status, outcome.stopped_by, outcome.planner) == (PathStatus.FOUND, "stop", "any-angle grid")
    assert outcome.path is not None
    assert outcome.path.cost >= grids_cost
    assert outcome.validation is not None
    assert outcome.validation.passed


def test_when_its_time_is_up_the_plan_answers_with_a_path_no_dearer_than_the_grids(grids_cost: float) -> None:
    outcome = plan_path(hilly_problem(budget=PlanBudget(iterations=100_000_000, seconds=5.0)))
    assert (outcome.status, outcome.stopped_by) == (PathStatus.FOUND, "time")
    assert outcome.path is not None
    assert outcome.path.cost <= grids_cost
    assert outcome.validation is not None
    assert outcome.validation.passed


def test_what_a_task_tells_is_whole_and_ever_cheaper_than_the_way_it_began_with() -> None:
    problem = hilly_problem()
    field = cost_field(problem, None)
    ends = ends_of(problem, field)
    way, _ = grid_way(field.for_kernels(), ends)
    assert way is not None
    told: list[np.ndarray] = []
    solved = CorridorTask(field.for_kernels(), way.places, (), 0.5, 6_000, 1).solve(told.append)
    assert solved is not None
    costs = [cost_of(field.for_kernels(), places) for places in told]
    assert len(costs) > 3
    assert max(costs) < way.cost
    assert all((places[0] == way.places[0]).all() and (places[-1] == way.places[-1]).all() for places in told)
    assert costs[-1] == cost_of(field.for_kernels(), solved)


def test_a_process_is_gone_when_its_context_is_left() -> None:
    with OwnProcess() as own:
        pid = own.pid
        os.kill(pid, 0)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_process_that_dies_is_told_as_an_error() -> None:
    class Poison:
        seed = 1

        def __reduce__(self) -> object:
            return os._exit, (3,)

    with OwnProcess() as own:
        own.begin(Poison())
        with pytest.raises(PlanningProcessError, match="exit code 3"):
            own.answer(lambda: False)


def test_places_of_a_corridor_are_those_of_the_way_and_beside_it() -> None:
    way = np.array([[10.5, 2.25], [10.5, 12.25]])
    corridor = Corridor(way, Cells(30.0, 20.0))
    assert corridor.length_m == pytest.approx(300.0)
    assert corridor.place(0.0, 0.0) == (10.5, 2.25)
    assert corridor.place(300.0, 0.0) == (10.5, 12.25)
    # to the right of east is south: further rows
    assert corridor.place(150.0, 40.0) == pytest.approx((12.5, 7.25))
