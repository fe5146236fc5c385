"""Ray-triangle intersection answers for the same surface as line of sight, without sharing a line with it."""

from pathlib import Path

import numpy as np
import pytest
import rasterio

from terrain import ElevationGrid, TriangleMesh, height_at
from visibility import FLAT, HIDDEN, Curvature, VisibilityInputError, lines_of_sight
from visibility.cover import grid_surface_mesh, lowered_m, mesh_blocks

DATA = Path(__file__).parents[2] / "../shared/data/dem"
ENGINES = ["moller_trumbore", "embree"]
SMALL_WORLD = Curvature(50_000.0)


def one_triangle(*corners_m):
    return TriangleMesh(np.array(corners_m, float), np.array([[0, 1, 2]], np.int32), np.zeros((0, 0, 2), bool))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_segment_meets_a_triangle_where_the_formula_says(engine):
    triangle = one_triangle((0, 0, 10), (10, 0, 10), (0, 10, 10))
    hits = mesh_blocks(
        triangle,
        [(2, 2, 0), (2, 2, 0), (6, 6, 0), (2, 2, 20), (2, 2, 0)],
        [(2, 2, 20), (2, 2, 9), (6, 6, 20), (2, 2, 0), (2, 6, 40)],
        engine,
    )
    assert hits.blocked.tolist() == [True, False, False, True, True]
    np.testing.assert_allclose(hits.distance_m, [10, np.inf, np.inf, 10, np.hypot(10, 1)], atol=2 * hits.tolerance_m)
    np.testing.assert_allclose(hits.share, [0.5, np.inf, np.inf, 0.5, 0.25], atol=hits.tolerance_m)


@pytest.mark.parametrize("engine", ENGINES)
def test_touching_is_clear_and_either_winding_blocks(engine):
    flat = one_triangle((0, 0, 10), (10, 0, 10), (0, 10, 10))
    turned = one_triangle((0, 0, 10), (0, 10, 10), (10, 0, 10))
    for triangle in (flat, turned):
        assert not mesh_blocks(triangle, [(1, 1, 10)], [(3, 4, 10)], engine).blocked[0]
        assert not mesh_blocks(triangle, [(1, 1, 10)], [(3, 4, 30)], engine).blocked[0]
        assert mesh_blocks(triangle, [(1, 1, 9)], [(3, 4, 30)], engine).blocked[0]


@pytest.mark.parametrize("engine", ENGINES)
def test_no_ray_slips_through_the_seams_of_a_closed_surface(engine):
    heights_m = np.zeros((30, 30), np.float32)
    mesh = grid_surface_mesh(ElevationGrid(heights_m, 1.0, 1.0), FLAT, (0.0, 0.0))
    row, col = np.mgrid[0.5:28.5:0.5, 0.5:28.5:0.5]
    above_m = np.column_stack([col.ravel(), -row.ravel(), np.full(row.size, 7.0)])
    assert mesh_blocks(mesh, above_m, above_m * [1, 1, -1], engine).blocked.all()
    assert mesh_blocks(mesh, above_m, above_m * [1, 1, -1] + [0.3, 0.3, 0], engine).blocked.all()


def above_ground_points(grid, rng, n):
    west_m, south_m, east_m, north_m = grid.bounds_m
    east, north = rng.uniform(west_m, east_m, n), rng.uniform(south_m, north_m, n)
    return np.column_stack([east, north, height_at(grid, east, north) + rng.uniform(0.01, 60.0, n)])


def assert_engine_agrees(grid, curvature, engine, n, seed):
    rng = np.random.default_rng(seed)
    start_m, end_m = above_ground_points(grid, rng, n), above_ground_points(grid, rng, n)
    sight = lines_of_sight(grid, start_m, end_m, curvature=curvature)
    origin_m = grid.position_of(grid.rows * 0.3, grid.cols * 0.8)
    lowered = [
        np.column_stack([points[:, :2], points[:, 2] - lowered_m(curvature, origin_m, points)])
        for points in (start_m, end_m)
    ]
    hits = mesh_blocks(grid_surface_mesh(grid, curvature, origin_m), *lowered, engine)
    told = np.abs(sight.clearance_m) > 2.0 * hits.tolerance_m
    assert told.mean() > 0.99
    assert 0.05 < hits.blocked.mean() < 0.99
    np.testing.assert_array_equal(hits.blocked[told], sight.verdict[told] == HIDDEN)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("curvature", [FLAT, SMALL_WORLD], ids=["flat", "curved"])
def test_both_engines_agree_with_line_of_sight_on_rough_ground(engine, curvature):
    heights_m = np.random.default_rng(5).uniform(0.0, 60.0, (25, 31)).astype(np.float32)
    assert_engine_agrees(ElevationGrid(heights_m, 30.0, 20.0, 500_000.0, 4_100_000.0), curvature, engine, 2000, 6)


@pytest.mark.skipif(not (DATA / "bigtujunga.tif").exists(), reason="the shared DEMs are not beside this checkout")
def test_embree_agrees_with_line_of_sight_on_real_mountains():
    with rasterio.open(DATA / "bigtujunga.tif") as dem:
        heights_m = dem.read(1).astype(np.float32)
    grid = ElevationGrid(heights_m, 30.0, 30.0, 400_000.0, 3_800_000.0, crs="EPSG:32611")
    assert_engine_agrees(grid, Curvature.of(grid), "embree", 5000, 7)


def test_the_origin_of_the_lowering_does_not_matter():
    heights_m = np.random.default_rng(8).uniform(0.0, 60.0, (12, 12)).astype(np.float32)
    grid = ElevationGrid(heights_m, 30.0, 20.0)
    rng = np.random.default_rng(9)
    start_m, end_m = above_ground_points(grid, rng, 300), above_ground_points(grid, rng, 300)
    answers = []
    for origin_m in ((0.0, 0.0), (900.0, -40.0), (-5000.0, 7000.0)):
        drop_m = [np.column_stack([0 * p[:, :2], lowered_m(SMALL_WORLD, origin_m, p)]) for p in (start_m, end_m)]
        mesh = grid_surface_mesh(grid, SMALL_WORLD, origin_m)
        answers.append(mesh_blocks(mesh, start_m - drop_m[0], end_m - drop_m[1], "moller_trumbore"))
    for other in answers[1:]:
        np.testing.assert_array_equal(other.blocked, answers[0].blocked)
        np.testing.assert_allclose(other.share, answers[0].share, atol=1e-7)


@pytest.mark.parametrize("engine", ENGINES)
def test_nothing_asked_or_nothing_there_blocks_nothing(engine):
    triangle = one_triangle((0, 0, 10), (10, 0, 10), (0, 10, 10))
    assert mesh_blocks(triangle, np.empty((0, 3)), np.empty((0, 3)), engine).blocked.shape == (0,)
    unknown = ElevationGrid(np.full((3, 3), np.nan, np.float32), 1.0, 1.0)
    nothing = grid_surface_mesh(unknown, FLAT, (0.0, 0.0))
    assert not mesh_blocks(nothing, [(1, -1, 5)], [(1, -1, -5)], engine).blocked[0]


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (([(0, 0, 0)], [(1, 1, 1)], "optix"), "engine must be one of embree, moller_trumbore, not 'optix'"),
        (([(0, 0, 0)], [(1, 1, 1), (2, 2, 2)]), "Each segment needs two points, not 1 and 2"),
        (([(0, 0, np.nan)], [(1, 1, 1)]), "Segments need finite coordinates"),
    ],
)
def test_segments_that_make_no_question_are_refused(arguments, sentence):
    with pytest.raises(VisibilityInputError, match=sentence):
        mesh_blocks(one_triangle((0, 0, 10), (10, 0, 10), (0, 10, 10)), *arguments)
