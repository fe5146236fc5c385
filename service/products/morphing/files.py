"""The files of morphing maps: rasters, zones, and the list of all."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np

from service.errors import RequestError
from service.files.geojson import write_contours, write_no_go_zones
from service.files.layer import COG, GEOJSON, PNG, Layer
from service.parts.ranging_sources import limit_of, lines_to
from service.parts.shapes_in_grid import air_layers
from service.products.in_common import Drawn, Later, Raster, common_tags
from visibility import control_volume
from visibility.air import ColumnState, Isosurface, isosurface

from .calculate import FinishedMorphingMap
from .frames import AVAILABLE_BANDS, available_at, frame_words

__all__ = ["LAYERS", "surface_of"]

# glTF's y is up and its z points south
ENU_TO_GLTF = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
STATES = "class: " + ", ".join(f"{state.value} {state.name.lower()}" for state in ColumnState)
FLAGS = ["state", "no-flight intervals"]  # every value says something, also those of unknown air
AVAILABLE = [name.replace("_", " ").removesuffix(" s") for name in AVAILABLE_BANDS]


def _write_mesh(finished: FinishedMorphingMap, path: Path, file_type: Literal["glb", "stl"]) -> None:
    """Binary glTF or STL of the surface, less an origin because meshes hold float32. Raises what surface_of raises."""
    import trimesh  # takes a second to load

    surface = surface_of(finished)
    west_m, south_m, _, _ = finished.grid.bounds_m
    origin_m = west_m, south_m, 0.0
    mesh = trimesh.Trimesh(surface.vertices_m - np.array(origin_m), surface.faces, process=False)
    if file_type == "glb":
        mesh.apply_transform(ENU_TO_GLTF)
        mesh.metadata["origin_east_north_altitude_m"] = list(origin_m)
    whole = trimesh.Scene(mesh) if file_type == "glb" else mesh
    path.write_bytes(whole.export(file_type=file_type))


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


def _available_tags(finished: FinishedMorphingMap) -> dict[str, str]:
    assert finished.parameters.frames is not None, "the layer needs frames"
    ((height, metres),) = available_at(finished.parameters, finished.parameters.frames).items()
    return {**_tags(finished), "available_at": f"{height.removesuffix('_m').replace('_', ' ')} {metres:g} m"}


def _frames(finished: FinishedMorphingMap) -> list[str]:
    return frame_words(finished.parameters)


def _tags(finished: FinishedMorphingMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished.grid, finished.answer, "sightline morphing map"),
        "ceiling": finished.ceiling_words(),
        "kind": parameters.kind,
        "measure": parameters.measure,
        "dop_limit": f"{parameters.dop_limit:g}",
    }


LAYERS = (
    Layer(
        "altitude.tif",
        COG,
        "float32 metres: the altitude above which positioning is good enough up to the ceiling; NaN (nodata) where "
        "there is none, see flags.tif.",
        Raster(_tags, lambda finished: [finished.altitude_m], lambda _: ["flyable above"], "metre"),
    ),
    Layer(
        "above_ground.tif",
        COG,
        "float32 metres: the same as a height above the ground.",
        Raster(_tags, lambda finished: [finished.above_ground_m], lambda _: ["flyable above, over ground"], "metre"),
    ),
    Layer(
        "flags.tif",
        COG,
        "Band 1: state, 0 flyable nowhere, 1 from the ground up, 2 from a height up (altitude.tif), 3 closed at the "
        "ceiling, 4 ground above the ceiling, 255 unknown. Band 2: how many separate stretches of no-flight air.",
        Raster(
            *(_tags, lambda finished: (finished.state, finished.no_flight_intervals), lambda _: FLAGS), *(STATES, None)
        ),
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts where a rover's antenna on the ground is in no-flight air, with their area.",
        lambda finished, path: write_no_go_zones(finished.grid, finished.no_go, finished.parameters, path),
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution at a rover's antenna is the limit, half of it and twice as much.",
        lambda finished, path: write_contours(finished.grid, finished.dop, finished.parameters, path),
    ),
    Layer(
        "surface.glb",
        "model/gltf-binary",
        "The surface on which the dilution is the limit, overhangs included, as triangles in metres from the origin "
        "that the mesh's extras name; y is up, x east.",
        partial(_write_mesh, file_type="glb"),
    ),
    Layer(
        "surface.stl",
        "model/stl",
        "The same as binary STL: x east, y north, z altitude, metres from the DEM's south-west post; z from 0.",
        partial(_write_mesh, file_type="stl"),
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the height above ground from which one may fly, over shaded relief.",
        Drawn("service.products.morphing.picture:draw_morphing_map"),
    ),
    Layer(
        "frames_altitude.tif",
        COG,
        "float32 metres, a band for each frame: what altitude.tif is then.",
        Raster(_tags, lambda finished: finished.frame_altitude_m, _frames, "metre"),
        needs="frames",
    ),
    Layer(
        "frames_state.tif",
        COG,
        "uint8, a band for each frame: what band 1 of flags.tif is then.",
        Raster(_tags, lambda finished: finished.frame_state, _frames, STATES, None),
        needs="frames",
    ),
    Layer(
        "availability.tif",
        COG,
        "float64: the first and last frame at which a place is in flyable air, from when to when the longest run of "
        "such frames lasts, all in seconds, NaN never; share of frames at which it is, and at which that is unknown.",
        Raster(_available_tags, lambda finished: finished.available, lambda _: AVAILABLE, "second; shares 0..1"),
        needs="frames",
    ),
    Layer(
        "availability.png",
        PNG,
        "A picture of the share of the time at which each place is in flyable air, over shaded relief.",
        Drawn("service.products.morphing.picture:draw_availability"),
        needs="frames",
    ),
    Layer(
        "animation.gif",
        "image/gif",
        "The picture of map.png, frame by frame, with anchors where they are then.",
        Later("service.products.morphing.picture:write_animation"),
        needs="frames",
    ),
)
