"""Clearance and unknown ground against exact rational arithmetic, and against every edge of real terrain."""

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import ElevationGrid
from tests.reference.line_of_sight import clearance_and_unknown, clearance_of_all_edges
from visibility import FLAT, HIDDEN, UNKNOWN, VISIBLE, Curvature, lines_of_sight

ROUNDING_M = 1e-6
SMALL_WORLD = Curvature(20_000.0)
DATA = Path(__file__).parents[2] / "../shared/data/dem"


def rough_ground(seed, shape=(7, 8), void_share=0.0):
    rng = np.random.default_rng(seed)
    heights_m = rng.uniform(0.0, 40.0, shape).astype(np.float32)
    heights_m[rng.random(shape) < void_share] = np.nan
    return heights_m


def points(seed, kind, shape, cells_m, n):
    """(n, 3) east, north, altitude of points on posts, on rows, on diagonals, anywhere inside, or around the grid."""
    rng = np.random.default_rng(seed)
    rows, cols = shape
    row, col = rng.uniform(0, rows - 1, n), rng.uniform(0, cols - 1, n)
    if kind == "post":
        row, col = np.round(row), np.round(col)
    elif kind == "row":
        row = np.round(row)
    elif kind == "diagonal":
        row = np.clip(np.floor(row) + col % 1.0, 0, rows - 1)
    elif kind == "outside":
        row, col = rng.uniform(-rows, 2 * rows, n), rng.uniform(-cols, 2 * cols, n)
    elif kind == "border":
        side = rng.integers(0, 4, n)
        row = np.select([side == 0, side == 1], [0.0, rows - 1.0], row)
        col = np.select([side == 2, side == 3], [0.0, cols - 1.0], col)
    return np.column_stack([col * cells_m[0], -row * cells_m[1], rng.uniform(0.0, 60.0, n)])


def assert_agrees_with_oracle(heights_m, cells_m, start_m, end_m, curvature):
    grid = ElevationGrid(heights_m, *cells_m)
    sight = lines_of_sight(grid, start_m, end_m, curvature=curvature)
    for i, (start, end) in enumerate(zip(start_m, end_m, strict=True)):
        clearance, unknown = clearance_and_unknown(heights_m, cells_m, start, end, curvature.drop_per_m2)
        expected_m = np.inf if clearance is None else float(clearance)
        assert sight.clearance_m[i] == pytest.approx(expected_m, abs=ROUNDING_M), (start, end)
        assert sight.over_unknown[i] == unknown, (start, end)
        if clearance is not None and clearance < -ROUNDING_M * 20:
            assert sight.verdict[i] == HIDDEN
        elif clearance is None or clearance >= 0:
            assert sight.verdict[i] == (UNKNOWN if unknown else VISIBLE)


@pytest.mark.parametrize("curvature", [FLAT, SMALL_WORLD], ids=["flat", "curved"])
@pytest.mark.parametrize("cells_m", [(1.0, 1.0), (30.0, 20.0)], ids=["square", "oblong"])
@pytest.mark.parametrize("void_share", [0.0, 0.08], ids=["known", "voids"])
@pytest.mark.parametrize("kind", ["post", "row", "diagonal", "inside", "border", "outside"])
def test_clearance_is_that_of_exact_arithmetic(kind, void_share, cells_m, curvature):
    heights_m = rough_ground(1, void_share=void_share)
    n = 5
    for other in ("post", "inside", "outside"):
        start_m = points(2, kind, heights_m.shape, cells_m, n)
        end_m = points(3, other, heights_m.shape, cells_m, n)
        assert_agrees_with_oracle(heights_m, cells_m, start_m, end_m, curvature)


@pytest.mark.parametrize("turn", range(8))
def test_lines_along_rows_columns_and_diagonals_through_posts_agree(turn):
    heights_m = rough_ground(4, (9, 9), 0.05)
    d_row, d_col = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)][turn]
    middle = np.array([4.0, -4.0, 30.0])
    ends = [(4 + k * d_col, -4 - k * d_row, altitude) for k in (1, 2, 3, 4, 6) for altitude in (0.0, 25.0, 50.0)]
    assert_agrees_with_oracle(heights_m, (1.0, 1.0), np.tile(middle, (len(ends), 1)), np.array(ends), FLAT)


def test_two_equal_points_and_vertical_lines_agree():
    heights_m = rough_ground(5)
    start_m = points(6, "inside", heights_m.shape, (10.0, 10.0), 20)
    end_m = start_m.copy()
    end_m[10:, 2] += 25.0
    assert_agrees_with_oracle(heights_m, (10.0, 10.0), start_m, end_m, SMALL_WORLD)


def test_lines_far_from_the_origin_lose_nothing():
    heights_m = rough_ground(7)
    start_m, end_m = (points(seed, "inside", heights_m.shape, (30.0, 30.0), 200) for seed in (8, 9))
    here = lines_of_sight(ElevationGrid(heights_m, 30.0, 30.0), start_m, end_m)
    shift_m = np.array([500_000.0, 4_100_000.0, 0.0])
    far = lines_of_sight(
        ElevationGrid(heights_m, 30.0, 30.0, shift_m[0], shift_m[1]), start_m + shift_m, end_m + shift_m
    )
    np.testing.assert_allclose(far.clearance_m, here.clearance_m, atol=ROUNDING_M)


@pytest.mark.skipif(not (DATA / "bigtujunga.tif").exists(), reason="the shared DEMs are not beside this checkout")
@pytest.mark.parametrize("curvature", [FLAT, Curvature(6_371_000.0, 4.0 / 3.0)], ids=["flat", "earth"])
def test_clearance_over_real_mountains_is_that_of_every_edge(curvature):
    with rasterio.open(DATA / "bigtujunga.tif") as dem:
        heights_m = dem.read(1)[200:420, 300:600].astype(np.float32)
    rng = np.random.default_rng(10)
    n, cells_m = 60, (30.0, 30.0)
    row, col = rng.integers(0, 220, (2, n)), rng.integers(0, 300, (2, n))
    above_m = rng.uniform(2.0, 300.0, (2, n))
    start_m, end_m = (
        np.column_stack([col[k] * 30.0, row[k] * -30.0, heights_m[row[k], col[k]] + above_m[k]]) for k in (0, 1)
    )
    sight = lines_of_sight(ElevationGrid(heights_m, *cells_m), start_m, end_m, curvature=curvature)
    assert 10 < (sight.verdict == HIDDEN).sum() < n - 10
    for i in range(n):
        expected_m = clearance_of_all_edges(heights_m, cells_m, start_m[i], end_m[i], curvature.drop_per_m2)
        assert sight.clearance_m[i] == pytest.approx(min(expected_m, *above_m[:, i]), abs=ROUNDING_M)


def test_few_lines_on_one_thread_are_the_same_as_among_many():
    shape, cells_m = (60, 70), (30.0, 20.0)
    heights_m = rough_ground(8, shape, void_share=0.01)
    grid = ElevationGrid(heights_m, *cells_m)
    start_m, end_m = (points(seed, "outside", shape, cells_m, 600) for seed in (1, 2))
    many = lines_of_sight(grid, start_m, end_m, curvature=SMALL_WORLD)
    few = [
        lines_of_sight(grid, start_m[of], end_m[of], curvature=SMALL_WORLD) for of in (slice(0, 200), slice(200, 400))
    ]
    for name in ("clearance_m", "blocking_distance_m", "over_unknown", "leaves_dem", "verdict"):
        together = np.concatenate([getattr(one, name) for one in few])
        assert np.array_equal(together, getattr(many, name)[:400], equal_nan=True)
