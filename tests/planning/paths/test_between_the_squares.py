"""Ways between the squares of the field, and the proof that there is none: what is in doubt is split until it shows."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from benchmarks.planning.unreachables import close_problems, finer, refuted
from dem_samples import load_sample
from planning.paths import PathOutcome, PathProblem, PathStatus, PlanBudget, Reason, RoverModel, plan_path
from planning.paths.closer_look import MOST_WITHOUT_PROOF, CloserLook
from planning.paths.leaves import Graph, Leaves
from planning.validation import validate_path
from terrain import ElevationGrid, height_at

GRID_ALONE = PlanBudget(sampling=False)
START, GOAL = (103.0, -897.0), (897.0, -103.0)


def split_leaves() -> Leaves:
    """Triangles of 12 squares, some of them split, and some of those again."""
    leaves = Leaves.whole((3, 4))
    chosen = np.isin(np.arange(len(leaves)), [5, 6, 12])
    leaves = leaves.some(~chosen).and_those(leaves.some(chosen).split())
    again = np.arange(len(leaves)) >= len(leaves) - 7
    return leaves.some(~again).and_those(leaves.some(again).split())


def test_leaves_cover_the_ground_and_touch_where_their_shapes_do() -> None:
    leaves = split_leaves()
    shapes = shapely.polygons(leaves.corners)
    assert shapely.area(shapes).sum() == 12.0
    touching = {
        (a, b)
        for b in range(len(leaves))
        for a in range(b)
        if shapely.length(shapely.intersection(shapes[a], shapes[b])) > 0.0
    }
    assert {tuple(sorted(pair)) for pair in leaves.sides().tolist()} == touching


def test_a_leaf_is_part_of_the_triangle_that_its_middle_lies_in() -> None:
    leaves = split_leaves()
    row, col, half = leaves.triangle
    down, across = leaves.middles[:, 0] - row, leaves.middles[:, 1] - col
    assert ((down > 0.0) & (down < 1.0) & (across > 0.0) & (across < 1.0)).all()
    np.testing.assert_array_equal(half, (across > down).astype(int))


def test_the_cheapest_way_by_its_worst_edge_is_the_one_that_the_last_edge_joins() -> None:
    random = np.random.default_rng(3)
    graph = Graph(100, Leaves.whole((5, 10)).sides())
    costs = random.uniform(size=len(graph.edges))
    worst, nodes = graph.cheapest(costs, np.array([0]), np.array([99]), by_worst=True)
    for limit, joined in ((worst, True), (worst - 1e-12, False)):
        parts = Graph(100, graph.edges[costs <= limit]).labels()
        assert (parts[0] == parts[99]) is np.bool_(joined)
    assert (nodes[0], nodes[-1]) == (0, 99)


def fence(gate_m: float, aside_m: float) -> tuple[shapely.Polygon, ...]:
    """A fence of a metre across the map, with a gate at its middle."""
    west_m, middle_m = 499.0 + aside_m, -500.0 + aside_m
    return (
        shapely.box(west_m, -1100.0, west_m + 1.0, middle_m - gate_m / 2),
        shapely.box(west_m, middle_m + gate_m / 2, west_m + 1.0, 100.0),
    )


def through(gate_m: float, aside_m: float = 0.0) -> PathOutcome:
    """On level ground of 10 m cells, by a rover a metre wide."""
    grid = ElevationGrid(np.zeros((101, 101), np.float32), 10.0, 10.0)
    return plan_path(PathProblem(grid, START, GOAL, no_go=fence(gate_m, aside_m), budget=GRID_ALONE))


@pytest.mark.parametrize("aside_m", [0.0, 3.0, 5.0])
@pytest.mark.parametrize("gate_m", [18.0, 5.0, 1.2])
def test_a_gate_that_the_rover_fits_through_is_found_wherever_the_posts_fall(gate_m: float, aside_m: float) -> None:
    outcome = through(gate_m, aside_m)
    assert outcome.status is PathStatus.FOUND
    assert outcome.path is not None
    # straight it would be 1123 m
    assert outcome.path.totals.length_m < 1160.0
    assert validate_path(
        PathProblem(
            ElevationGrid(np.zeros((101, 101), np.float32), 10.0, 10.0), START, GOAL, no_go=fence(gate_m, aside_m)
        ),
        np.column_stack([outcome.path.east_m, outcome.path.north_m]),
        step_m=0.05,
    ).passed


@pytest.mark.parametrize("gate_m", [0.0, 0.5, 0.99])
def test_a_gate_narrower_than_the_rover_stays_shut_and_that_is_proved_without_a_grain(gate_m: float) -> None:
    outcome = through(gate_m)
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.reason is Reason.NO_GO
    assert outcome.unreachable.grain is not None
    assert outcome.unreachable.grain.width_m < 0.03


def test_where_the_rover_has_hardly_any_room_the_sentence_tells_how_little_was_looked_for() -> None:
    outcome = through(1.002)
    assert outcome.status is PathStatus.UNREACHABLE
    assert outcome.unreachable is not None
    assert outcome.unreachable.grain is not None
    # a way with 1 mm to spare on either side is narrower than that
    assert 0.002 < outcome.unreachable.grain.width_m < 0.03
    assert outcome.sentence.startswith("There is no way with 0.014 m or more to spare on either side: ")


def test_a_slope_told_to_suffice_does_and_what_is_less_than_the_least_does_not() -> None:
    valley = load_sample("valley")
    heights_m = valley.heights_m[60:110, 60:110].copy()
    heights_m[:, 25] += 40.0
    ridge = ElevationGrid(heights_m, valley.cell_east_m, valley.cell_north_m)
    start, goal = ridge.position_of(25.3, 5.3), ridge.position_of(25.3, 44.3)
    cut = plan_path(PathProblem(ridge, start, goal, rover=RoverModel(max_slope_rad=0.6), budget=GRID_ALONE))
    assert cut.status is PathStatus.UNREACHABLE
    assert cut.unreachable is not None
    slope = cut.unreachable.relaxations[0]
    assert (slope.reason, slope.shown) == (Reason.SLOPE, True)
    assert slope.least <= slope.needed <= slope.least + math.radians(0.011)
    for limit_rad, status in (
        (slope.needed, PathStatus.FOUND),
        (slope.least - math.radians(0.01), PathStatus.UNREACHABLE),
    ):
        eased = PathProblem(ridge, start, goal, rover=RoverModel(max_slope_rad=limit_rad), budget=GRID_ALONE)
        assert plan_path(eased).status is status


def test_a_start_beside_an_area_is_judged_by_its_own_distance_and_not_by_its_squares() -> None:
    grid = ElevationGrid(np.zeros((40, 60), np.float32), 5.0, 5.0)
    area = shapely.box(22.0, -200.0, 30.0, -90.0)
    asked = PathProblem(grid, (21.0, -98.0), (281.0, -97.0), no_go=(area,), budget=GRID_ALONE)
    outcome = plan_path(asked)
    assert outcome.status is PathStatus.FOUND
    assert outcome.validation is not None
    assert outcome.validation.passed


def test_finer_posts_make_the_same_surface() -> None:
    grid = load_sample("jacksboro")
    part = ElevationGrid(grid.heights_m[:20, :30].copy(), grid.cell_east_m, grid.cell_north_m)
    close = finer(part)
    random = np.random.default_rng(1)
    east_m = random.uniform(0.0, 29 * part.cell_east_m, 500)
    north_m = random.uniform(-19 * part.cell_north_m, 0.0, 500)
    apart_m = height_at(part, east_m, north_m) - height_at(close, east_m, north_m)
    assert 0 < np.isnan(apart_m).sum() < 300
    np.testing.assert_allclose(apart_m[~np.isnan(apart_m)], float(np.nanmean(part.heights_m)), atol=1e-4)


def test_no_proof_is_refuted_by_squares_four_times_as_fine() -> None:
    proved = 0
    for problem in close_problems(load_sample("jacksboro"), 15, 40, seed=5):
        if plan_path(problem).status is PathStatus.UNREACHABLE:
            proved += 1
            assert not refuted(problem)
    assert proved > 2


def test_where_only_headings_are_in_doubt_the_search_ends_undecided_and_soon(monkeypatch: pytest.MonkeyPatch) -> None:
    # a plane too steep to roll on and too steep to climb, but not for some heading between
    plane_m = np.tile(np.arange(61, dtype=np.float32) * 3.0, (61, 1))
    grid = ElevationGrid(plane_m, 10.0, 10.0)
    rover = RoverModel(max_slope_rad=0.5, max_pitch_rad=math.atan(0.2155), max_roll_rad=math.atan(0.2155))
    begun: list[int] = []
    split = CloserLook._split
    monkeypatch.setattr(CloserLook, "_split", lambda look, chosen: (begun.append(len(chosen)), split(look, chosen))[1])
    outcome = plan_path(PathProblem(grid, (53.0, -303.0), (553.0, -297.0), rover=rover, budget=GRID_ALONE))
    assert outcome.status is PathStatus.UNDECIDED
    assert "cannot be decided by searching more finely" in outcome.sentence
    assert len(begun) <= MOST_WITHOUT_PROOF
