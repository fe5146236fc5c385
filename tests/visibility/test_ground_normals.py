"""Which way the ground faces."""

import math

import numpy as np
import pytest

from terrain import ElevationGrid, height_at
from terrain.synthetic import plane
from tests.visibility.grounds import hills
from visibility.ground_normals import post_normals, rover_normals, surface_normals

SLOPE_EAST, SLOPE_NORTH = 0.3, -0.12
PLANE_NORMAL = np.array([-SLOPE_EAST, -SLOPE_NORTH, 1.0]) / math.sqrt(1.0 + SLOPE_EAST**2 + SLOPE_NORTH**2)


def tilted():
    """A plane of rectangular cells, rising east and falling north."""
    rows, cols = np.indices((7, 9))
    return ElevationGrid(cols * 20.0 * SLOPE_EAST - rows * 35.0 * SLOPE_NORTH, 20.0, 35.0)


def test_a_plane_faces_one_way_everywhere():
    grid = tilted()
    rng = np.random.default_rng(0)
    west_m, south_m, east_m, north_m = grid.bounds_m
    found = surface_normals(grid, rng.uniform(west_m, east_m, 100), rng.uniform(south_m, north_m, 100))
    np.testing.assert_allclose(found, np.tile(PLANE_NORMAL, (100, 1)), atol=1e-6)
    np.testing.assert_allclose(post_normals(grid, 0, 7), np.tile(PLANE_NORMAL, (63, 1)), atol=1e-6)


def test_a_normal_stands_across_every_step_along_its_triangle():
    grid = hills()
    rng = np.random.default_rng(1)
    row, col = rng.integers(0, 32, 200), rng.integers(0, 32, 200)
    # well inside one triangle or the other
    down = np.where(rng.random(200) < 0.5, 0.7, 0.3)
    across = 1.0 - down
    east_m, north_m = grid.position_of(row + down, col + across)
    normal = surface_normals(grid, east_m, north_m)
    for step_e, step_n in ((0.5, 0.0), (0.0, 0.5), (-0.3, 0.4)):
        rise_m = height_at(grid, east_m + step_e, north_m + step_n) - height_at(grid, east_m, north_m)
        along = normal[:, 0] * step_e + normal[:, 1] * step_n + normal[:, 2] * rise_m
        np.testing.assert_allclose(along, 0.0, atol=1e-5)


def test_outside_and_over_unknown_posts_there_is_no_normal():
    heights_m = np.zeros((5, 5), np.float32)
    heights_m[2, 2] = np.nan
    grid = ElevationGrid(heights_m, 10.0, 10.0)
    found = surface_normals(grid, [-5.0, 18.0, 2.0], [0.0, -16.0, -3.0])
    assert np.isnan(found).any(axis=1).tolist() == [True, True, False]


def test_a_post_beside_unknown_ground_takes_the_slope_that_is_known():
    grid = tilted()
    heights_m = grid.heights_m.copy()
    heights_m[3, 4] = np.nan
    found = post_normals(ElevationGrid(heights_m, 20.0, 35.0), 0, 7).reshape(7, 9, 3)
    assert np.isnan(found[3, 4]).all()
    known = ~np.isnan(found).any(axis=2)
    assert known.sum() == 62
    np.testing.assert_allclose(found[known], np.tile(PLANE_NORMAL, (62, 1)), atol=1e-6)


def test_rows_may_be_asked_for_in_parts():
    grid = hills()
    whole = post_normals(grid, 0, grid.rows)
    parts = np.vstack([post_normals(grid, 0, 10), post_normals(grid, 10, 11), post_normals(grid, 11, grid.rows)])
    np.testing.assert_array_equal(parts, whole)


@pytest.mark.parametrize("turned", [False, True])
def test_a_profile_extends_sideways_unchanged(turned):
    line_m = np.array([[0.0, 10.0, 20.0]])
    grid = ElevationGrid(line_m.T if turned else line_m, 10.0, 10.0)
    expected = [0.0, math.sqrt(0.5), math.sqrt(0.5)] if turned else [-math.sqrt(0.5), 0.0, math.sqrt(0.5)]
    np.testing.assert_allclose(post_normals(grid, 0, grid.rows), np.tile(expected, (3, 1)), atol=1e-6)
    where = (0.0, -5.0) if turned else (5.0, 0.0)
    np.testing.assert_allclose(surface_normals(grid, *where), [expected], atol=1e-6)


def test_the_synthetic_plane_faces_against_its_slopes():
    normal = surface_normals(plane(9, slope_east=0.2, slope_north=0.1), 31.0, 31.0)[0]
    assert normal[0] / normal[2] == pytest.approx(-0.2, abs=1e-5)
    assert normal[1] / normal[2] == pytest.approx(-0.1, abs=1e-5)


@pytest.mark.parametrize("shape", [(33, 33), (1, 33), (33, 1)])
def test_a_rover_on_a_post_has_the_normal_of_the_post_and_elsewhere_that_of_its_triangle(shape):
    heights_m = hills().heights_m[: shape[0], : shape[1]].copy()
    heights_m[0, 5 % shape[1]] = np.nan
    grid = ElevationGrid(heights_m, 20.0, 35.0, 500_000.3, 4_000_000.7)
    row, col = (index.ravel() for index in np.indices(shape))
    np.testing.assert_array_equal(rover_normals(grid, *grid.position_of(row, col)), post_normals(grid, 0, grid.rows))
    rng = np.random.default_rng(4)
    between = grid.position_of(*(rng.uniform(0.0, size - 1.0, 60) + 1e-3 * (size > 1) for size in shape))
    if 1 not in shape:
        np.testing.assert_array_equal(rover_normals(grid, *between), surface_normals(grid, *between))
