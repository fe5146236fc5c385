"""The surface on which the dilution is the limit, as a mesh that other programs open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

from service.errors import RequestError
from service.parts.ranging_sources import limit_of, lines_to
from service.parts.shapes_in_grid import air_layers
from terrain import ElevationGrid
from visibility import Isosurface, control_volume, isosurface

from .calculate import FinishedMorphingMap

__all__ = ["surface_of", "write_glb", "write_stl"]

# glTF's y is up and its z points south
ENU_TO_GLTF = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


def write_glb(finished: FinishedMorphingMap, path: Path) -> None:
    """Binary glTF; raises what surface_of raises."""
    mesh, origin_m = _mesh(finished)
    mesh.apply_transform(ENU_TO_GLTF)
    mesh.metadata["origin_east_north_altitude_m"] = list(origin_m)
    path.write_bytes(trimesh.Scene(mesh).export(file_type="glb"))


def write_stl(finished: FinishedMorphingMap, path: Path) -> None:
    """Binary STL; raises what surface_of raises."""
    path.write_bytes(_mesh(finished)[0].export(file_type="stl"))


def surface_of(finished: FinishedMorphingMap) -> Isosurface:
    """The surface in the grid's frame. Raises RequestError where there is none, VisibilityInputError beyond limits."""
    grid, parameters = finished.grid, finished.parameters
    lines = lines_to(grid, finished.anchors, parameters)
    layers = air_layers(grid, *parameters.ceiling(), layer_m=parameters.surface_layer_m)
    volume = control_volume(lines, layers, measure=parameters.measure, kind=parameters.kind)
    surface = isosurface(volume, limit_of(parameters))
    if not len(surface.faces):
        raise RequestError(
            f"There is no surface: the whole volume is on one side of {parameters.measure} {parameters.dop_limit:g}."
        )
    return surface


def _mesh(finished: FinishedMorphingMap) -> tuple[trimesh.Trimesh, tuple[float, float, float]]:
    """Near zero, because meshes hold float32, and where that zero lies."""
    surface = surface_of(finished)
    origin_m = _origin_m(finished.grid)
    return trimesh.Trimesh(surface.vertices_m - np.array(origin_m), surface.faces, process=False), origin_m


def _origin_m(grid: ElevationGrid) -> tuple[float, float, float]:
    west_m, south_m, _, _ = grid.bounds_m
    return west_m, south_m, 0.0
