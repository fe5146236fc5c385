"""The mesh is the very surface that height_at samples."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from terrain import ElevationGrid, ElevationGridError, fractal, grid_mesh, height_at


def holed() -> ElevationGrid:
    heights_m = np.random.default_rng(5).uniform(0, 100, (6, 8)).astype("f4")
    heights_m[2, 3] = heights_m[0, 0] = heights_m[5, 7] = np.nan
    return ElevationGrid(heights_m, 2.0, 3.0, 1000.0, 2000.0)


def test_every_square_is_cut_from_north_west_to_south_east() -> None:
    mesh = grid_mesh(ElevationGrid(np.arange(4.0).reshape(2, 2), 10.0, 20.0, 100.0, 200.0))
    assert mesh.vertices_m.tolist() == [[100, 200, 0], [110, 200, 1], [100, 180, 2], [110, 180, 3]]
    assert mesh.faces.tolist() == [[0, 2, 3], [0, 3, 1]]
    assert (mesh.vertices_m.dtype, mesh.faces.dtype) == (np.float64, np.int32)
    assert not mesh.missing.any()


def test_normals_point_up() -> None:
    mesh = grid_mesh(fractal(32))
    a, b, c = (mesh.vertices_m[mesh.faces[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0).all()


def test_triangles_without_a_known_corner_are_left_out_and_told() -> None:
    grid = holed()
    mesh = grid_mesh(grid)
    assert np.isfinite(mesh.vertices_m[mesh.faces]).all()
    assert mesh.missing.shape == (5, 7, 2)
    assert len(mesh.faces) == 2 * 5 * 7 - mesh.missing.sum()
    assert mesh.missing.sum() == 6 + 2 + 2, "inner post: six triangles; NW and SE corner: two"
    for row in range(5):
        for col in range(7):
            for half, (down, across) in enumerate([(2 / 3, 1 / 3), (1 / 3, 2 / 3)]):
                inside = height_at(grid, *grid.position_of(row + down, col + across))
                assert np.isnan(inside) == mesh.missing[row, col, half]


def test_heights_inside_each_triangle_are_those_of_the_surface() -> None:
    grid = holed()
    mesh = grid_mesh(grid)
    weights = np.random.default_rng(1).dirichlet([1, 1, 1], len(mesh.faces))
    inside_m = np.einsum("fk,fkx->fx", weights, mesh.vertices_m[mesh.faces])
    np.testing.assert_allclose(height_at(grid, inside_m[:, 0], inside_m[:, 1]), inside_m[:, 2], atol=1e-4)


def test_posts_can_be_lowered_for_curvature() -> None:
    grid = holed()
    drop_m = np.arange(48.0).reshape(6, 8)
    mesh, flat = grid_mesh(grid, lowered_m=drop_m), grid_mesh(grid)
    np.testing.assert_array_equal(mesh.faces, flat.faces)
    known = np.isfinite(grid.heights_m).ravel()
    np.testing.assert_allclose((flat.vertices_m - mesh.vertices_m)[known, 2], drop_m.ravel()[known])
    with pytest.raises(ElevationGridError, match="lowered_m must hold 6 × 8 finite numbers"):
        grid_mesh(grid, lowered_m=np.zeros((8, 6)))


@pytest.mark.parametrize("shape", [(1, 5), (5, 1), (1, 1)])
def test_a_profile_has_no_triangles(shape: tuple[int, int]) -> None:
    mesh = grid_mesh(ElevationGrid(np.ones(shape), 1.0, 1.0))
    assert mesh.faces.shape == (0, 3)
    assert mesh.vertices_m.shape == (5 if max(shape) == 5 else 1, 3)


def test_trimesh_takes_it_and_finds_the_same_ground_area() -> None:
    grid = fractal(20, cell_m=5.0)
    mesh = grid_mesh(grid)
    solid = trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
    assert solid.is_winding_consistent
    footprint = solid.area_faces * np.abs(solid.face_normals[:, 2])
    assert footprint.sum() == pytest.approx(19 * 19 * 25.0)
