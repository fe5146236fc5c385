"""Fields, segments and ways over squares, against the plain way of doing it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planning.kernels.path_segments import CLEAR, segment_cost, step_cost
from planning.kernels.searches import least_worst_way
from planning.paths import CostWeights, PathProblem, PathStatus, RoverModel, plan_path
from planning.paths.corridors import EIGHT, SIXTEEN, grid_way, straightened
from planning.paths.ends import ends_of
from planning.paths.fields import CostField, cost_field
from terrain import ElevationGrid
from terrain.synthetic import fractal
from tests.reference import squares_dijkstra as reference

WEIGHTS = CostWeights(length=1.0, climb=3.0, out_of_sight=0.0)


def field_of(seed: int, posts: int = 24, slope_deg: float = 18.0, cells: tuple[float, float] = (30.0, 20.0)):
    rough = fractal(posts, seed, relief_m=150.0, cell_m=30.0)
    grid = ElevationGrid(rough.heights_m, *cells)
    rover = RoverModel(footprint_radius_m=0.0, max_slope_rad=math.radians(slope_deg))
    problem = PathProblem(grid, (0.0, 0.0), ((1.0, 1.0),), rover=rover, weights=WEIGHTS)
    return problem, cost_field(problem, None)


def allowed_squares(field: CostField) -> list[tuple[int, int]]:
    return list(zip(*(index.tolist() for index in np.nonzero(field.reasons == 0)), strict=True))


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 50), shares=st.tuples(*[st.floats(0.02, 0.98)] * 4))
def test_a_segment_costs_what_many_tiny_steps_cost(seed: int, shares: tuple[float, float, float, float]) -> None:
    _, field = field_of(seed, slope_deg=80.0)
    begin, end = (shares[0] * 22.9, shares[1] * 22.9), (shares[2] * 22.9, shares[3] * 22.9)
    if math.dist(begin, end) < 0.1:
        return
    code, cost = segment_cost(field.for_kernels(), *begin, *end)[:2]
    expected = reference.segment_cost(
        field.grid.heights_m, field.reasons == 0, (30.0, 20.0), (1.0, 3.0), begin, end, 3000
    )
    assert code == CLEAR
    assert cost == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("seed", range(4))
def test_a_step_between_middles_costs_what_its_segment_costs(seed: int) -> None:
    _, field = field_of(seed)
    kernel_field = field.for_kernels()
    for row, col in allowed_squares(field):
        for down, across in EIGHT.tolist():
            r, c = row + down, col + across
            if 0 <= r < 23 and 0 <= c < 23:
                expected = segment_cost(kernel_field, row + 0.5, col + 0.5, r + 0.5, c + 0.5)[1]
                assert step_cost(kernel_field, row, col, r, c) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_the_way_over_squares_is_as_cheap_as_that_of_plain_dijkstra(seed: int) -> None:
    problem, field = field_of(seed)
    squares = allowed_squares(field)
    start, goal = squares[3], squares[-4]
    east_north = [field.grid.position_of(row + 0.5, col + 0.5) for row, col in (start, goal)]
    ends = ends_of(PathProblem(field.grid, east_north[0], east_north[1], rover=problem.rover), field)
    # only the squares' own middles
    ends = tuple(type(e)(e.nodes[e.costs == 0.0], e.costs[e.costs == 0.0], e.places[e.costs == 0.0]) for e in ends)
    way, leg = grid_way(field.for_kernels(), ends, EIGHT)
    expected = reference.cheapest(field.grid.heights_m, field.reasons == 0, (30.0, 20.0), (1.0, 3.0), start, goal)
    if math.isinf(expected):
        assert way is None
        assert leg == 0
        assert goal not in reference.reachable(field.reasons == 0, start)
    else:
        assert way is not None
        assert way.cost == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_straightening_never_makes_a_way_dearer_nor_breaks_a_limit(seed: int) -> None:
    problem, field = field_of(seed, slope_deg=32.0)
    parts = [reference.reachable(field.reasons == 0, square) for square in allowed_squares(field)[::10]]
    squares = sorted(max(parts, key=len))
    places = [field.grid.position_of(row + 0.3, col + 0.6) for row, col in (squares[0], squares[-1])]
    ends = ends_of(PathProblem(field.grid, places[0], places[1], rover=problem.rover), field)
    way, _ = grid_way(field.for_kernels(), ends, SIXTEEN)
    assert way is not None
    straight = straightened(field.for_kernels(), way)
    assert straight.cost <= way.cost
    for begin, end in zip(straight.places[:-1], straight.places[1:], strict=True):
        share = np.linspace(0.001, 0.999, 400)[:, None]
        at = (begin + share * (end - begin)).astype(int)
        assert (field.reasons[at[:, 0], at[:, 1]] == 0).all()


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_least_worst_way_is_that_of_trying_one_limit_after_the_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    value = rng.integers(0, 9, (9, 11)).astype(np.float64)
    value[rng.random(value.shape) < 0.2] = np.inf
    worst, nodes = least_worst_way(value, np.array([0]), np.array([98]))
    assert worst == reference.least_worst(value, (0, 0), (8, 10))
    if len(nodes):
        assert nodes[0] == 0
        assert nodes[-1] == 98
        assert max(value[node // 11, node % 11] for node in nodes) <= worst
        steps = np.diff(np.column_stack(np.divmod(nodes, 11)), axis=0)
        assert np.abs(steps).max(initial=0) <= 1


def test_a_path_over_level_ground_is_the_straight_line() -> None:
    grid = ElevationGrid(np.zeros((40, 50), np.float32), 10.0, 10.0)
    outcome = plan_path(PathProblem(grid, (15.0, -25.0), (441.0, -333.0)))
    assert outcome.status is PathStatus.FOUND
    assert outcome.path is not None
    assert outcome.path.totals.length_m == pytest.approx(math.hypot(426.0, 308.0), rel=1e-9)
    assert len(outcome.path.corners) == 2
