"""Other ways: they differ, keep every limit, and are worth what is said of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from planning import PathProblemError
from planning.alternatives import alternatives_to
from planning.paths import CostWeights, Path, PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from planning.validation import validate_path
from terrain import ElevationGrid
from visibility import Anchor

CELL_M = 5.0
ROVER = RoverModel(max_slope_rad=math.radians(30.0))
GRID_ALONE = PlanBudget(sampling=False)
START, GOAL = (12.0, -101.0), (287.0, -101.0)


def wall_with_gates() -> ElevationGrid:
    """Level ground, and across the middle a wall with three gates: north, straight ahead, south."""
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[:, 30] = 10.0
    for row in (4, 19, 34):
        heights_m[row : row + 4, 30] = 0.0
    return ElevationGrid(heights_m, CELL_M, CELL_M)


def asked(grid: ElevationGrid, **changes: object) -> PathProblem:
    given = {"start": START, "goals": GOAL, "rover": ROVER, "budget": GRID_ALONE} | changes
    return PathProblem(grid, **given)


def line(path: Path) -> shapely.LineString:
    return shapely.LineString(np.column_stack([path.east_m, path.north_m]))


def gate_of(path: Path) -> int:
    """Which gate of the wall a path takes: 0 north, 1 ahead, 2 south."""
    at = shapely.intersection(line(path), shapely.LineString([(150.0, 0.0), (150.0, -195.0)]))
    return round((-at.centroid.y / CELL_M - 5.5) / 15.0)


def test_a_wall_with_three_gates_has_three_ways() -> None:
    problem = asked(wall_with_gates())
    first = plan_path(problem)
    assert first.status is PathStatus.FOUND
    assert first.path is not None
    others = alternatives_to(problem, first, 2)
    assert [gate_of(first.path), *sorted(gate_of(one.path) for one in others.paths)] == [1, 0, 2]
    assert others.sentence == "2 other ways that differ enough."
    ways = [line(first.path), *(line(one.path) for one in others.paths)]
    for number, one in enumerate(others.paths, 1):
        elsewhere = ways[number].difference(shapely.union_all(ways[:number]).buffer(others.apart_m))
        assert elsewhere.length / ways[number].length == pytest.approx(one.apart, abs=0.05)
        assert elsewhere.length / ways[number].length >= 0.25
        assert validate_path(problem, np.column_stack([one.path.east_m, one.path.north_m])).passed
        assert one.path.totals.length_m > first.path.totals.length_m


def test_the_way_that_is_after_sight_leaves_the_shadow_of_a_ridge() -> None:
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[25, 8:52] = 10.0
    grid = ElevationGrid(heights_m, CELL_M, CELL_M)
    anchors = tuple(Anchor(f"A{n}", 110.0 + 40.0 * n, -190.0, 4.0) for n in range(3))
    problem = asked(grid, anchors=anchors, weights=CostWeights(out_of_sight=0.0))
    first = plan_path(problem)
    assert first.path is not None
    sighted = alternatives_to(problem, first, 1).paths[0]
    there, here = first.path.totals, sighted.path.totals
    assert sighted.what == "in sight"
    # the path runs behind the ridge nearly all the way; the other passes before it
    assert there.out_of_sight_s > 150.0
    assert here.out_of_sight_s < 0.5 * there.out_of_sight_s
    assert sighted.path.north_m.min() < -125.0
    assert f"({(here.out_of_sight_s - there.out_of_sight_s) / 60.0:+.0f} min)" in sighted.sentence
    assert f"({here.length_m / there.length_m - 1.0:+.0%})" in sighted.sentence


def test_fewer_ways_than_asked_for_and_why() -> None:
    heights_m = np.zeros((7, 60), np.float32)
    grid = ElevationGrid(heights_m, CELL_M, CELL_M)
    problem = asked(grid, start=(12.0, -15.0), goals=(287.0, -15.0))
    found = alternatives_to(problem, plan_path(problem), 3)
    assert (found.paths, found.ended) == ((), False)
    assert found.sentence == "0 other ways: no more were found that differ enough."
    stopped = alternatives_to(problem, plan_path(problem), 3, stop=lambda: True)
    assert (stopped.paths, stopped.ended) == ((), True)


def test_what_has_no_alternatives_is_told() -> None:
    heights_m = np.zeros((40, 60), np.float32)
    heights_m[:, 30] = 10.0
    closed = asked(ElevationGrid(heights_m, CELL_M, CELL_M))
    outcome = plan_path(closed)
    assert alternatives_to(closed, outcome, 2).sentence == "Without a path there are no alternatives to it."
    for count in (0, 9):
        with pytest.raises(PathProblemError, match="1 to 8 ways"):
            alternatives_to(closed, outcome, count)
    turning = asked(wall_with_gates(), rover=RoverModel(min_turning_radius_m=3.0))
    with pytest.raises(PathProblemError, match="turns on the spot"):
        alternatives_to(turning, outcome, 2)
