"""Plans from wherever the rover is: the costs to the goal are those of closed forms, and the paths those of plans."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from planning import PathProblemError, PlaceError
from planning.alternatives import prepare_replanning
from planning.paths import CostWeights, PathLimits, PathProblem, PathStatus, PlanBudget, RoverModel, plan_path
from terrain import ElevationGrid
from tests.planning.placement.grounds import rough_grid
from visibility import Anchor
from visibility.sight import AnchorTrack

GRID_ALONE = PlanBudget(sampling=False)
CELL_M = 5.0


def middle(row: int, col: int) -> tuple[float, float]:
    """Of a square, metres."""
    return (col + 0.5) * CELL_M, -(row + 0.5) * CELL_M


def test_on_level_ground_every_square_costs_its_distance_over_eight_neighbours() -> None:
    grid = ElevationGrid(np.zeros((20, 31), np.float32), CELL_M, CELL_M)
    # an area, so that it is reached at the middle of its square and nowhere nearer
    goal = shapely.Point(middle(12, 20)).buffer(1.0)
    problem = PathProblem(grid, middle(3, 3), goal, rover=RoverModel(footprint_radius_m=0.0), budget=GRID_ALONE)
    found = prepare_replanning(problem).cost
    row, col = np.abs(np.arange(19) - 12)[:, None], np.abs(np.arange(30) - 20)[None, :]
    octile_m = CELL_M * (np.maximum(row, col) + (math.sqrt(2.0) - 1.0) * np.minimum(row, col))
    assert found == pytest.approx(octile_m, abs=1e-9)


def test_the_way_up_costs_what_is_climbed_and_the_way_down_does_not() -> None:
    slope = 0.2
    heights_m = np.tile(slope * CELL_M * np.arange(31, dtype=np.float32), (20, 1))
    problem = PathProblem(
        ElevationGrid(heights_m, CELL_M, CELL_M),
        *(middle(3, 3), middle(10, 15)),
        rover=RoverModel(footprint_radius_m=0.0),
        weights=CostWeights(length=1.0, climb=3.0),
        budget=GRID_ALONE,
    )
    cost = prepare_replanning(problem).cost
    flat_m = 10 * CELL_M
    assert cost[10, 5] == pytest.approx(flat_m * (math.hypot(1.0, slope) + 3.0 * slope), rel=1e-6)
    assert cost[10, 25] == pytest.approx(flat_m * math.hypot(1.0, slope), rel=1e-6)


def test_a_plan_from_elsewhere_is_as_good_as_one_made_anew() -> None:
    grid = rough_grid(100, seed=5)
    west_m, south_m, east_m, north_m = grid.bounds_m
    places = [(0.15, 0.2), (0.4, 0.7), (0.6, 0.3), (0.85, 0.85)]
    start, *others, goal = [(west_m + e * (east_m - west_m), south_m + n * (north_m - south_m)) for e, n in places]
    top_m = float(np.nanmax(grid.heights_m)) + 300.0
    anchors = tuple(Anchor(f"A{n}", *place, top_m + 40.0 * n) for n, place in enumerate([*others, start, goal]))
    problem = PathProblem(
        grid, start, goal, rover=RoverModel(max_slope_rad=1.2), limits=PathLimits(min_anchors=1), anchors=anchors,
        budget=GRID_ALONE,
    )  # fmt: skip
    prepared = prepare_replanning(problem)
    for place in (start, *others):
        again, anew = prepared.plan_from(place), plan_path(replace(problem, start=place))
        assert (again.status, anew.status) == (PathStatus.FOUND, PathStatus.FOUND)
        assert again.path is not None
        assert anew.path is not None
        assert again.validation is not None
        assert again.validation.passed
        assert (again.path.east_m[0], again.path.north_m[0]) == pytest.approx(place)
        assert again.path.cost <= 1.03 * anew.path.cost
        assert again.planner == "ways to the goals known before, pulled straight"


def test_what_the_known_costs_are_no_help_for_is_planned_anew_or_refused() -> None:
    heights_m = np.zeros((20, 31), np.float32)
    heights_m[:, 12] = 40.0
    problem = PathProblem(ElevationGrid(heights_m, CELL_M, CELL_M), middle(3, 20), middle(12, 25), budget=GRID_ALONE)
    prepared = prepare_replanning(problem)
    assert prepared.plan_from(middle(3, 3)).status is PathStatus.UNREACHABLE
    at_once = prepared.plan_from(middle(3, 3), anew=False)
    assert (at_once.status, at_once.path) == (PathStatus.OUT_OF_BUDGET, None)
    assert at_once.sentence == "The costs that are known lead to no path from there that passes; plan it anew."
    with pytest.raises(PlaceError, match="The start cannot be stood on: slope"):
        prepared.plan_from(middle(3, 12))
    with pytest.raises(PlaceError, match="The start lies outside the DEM"):
        prepared.plan_from((-50.0, 0.0))


def test_what_cannot_be_prepared_is_refused() -> None:
    grid = ElevationGrid(np.zeros((20, 31), np.float32), CELL_M, CELL_M)
    ends = (middle(3, 3), middle(12, 20))
    track = AnchorTrack("T", np.array([0.0, 9.0]), np.array([[9.0, -9.0, 50.0], [20.0, -9.0, 50.0]]))
    for problem in (
        PathProblem(grid, *ends, anchors=(track,)),
        PathProblem(grid, *ends, way_points=(middle(5, 5),)),
        PathProblem(grid, *ends, rover=RoverModel(min_turning_radius_m=2.0)),
    ):
        with pytest.raises(PathProblemError, match="Plans are prepared for anchors that stand"):
            prepare_replanning(problem)
