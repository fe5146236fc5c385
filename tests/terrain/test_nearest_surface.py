"""The exact distance to the triangulated surface, in space."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid, ElevationGridError, height_at, nearest_surface, plane
from tests.reference.nearest_triangle import distance_to_surface_m

ORIGIN_M = (100.0, 50.0)


def rough(rows=7, cols=9, holes=0, seed=3):
    rng = np.random.default_rng(seed)
    heights_m = rng.normal(0.0, 20.0, (rows, cols)).astype(np.float32)
    heights_m.ravel()[rng.choice(heights_m.size, holes, replace=False)] = np.nan
    return ElevationGrid(heights_m, 30.0, 20.0, *ORIGIN_M)


def points_over(grid, count, seed=4):
    rng = np.random.default_rng(seed)
    west_m, south_m, east_m, north_m = grid.bounds_m
    return rng.uniform([west_m, south_m, -60.0], [east_m, north_m, 160.0], (count, 3))


@pytest.mark.parametrize("holes", [0, 9])
def test_it_is_the_distance_to_the_nearest_of_all_triangles(holes):
    grid = rough(holes=holes)
    points_m = points_over(grid, 60)
    found = nearest_surface(grid, points_m)
    ground_m = height_at(grid, points_m[:, 0], points_m[:, 1])
    for point, distance_m, under_m in zip(points_m, found.distance_m, ground_m, strict=True):
        if math.isnan(under_m):
            assert math.isnan(distance_m)
            continue
        slow_m = distance_to_surface_m(grid.heights_m, grid.cell_east_m, grid.cell_north_m, ORIGIN_M, point)
        assert abs(distance_m) == pytest.approx(slow_m, abs=1e-9)
        assert (distance_m < 0.0) == (point[2] < under_m)


def test_the_nearest_place_lies_on_the_surface_at_that_distance():
    grid = rough(40, 33)
    points_m = points_over(grid, 300)
    found = nearest_surface(grid, points_m)
    away_m = np.linalg.norm(points_m - found.nearest_m, axis=1)
    np.testing.assert_allclose(away_m, np.abs(found.distance_m), atol=1e-9)
    on_ground_m = height_at(grid, found.nearest_m[:, 0], found.nearest_m[:, 1])
    np.testing.assert_allclose(found.nearest_m[:, 2], on_ground_m, atol=1e-4)


@given(slope=st.floats(-2.0, 2.0), above_m=st.floats(-30.0, 200.0))
@settings(max_examples=30, deadline=None)
def test_over_an_inclined_plane_it_is_the_height_times_the_cosine_of_the_slope(slope, above_m):
    grid = plane(30, 25.0, slope_east=slope)
    east_m, north_m = grid.position_of(30.0, 30.0)
    point_m = (east_m, north_m, float(height_at(grid, east_m, north_m)) + above_m)
    expected_m = above_m / math.hypot(1.0, slope)
    assert float(nearest_surface(grid, point_m).distance_m[0]) == pytest.approx(expected_m, abs=1e-3)


@given(seed=st.integers(0, 10_000), step=st.floats(0.1, 80.0))
@settings(max_examples=30, deadline=None)
def test_moving_by_a_step_changes_it_by_no_more_than_the_step(seed, step):
    rng = np.random.default_rng(seed)
    grid = rough(13, 11, seed=seed)
    start_m = points_over(grid, 1, seed)[0]
    way = rng.normal(size=3)
    end_m = start_m + way / np.linalg.norm(way) * step
    distances_m = nearest_surface(grid, [start_m, end_m]).distance_m
    if np.isfinite(distances_m).all():
        assert abs(distances_m[1] - distances_m[0]) <= step + 1e-9


def test_unknown_ground_is_told_apart_from_far_ground():
    heights_m = np.zeros((11, 11), np.float32)
    heights_m[5, 8] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    found = nearest_surface(grid, [(20.0, -50.0, 4.0), (80.0, -50.0, 4.0), (20.0, -50.0, 90.0)])
    assert found.distance_m[[0, 2]] == pytest.approx([4.0, 90.0])
    assert math.isnan(found.distance_m[1])
    assert found.unknown_m == pytest.approx([50.0, 0.0, 50.0])


def test_outside_the_grid_there_is_no_distance():
    found = nearest_surface(rough(), [(-900.0, 0.0, 10.0)])
    assert np.isnan([found.distance_m[0], found.unknown_m[0], *found.nearest_m[0]]).all()


@pytest.mark.parametrize("turned", [False, True])
def test_beside_a_profile_there_is_no_ground(turned):
    heights_m = np.array([[0.0, 30.0, 0.0]], np.float32)
    profile = ElevationGrid(heights_m.T if turned else heights_m, 30.0, 30.0)
    beside = [(-9.0, -30.0, 40.0), (9.0, -30.0, 40.0)] if turned else [(30.0, 9.0, 40.0), (30.0, -9.0, 40.0)]
    assert np.isnan(nearest_surface(profile, beside).distance_m).all()


def test_a_profile_is_level_across():
    profile = ElevationGrid(np.array([[0.0, 30.0, 0.0, 10.0]], np.float32), 30.0, 20.0)
    wide = ElevationGrid(np.repeat(profile.heights_m, 9, axis=0), 30.0, 20.0, origin_north_m=80.0)
    points_m = [(10.0, 0.0, 40.0), (70.0, 0.0, 22.0)]
    np.testing.assert_allclose(
        nearest_surface(profile, points_m).distance_m, nearest_surface(wide, points_m).distance_m
    )


def test_no_points_have_no_distances():
    assert nearest_surface(rough(), np.empty((0, 3))).distance_m.shape == (0,)


@pytest.mark.parametrize("points_m", [[(1.0, 2.0)], "here"])
def test_what_are_no_points_is_refused(points_m):
    with pytest.raises(ElevationGridError, match="points_m must hold"):
        nearest_surface(rough(), points_m)
