"""height_at is the triangulated surface, everywhere."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain import ElevationGrid, height_at
from tests.reference.triangulated_surface import surface_height

FLOAT32_ROUNDING_M = 1e-3
unhurried = settings(deadline=None)  # the first call loads the compiled kernels
coordinate = st.floats(-1e6, 1e6)
cell = st.floats(0.1, 1000.0)


@st.composite
def grids(draw: st.DrawFn, unknown: bool = False) -> ElevationGrid:
    rows, cols = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    heights_m = rng.uniform(-500.0, 4000.0, (rows, cols)).astype(np.float32)
    if unknown:
        heights_m[rng.random((rows, cols)) < 0.3] = np.nan
    return ElevationGrid(heights_m, draw(cell), draw(cell), draw(coordinate), draw(coordinate))


def every_post(grid: ElevationGrid) -> tuple[np.ndarray, np.ndarray]:
    positions = np.array([grid.position_of(r, c) for r in range(grid.rows) for c in range(grid.cols)])
    return positions[:, 0], positions[:, 1]


@unhurried
@given(grids(unknown=True))
def test_at_a_post_the_height_is_the_posts_whatever_its_neighbours_know(grid: ElevationGrid) -> None:
    east_m, north_m = every_post(grid)
    np.testing.assert_array_equal(height_at(grid, east_m, north_m), grid.heights_m.ravel())


@unhurried
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), cell, cell, st.integers(0, 1000))
def test_on_a_plane_the_surface_is_the_plane(
    slope_east: float, slope_north: float, cell_east_m: float, cell_north_m: float, seed: int
) -> None:
    east_m, north_m = np.meshgrid(np.arange(7) * cell_east_m, -np.arange(5) * cell_north_m)
    grid = ElevationGrid(slope_east * east_m + slope_north * north_m, cell_east_m, cell_north_m)
    rng = np.random.default_rng(seed)
    east, north = rng.uniform(0, 6 * cell_east_m, 50), rng.uniform(-4 * cell_north_m, 0, 50)
    np.testing.assert_allclose(height_at(grid, east, north), slope_east * east + slope_north * north, atol=2e-3)


@unhurried
@given(grids(), st.floats(0, 1), st.floats(0, 1))
def test_it_agrees_with_planes_through_three_posts(grid: ElevationGrid, down: float, across: float) -> None:
    row, col = down * (grid.rows - 1), across * (grid.cols - 1)
    expected = surface_height(grid.heights_m, row, col)
    assert float(height_at(grid, *grid.position_of(row, col))) == pytest.approx(expected, abs=2e-2)


@unhurried
@given(grids(), st.integers(0, 1000))
def test_crossing_an_edge_makes_no_step(grid: ElevationGrid, seed: int) -> None:
    rng = np.random.default_rng(seed)
    steepest = float(np.ptp(grid.heights_m)) + 1.0
    for axis in ("row", "col", "diagonal"):
        row, col = rng.uniform(0, grid.rows - 1, 20), rng.uniform(0, grid.cols - 1, 20)
        if axis == "row":
            row = np.round(row)
        elif axis == "col":
            col = np.round(col)
        else:
            col = np.clip(np.floor(col) + row - np.floor(row), 0, grid.cols - 1)
        step = 1e-5
        before = [height_at(grid, *grid.position_of(r - step, c + step)) for r, c in zip(row, col, strict=True)]
        after = [height_at(grid, *grid.position_of(r + step, c - step)) for r, c in zip(row, col, strict=True)]
        both = np.isfinite(before) & np.isfinite(after)
        assert (np.abs(np.subtract(before, after))[both] <= 8 * step * steepest + FLOAT32_ROUNDING_M).all()


@unhurried
@given(grids(unknown=True), st.integers(0, 1000))
def test_unknown_ground_is_the_triangles_of_unknown_posts_and_nothing_more(grid: ElevationGrid, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for row, col in zip(rng.uniform(0, grid.rows - 1, 10), rng.uniform(0, grid.cols - 1, 10), strict=True):
        expected = surface_height(grid.heights_m, row, col)
        assert math.isnan(height_at(grid, *grid.position_of(row, col))) == math.isnan(expected)


def test_along_an_edge_between_known_posts_an_unknown_third_post_has_no_say() -> None:
    grid = ElevationGrid(np.array([[10.0, 20.0, 30.0], [40.0, np.nan, 60.0], [70.0, 80.0, 90.0]]), 1.0, 1.0)
    assert float(height_at(grid, 0.5, 0.0)) == 15.0
    assert float(height_at(grid, 2.0, -0.5)) == 45.0
    assert np.isnan(height_at(grid, 0.5, -0.5)), "the diagonal ends at the unknown post"


def test_border_posts_are_inside_whatever_the_rounding_of_their_positions() -> None:
    grid = ElevationGrid(np.arange(12.0).reshape(3, 4), 0.1, 0.1, 0.1, 0.3)
    east_m, north_m = every_post(grid)
    assert not np.isnan(height_at(grid, east_m, north_m)).any()
    assert all(grid.contains(e, n) for e, n in zip(east_m, north_m, strict=True))


@pytest.mark.parametrize(("row", "col"), [(-0.01, 1), (2.01, 1), (1, -0.01), (1, 3.01), (np.nan, 1)])
def test_outside_the_outermost_posts_the_height_is_unknown(row: float, col: float) -> None:
    grid = ElevationGrid(np.ones((3, 4)), 10.0, 20.0)
    assert np.isnan(height_at(grid, *grid.position_of(row, col)))


@pytest.mark.parametrize("shape", [(1, 5), (5, 1), (1, 1)])
def test_a_profile_is_linear_between_its_posts_and_unknown_beside_them(shape: tuple[int, int]) -> None:
    grid = ElevationGrid(np.linspace(100.0, 500.0, 5)[: max(shape)].reshape(shape), 10.0, 10.0)
    along = np.linspace(0.0, max(shape) - 1, 9)
    row, col = (along, 0 * along) if shape[1] == 1 else (0 * along, along)
    east_m, north_m = col * 10.0, -row * 10.0
    np.testing.assert_allclose(height_at(grid, east_m, north_m), 100.0 + 100.0 * along)
    beside = 1.0
    assert np.isnan(height_at(grid, east_m + beside * (shape[1] == 1), north_m + beside * (shape[0] == 1))).all()


def test_scalars_and_arrays_broadcast_together() -> None:
    grid = ElevationGrid(np.arange(6.0).reshape(2, 3), 1.0, 1.0)
    assert height_at(grid, [0.0, 1.0, 2.0], 0.0).tolist() == [0.0, 1.0, 2.0]
    assert height_at(grid, [[0.0], [1.0]], [[0.0, -1.0]]).shape == (2, 2)
