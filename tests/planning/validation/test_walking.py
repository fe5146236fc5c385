"""The walk that the validator judges: over every triangle, in order, as long as the way over the ground is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from planning.validation.walking import ON_EDGE, gradients_at, walk_along
from terrain import height_at
from terrain.synthetic import fractal
from tests.planning.validation.courses import grid_of, level, tilted

STRIDE = 0.5
places = st.tuples(st.floats(0.0, 400.0), st.floats(0.0, 400.0))
paths = st.lists(places, min_size=1, max_size=6)


def plodding(slope_rad: np.ndarray) -> np.ndarray:
    return np.full(slope_rad.shape, STRIDE)


def walked(grid, vertices_m, step_m=2.5):
    return walk_along(grid, np.array(vertices_m, np.float64), plodding, step_m)


@given(paths)
@example([(0.0, 0.0), (0.0, 49.99999999999994), (0.0, 370.0)])
@settings(max_examples=60, deadline=None)
def test_every_piece_lies_in_one_triangle_and_samples_are_near_one_another(vertices_m):
    walk = walked(level(), vertices_m)
    apart_m = np.hypot(*np.diff(walk.place_m, axis=0).T)
    assert (apart_m <= 2.5 + 1e-9).all()
    assert (np.diff(walk.distance_m) >= 0.0).all()
    # between two neighbouring samples at most one line of the triangulation is crossed
    for east_m, north_m in walk.place_m[walk.vertex < 0]:
        row, col = (400.0 - north_m) / 10.0, east_m / 10.0
        assert 0.0 <= row <= 40.0
        assert 0.0 <= col <= 40.0


@given(paths)
@settings(max_examples=60, deadline=None)
def test_on_a_plane_the_length_over_the_ground_is_that_of_the_straight_legs(vertices_m):
    grid = tilted(0.3, -0.2)
    walk = walked(grid, vertices_m)
    points = np.column_stack([walk.corners_m, 0.3 * walk.corners_m[:, 0] - 0.2 * walk.corners_m[:, 1]])
    length_m = np.sqrt((np.diff(points, axis=0) ** 2).sum(axis=1)).sum()
    assert walk.distance_m[-1] == pytest.approx(length_m, rel=1e-5, abs=1e-6)
    assert walk.time_s[-1] == pytest.approx(length_m / STRIDE, rel=1e-5, abs=1e-6)


@given(paths)
@settings(max_examples=40, deadline=None)
def test_the_ground_climbed_piece_by_piece_is_the_height_between_start_and_end(vertices_m):
    grid = fractal(41, 5, relief_m=300.0, cell_m=10.0)
    west_m, south_m, _, _ = grid.bounds_m
    vertices = np.add(vertices_m, (west_m, south_m))
    ends_m = height_at(grid, *vertices[[0, -1]].T)
    for step_m in (2.5, 0.5):
        walk = walked(grid, vertices, step_m)
        pieces = walk.vertex < 0
        risen_m = (walk.along[pieces, 0] * flat_lengths_m(walk)).sum()
        assert risen_m == pytest.approx(ends_m[1] - ends_m[0], abs=1e-3)


def flat_lengths_m(walk):
    """(m,) horizontal length of each piece: a sample lies in its middle."""
    length_m, before_m = [], 0.0
    for middle_m in walk.distance_m[walk.vertex < 0]:
        length_m.append(2.0 * (middle_m - before_m))
        before_m += length_m[-1]
    return np.array(length_m) / np.sqrt(1.0 + walk.along[walk.vertex < 0, 0] ** 2)


@given(places)
@settings(max_examples=100, deadline=None)
def test_the_gradient_of_a_triangle_predicts_the_heights_around_a_place(place):
    grid = fractal(41, 7, relief_m=300.0, cell_m=10.0)
    west_m, south_m, _, _ = grid.bounds_m
    row, col = (np.array([at]) for at in grid.post_at(west_m + place[0], south_m + place[1]))
    inner = 0.02
    down, across = row[0] % 1.0, col[0] % 1.0
    if min(down, across, 1 - down, 1 - across, abs(down - across)) < 2 * inner:
        return
    rise_east, rise_north = gradients_at(grid, row, col)[0]
    here_m = height_at(grid, *grid.position_of(row[0], col[0]))
    for d_row, d_col in ((inner, 0.0), (0.0, inner), (-inner, inner)):
        there_m = height_at(grid, *grid.position_of(row[0] + d_row, col[0] + d_col))
        assert there_m - here_m == pytest.approx((rise_east * d_col - rise_north * d_row) * 10.0, abs=1e-3)


def test_on_an_edge_both_triangles_count():
    heights_m = np.zeros((41, 41))
    heights_m[:, 21:] = 5.0
    along_the_foot = walked(grid_of(heights_m), [(200.0, 100.0), (200.0, 300.0)])
    assert np.ptp(along_the_foot.slope, axis=1) == pytest.approx(0.5)
    beside_it = walked(grid_of(heights_m), [(200.0 - 20 * ON_EDGE * 10.0, 100.0), (200.0 - 20 * ON_EDGE * 10.0, 300.0)])
    assert beside_it.slope.max() == 0.0


def test_a_repeated_vertex_and_a_path_of_one_vertex_can_be_walked():
    walk = walked(level(), [(50.0, 50.0), (50.0, 50.0), (80.0, 50.0)])
    assert walk.distance_m[-1] == pytest.approx(30.0)
    alone = walked(level(), [(50.0, 50.0)])
    assert len(alone) == 1
    assert alone.distance_m[-1] == alone.time_s[-1] == 0.0
