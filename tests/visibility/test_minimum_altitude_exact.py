"""Exact minimum visible altitude against every edge of the triangulation, and against rays through its mesh."""

import numba
import numpy as np
import pytest

from terrain.synthetic import fractal
from tests.reference.minimum_altitude import minimum_altitude
from tests.visibility.grounds import clearing_eye, eye, hills, real_dem, rough, window
from visibility import FLAT, Curvature, anchor_above_ground, min_visible_altitude
from visibility.cover.ray_triangle import grid_surface_mesh, mesh_blocks
from visibility.sight.sweeps import exact_sweep

ONE_MILLIMETRE = 1e-3
SMALL_WORLD = Curvature(50_000.0)

PLACES = {
    "on a post": (0.5, 0.5, True),
    "between posts": (0.43, 0.61, False),
    "on the border": (0.0, 0.37, False),
    "at a corner": (1.0, 1.0, True),
    "north of the map": (-0.8, 0.4, False),
    "east of the map": (0.3, 1.7, False),
    "south of the map, on the lattice": (1.5, 0.5, True),
    "west of the map": (0.55, -2.0, False),
    "on the prolonged diagonal": (-0.5, -0.5, True),
    "far away": (30.0, 11.0, False),
}


def place(grid, where):
    down, across, on_post = PLACES[where]
    row, col = down * (grid.rows - 1), across * (grid.cols - 1)
    return (round(row), round(col)) if on_post else (row, col)


def assert_exact(grid, anchor, curvature):
    got = min_visible_altitude(grid, [anchor], mode="exact", curvature=curvature)
    row, col = grid.post_at(anchor.east_m, anchor.north_m)
    expected, _ = minimum_altitude(
        grid.heights_m, (row, col, anchor.altitude_m), (grid.cell_north_m, grid.cell_east_m), curvature.drop_per_m2
    )
    np.testing.assert_allclose(got.altitude_m[0], expected, rtol=0, atol=ONE_MILLIMETRE)
    misclassified = (got.altitude_m[0] > grid.heights_m) != (expected > grid.heights_m + 1e-5)
    assert not misclassified.any()


@pytest.mark.parametrize("where", PLACES)
@pytest.mark.parametrize("cells_m", [(30.0, 30.0), (92.7, 68.1)], ids=["square", "oblong"])
def test_no_post_of_rough_ground_is_misclassified(where, cells_m):
    for seed, shape in enumerate([(17, 23), (23, 9), (2, 31)]):
        grid = rough(seed, *shape, cells_m)
        assert_exact(grid, clearing_eye(grid, *place(grid, where)), FLAT)


@pytest.mark.parametrize("where", PLACES)
def test_no_post_of_curved_fractal_hills_is_misclassified(where):
    grid = hills(25)
    assert_exact(grid, clearing_eye(grid, *place(grid, where)), SMALL_WORLD)


@pytest.mark.parametrize("where", ["on a post", "between posts", "east of the map"])
def test_no_post_of_real_mountains_is_misclassified(where):
    grid = window(real_dem("bigtujunga.tif"), 300, 500, 36, 44)
    assert_exact(grid, clearing_eye(grid, *place(grid, where)), Curvature.of(grid))


def test_terraces_of_equal_heights_make_no_ties_go_wrong():
    grid = rough(5, 21, 21)
    terraced = type(grid)(np.round(grid.heights_m / 10.0) * 10.0, 30.0, 30.0)
    for where in PLACES:
        assert_exact(terraced, clearing_eye(terraced, *place(terraced, where)), FLAT)


def test_flat_ground_is_all_visible_from_itself():
    grid = rough(0, 12, 15, relief_m=0.0)
    for mode in ("fast", "exact"):
        result = min_visible_altitude(grid, [clearing_eye(grid, 4, 7.5, above_m=0.0)], mode=mode)
        assert result.visible(above_ground_m=0.0).all()


def test_rays_through_the_mesh_agree_just_above_and_just_below():
    grid = hills(33)
    anchor = clearing_eye(grid, 11.3, 20.8)
    altitude_m = min_visible_altitude(grid, [anchor], mode="exact", curvature=SMALL_WORLD).altitude_m[0].astype(float)
    rows, cols = np.mgrid[0 : grid.rows, 0 : grid.cols]
    east_m, north_m = grid.position_of(cols * 0.0 + rows, cols)[0], grid.origin_north_m - rows * grid.cell_north_m
    east_m = grid.origin_east_m + cols * grid.cell_east_m
    distance_m = np.hypot(east_m - anchor.east_m, north_m - anchor.north_m)
    drop_m = SMALL_WORLD.drop_per_m2 * distance_m**2
    mesh = grid_surface_mesh(grid, SMALL_WORLD, (anchor.east_m, anchor.north_m))
    start = np.array([anchor.east_m, anchor.north_m, anchor.altitude_m])
    hidden = altitude_m > grid.heights_m + 0.02
    for offset_m, where, blocked in ((0.01, np.ones_like(hidden), False), (-0.01, hidden, True)):
        target = np.column_stack([east_m[where], north_m[where], (altitude_m - drop_m + offset_m)[where]])
        hits = mesh_blocks(mesh, np.broadcast_to(start, target.shape), target, engine="moller_trumbore")
        assert (hits.blocked == blocked).all()


def test_the_cost_per_post_grows_no_faster_than_a_logarithm_because_horizons_stay_short():
    # pieces of the horizon, not seconds: the envelope of a block may not grow with the number of lines behind it
    from visibility.sight.kernels.horizon import merge

    grid = fractal(129, seed=1)
    start, p, q = np.full(4096, np.nan), np.zeros(4096), np.zeros(4096)
    start[0], start[1], p[0] = -1.0, 1.0, -np.inf
    horizon, spare, n = (start, p, q), (np.zeros(4096), np.zeros(4096), np.zeros(4096)), 1
    middle, eye_m = 64, float(grid.heights_m[0, 64] + 100.0)
    for along in range(1, 129):
        post = np.arange(max(middle - along, 0), min(middle + along, 128))
        h = grid.heights_m[along].astype(float) - eye_m
        rise = h[post + 1] - h[post]
        pieces = (
            (post - middle) / along,
            (post + 1 - middle) / along,
            (h[post] - rise * (post - middle)) / along,
            rise,
        )
        n = merge(horizon, n, pieces, len(post), spare)
        horizon, spare = spare, horizon
        assert n <= 4 * along + 4


@pytest.mark.parametrize("beside_cells", [2e-9, 1e-8, 3e-7])
def test_an_anchor_on_the_ground_a_hair_beside_a_post_sees_what_the_post_sees(beside_cells):
    grid = rough(5, 60, 41, (0.1, 0.1))
    on_post = eye(grid, 22, 35, float(grid.heights_m[22, 35]))
    east_m, north_m = grid.position_of(22 + beside_cells, 35 - beside_cells)
    beside = anchor_above_ground(grid, "A", east_m, north_m, 0.0)
    expected, got = (min_visible_altitude(grid, [anchor], mode="exact").altitude_m for anchor in (on_post, beside))
    np.testing.assert_allclose(got, expected, rtol=0, atol=ONE_MILLIMETRE)


@pytest.mark.parametrize("where", ["on a post", "between posts", "south of the map, on the lattice"])
def test_blocks_of_few_bearings_and_tiles_of_columns_change_nothing(where, monkeypatch):
    grid = hills(73)
    monkeypatch.setattr("visibility.sight.kernels.exact.BLOCK_POSTS", 16)
    assert_exact(grid, clearing_eye(grid, *place(grid, where)), FLAT)


@pytest.mark.parametrize("seed", range(6))
def test_edges_beside_unknown_posts_count_to_their_ends(seed):
    # sight lines along rows, columns and diagonals run where the horizon jumps: the edges of both sides end there
    heights_m = rough(seed, 40, 37).heights_m.copy()
    heights_m[np.random.default_rng(seed).random(heights_m.shape) < 0.1] = np.nan
    heights_m[16, 14] = 20.0
    out_m = np.empty((1, *heights_m.shape), np.float32)
    exact_sweep(heights_m, [(16.0, 14.0, 45.0)], (0.0, 0.0), out_m)
    expected_m, _ = minimum_altitude(heights_m, (16, 14, 45.0))
    np.testing.assert_allclose(out_m[0], expected_m, rtol=0, atol=ONE_MILLIMETRE)


def test_answers_are_the_same_bytes_with_any_number_of_threads():
    grid = hills(129)
    anchor = clearing_eye(grid, 61.3, 40.0)
    threads, found = numba.get_num_threads(), []
    try:
        for count in range(1, threads + 1):
            numba.set_num_threads(count)
            found.append(min_visible_altitude(grid, [anchor], mode="exact").altitude_m.tobytes())
    finally:
        numba.set_num_threads(threads)
    assert set(found) == {found[0]}
