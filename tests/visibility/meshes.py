"""Box-shaped buildings and level ground that the tests of buildings share."""

import numpy as np
import trimesh

from terrain import ElevationGrid
from visibility import Buildings

FORMATS = ["stl", "obj", "ply", "glb"]


def level(height_m=0.0, rows=41, cols=61, cell_m=5.0):
    return ElevationGrid(np.full((rows, cols), height_m, np.float32), cell_m, cell_m)


def box(east_m, north_m, width_m=20.0, depth_m=20.0, top_m=10.0, base_m=0.0):
    mesh = trimesh.creation.box((width_m, depth_m, top_m - base_m))
    mesh.apply_translation((east_m, north_m, (top_m + base_m) / 2.0))
    return mesh


def as_buildings(mesh):
    return Buildings(mesh.vertices, mesh.faces, "box")


def write(tmp_path, mesh, suffix):
    path = tmp_path / f"city.{suffix}"
    if suffix == "glb":  # that format's up is y, its north -z
        mesh = mesh.copy()
        mesh.apply_transform(np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], float))
    path.write_bytes(mesh.export(file_type=suffix) if suffix != "obj" else mesh.export(file_type="obj").encode())
    return path


def extent(buildings):
    return np.concatenate([buildings.vertices_m.min(axis=0), buildings.vertices_m.max(axis=0)])
