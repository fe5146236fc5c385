"""What must hold of minimum visible altitude whatever the ground."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid
from tests.visibility.grounds import clearing_eye, eye, rough
from visibility import FLAT, Anchor, Curvature, line_of_sight, min_visible_altitude

ROUNDING_M = 2e-3
MODES = ["fast", "exact"]
many = settings(max_examples=40, deadline=None)

seeds = st.integers(0, 10_000)
shapes = st.tuples(st.integers(2, 20), st.integers(2, 20))
# places within a millionth of a cell of a line of posts are put on it, also from just outside the border
place = st.floats(-0.6, 1.6).map(lambda share: round(share, 5))
shares = st.tuples(place, place)


def case(seed, shape, share, above_m=15.0):
    grid = rough(seed, *shape)
    return grid, clearing_eye(grid, share[0] * (shape[0] - 1), share[1] * (shape[1] - 1), above_m)


def exact_m(grid, anchor):
    return min_visible_altitude(grid, [anchor], mode="exact", curvature=FLAT).altitude_m[0]


@many
@given(seeds, shapes, shares)
def test_the_answer_is_never_below_ground(seed, shape, share):
    grid, anchor = case(seed, shape, share)
    for mode in MODES:
        assert (min_visible_altitude(grid, [anchor], mode=mode).altitude_m >= grid.heights_m).all()


@many
@given(seeds, shapes, shares, st.floats(0.1, 60.0))
def test_a_higher_anchor_hides_nothing_that_was_in_sight(seed, shape, share, more_m):
    grid, anchor = case(seed, shape, share)
    higher = Anchor("B", anchor.east_m, anchor.north_m, anchor.altitude_m + more_m)
    assert (exact_m(grid, higher) <= exact_m(grid, anchor) + ROUNDING_M).all()


@many
@given(seeds, shapes, shares, st.floats(0.1, 60.0), st.data())
def test_raising_a_post_reveals_nothing_elsewhere(seed, shape, share, more_m, data):
    grid, anchor = case(seed, shape, share, above_m=70.0)
    row = data.draw(st.integers(0, shape[0] - 1))
    col = data.draw(st.integers(0, shape[1] - 1))
    heights_m = grid.heights_m.copy()
    heights_m[row, col] += more_m
    raised = ElevationGrid(heights_m, 30.0, 30.0)
    assert (exact_m(raised, anchor) >= exact_m(grid, anchor) - ROUNDING_M).all()


@many
@given(seeds, shapes, shares, st.floats(-5e5, 5e5), st.floats(-5e5, 5e5), st.floats(-400.0, 4000.0))
def test_moving_the_world_moves_the_answer(seed, shape, share, east_m, north_m, up_m):
    grid, anchor = case(seed, shape, share)
    moved = ElevationGrid(grid.heights_m + np.float32(up_m), 30.0, 30.0, east_m, north_m)
    there = Anchor("B", anchor.east_m + east_m, anchor.north_m + north_m, anchor.altitude_m + up_m)
    np.testing.assert_allclose(exact_m(moved, there), exact_m(grid, anchor) + up_m, rtol=0, atol=1e-2)


# an eye beyond the map on a line of posts along its last border
@example(6137, (17, 17), (1.0, -0.25))
@many
@given(seeds, shapes, shares)
def test_turning_the_world_turns_the_answer(seed, shape, share):
    # transposing and turning by 180 degrees keep the diagonals of the triangulation
    grid, anchor = case(seed, shape, share)
    row, col = grid.post_at(anchor.east_m, anchor.north_m)
    expected = exact_m(grid, anchor)
    transposed = ElevationGrid(grid.heights_m.T, 30.0, 30.0)
    got = exact_m(transposed, eye(transposed, col, row, anchor.altitude_m)).T
    np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING_M)
    turned = ElevationGrid(grid.heights_m[::-1, ::-1], 30.0, 30.0)
    got = exact_m(turned, eye(turned, shape[0] - 1 - row, shape[1] - 1 - col, anchor.altitude_m))[::-1, ::-1]
    np.testing.assert_allclose(got, expected, rtol=0, atol=ROUNDING_M)


@many
@given(seeds, shapes, shares)
def test_mirroring_ground_without_diagonals_mirrors_the_answer(seed, shape, share):
    # ground whose squares are flat looks the same whichever way they are cut
    rng = np.random.default_rng(seed)
    rows, cols = np.mgrid[0 : shape[0], 0 : shape[1]]
    heights_m = rng.uniform(-9, 9) * rows + np.cumsum(rng.uniform(-20, 20, shape[1]))[cols]
    grid = ElevationGrid(heights_m, 30.0, 30.0)
    row, col = share[0] * (shape[0] - 1), share[1] * (shape[1] - 1)
    altitude_m = float(grid.heights_m.max()) + 5.0
    mirrored = ElevationGrid(heights_m[:, ::-1], 30.0, 30.0)
    got = exact_m(mirrored, eye(mirrored, row, shape[1] - 1 - col, altitude_m))[:, ::-1]
    np.testing.assert_allclose(got, exact_m(grid, eye(grid, row, col, altitude_m)), rtol=0, atol=ROUNDING_M)


@many
@given(seeds, shapes, st.data())
def test_two_posts_see_one_another_or_neither_does(seed, shape, data):
    grid = rough(seed, *shape)
    posts = [(data.draw(st.integers(0, shape[0] - 1)), data.draw(st.integers(0, shape[1] - 1))) for _ in range(2)]
    heights_m = [float(grid.heights_m[post]) + data.draw(st.floats(0.5, 40.0)) for post in posts]
    margins = []
    for here, there in ((0, 1), (1, 0)):
        lowest_m = exact_m(grid, eye(grid, *posts[here], heights_m[here]))[posts[there]]
        margins.append(heights_m[there] - lowest_m)
    if min(abs(margin) for margin in margins) > ROUNDING_M:
        assert (margins[0] > 0) == (margins[1] > 0)


@many
@given(seeds, shapes, shares)
def test_it_agrees_with_lines_of_sight_just_above_and_just_below(seed, shape, share):
    grid, anchor = case(seed, shape, share)
    lowest_m = exact_m(grid, anchor)
    rng = np.random.default_rng(seed)
    for _ in range(5):
        row, col = rng.integers(0, shape[0]), rng.integers(0, shape[1])
        east_m, north_m = grid.position_of(row, col)
        eye_m = (anchor.east_m, anchor.north_m, anchor.altitude_m)
        above = line_of_sight(grid, eye_m, (east_m, north_m, float(lowest_m[row, col]) + ROUNDING_M))
        below = line_of_sight(grid, eye_m, (east_m, north_m, float(lowest_m[row, col]) - ROUNDING_M))
        assert above.verdict == "clear"
        assert below.verdict == "blocked"


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("at", [(3, 0), (0, 5), (4, 4), (-6, 3), (2, -7)])
def test_a_wall_across_the_way_blocks_whatever_stands_behind_it(mode, at):
    heights_m = np.zeros((41, 41))
    row, col = 20 + at[0], 20 + at[1]
    heights_m[row - 1 : row + 2, col - 1 : col + 2] = 1000.0
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    lowest_m = min_visible_altitude(grid, [eye(grid, 20, 20, 50.0)], mode=mode).altitude_m[0]
    behind = 20 + 2 * at[0], 20 + 2 * at[1]
    assert lowest_m[behind] > 1000.0


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("k", [1.0, 4.0 / 3.0])
def test_the_horizon_over_a_plain_lies_where_curvature_puts_it(mode, k):
    radius_m, anchor_m, rover_m = 6_371_000.0, 30.0, 2.0
    horizon_m = math.sqrt(2 * k * radius_m * anchor_m) + math.sqrt(2 * k * radius_m * rover_m)
    cell_m = horizon_m / 1000.0
    grid = ElevationGrid(np.zeros((3, 1101)), cell_m, cell_m)
    seen = min_visible_altitude(grid, [eye(grid, 1, 0, anchor_m)], mode=mode, curvature=Curvature(radius_m, k))
    visible = seen.visible(above_ground_m=rover_m)[0, 1]
    assert visible[:991].all()
    assert not visible[1010:].any()
