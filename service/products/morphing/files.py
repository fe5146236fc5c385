"""The files of morphing maps: rasters, zones, and the list of all."""

from __future__ import annotations

from pathlib import Path

from service.files.geojson import write_contours, write_no_go_zones
from service.files.layer import COG, GEOJSON, PNG, Layer
from service.files.rasters import BYTES, FLOATS, common_tags, write_cog
from visibility import ColumnState

from .calculate import FinishedMorphingMap
from .frames import AVAILABLE_BANDS, available_at, frame_words

__all__ = ["LAYERS"]


def write_altitude(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres: altitude above which all is flyable up to the ceiling; NaN (nodata) where there is none."""
    tags = {**_tags(finished), "units": "metre"}
    write_cog(path, finished.grid, [finished.altitude_m], ["flyable above"], float("nan"), tags, FLOATS)


def write_above_ground(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres: the same as a height above the ground."""
    tags = {**_tags(finished), "units": "metre"}
    bands = [finished.above_ground_m]
    write_cog(path, finished.grid, bands, ["flyable above, over ground"], float("nan"), tags, FLOATS)


def write_flags(finished: FinishedMorphingMap, path: Path) -> None:
    """uint8: state of each column of air, and how many stretches of no-flight air it has."""
    tags = {**_tags(finished), "units": _states()}
    bands = (finished.state, finished.no_flight_intervals)
    # every value says something, also those of unknown air
    write_cog(path, finished.grid, bands, ["state", "no-flight intervals"], None, tags, BYTES)


def write_frames_altitude(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres, a band per frame: NaN (nodata) where there is none."""
    tags = {**_tags(finished), "units": "metre"}
    bands = finished.frame_altitude_m
    write_cog(path, finished.grid, bands, frame_words(finished.parameters), float("nan"), tags, FLOATS)


def write_frames_state(finished: FinishedMorphingMap, path: Path) -> None:
    """uint8, a band per frame: state of each column of air."""
    tags = {**_tags(finished), "units": _states()}
    write_cog(
        path,
        finished.grid,
        finished.frame_state,
        frame_words(finished.parameters),
        None,
        tags,
        BYTES,
    )


def write_availability(finished: FinishedMorphingMap, path: Path) -> None:
    """float64: seconds of the first, last and longest availability, NaN (nodata) never; shares of the frames."""
    assert finished.parameters.frames is not None, "the layer needs frames"
    ((height, metres),) = available_at(finished.parameters, finished.parameters.frames).items()
    where = {"available_at": f"{height.removesuffix('_m').replace('_', ' ')} {metres:g} m"}
    tags = {**_tags(finished), **where, "units": "second; shares 0..1"}
    names = [name.replace("_", " ").removesuffix(" s") for name in AVAILABLE_BANDS]
    write_cog(path, finished.grid, finished.available, names, float("nan"), tags, FLOATS)


def _write_zones(finished: FinishedMorphingMap, path: Path) -> None:
    write_no_go_zones(finished.grid, finished.no_go, finished.parameters, path)


def _write_contours(finished: FinishedMorphingMap, path: Path) -> None:
    write_contours(finished.grid, finished.dop, finished.parameters, path)


# matplotlib and trimesh take a second to load, and only a process that draws or writes meshes needs them


def _write_picture(finished: FinishedMorphingMap, path: Path) -> None:
    from .picture import write_morphing_picture

    write_morphing_picture(finished, path)


def _write_glb(finished: FinishedMorphingMap, path: Path) -> None:
    from .meshes import write_glb

    write_glb(finished, path)


def _write_stl(finished: FinishedMorphingMap, path: Path) -> None:
    from .meshes import write_stl

    write_stl(finished, path)


def _write_availability_picture(finished: FinishedMorphingMap, path: Path) -> None:
    from .frame_pictures import write_availability_picture

    write_availability_picture(finished, path)


def _write_animation(finished: FinishedMorphingMap, path: Path) -> None:
    from .frame_pictures import write_animation

    write_animation(finished, path)


def _states() -> str:
    return "class: " + ", ".join(f"{state.value} {state.name.lower()}" for state in ColumnState)


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
        write_altitude,
    ),
    Layer(
        "above_ground.tif",
        COG,
        "float32 metres: the same as a height above the ground.",
        write_above_ground,
    ),
    Layer(
        "flags.tif",
        COG,
        "Band 1: state, 0 flyable nowhere, 1 from the ground up, 2 from altitude.tif up, 3 closed at the ceiling, "
        "4 ground above the ceiling, 255 unknown. Band 2: how many separate stretches of no-flight air.",
        write_flags,
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts where a rover's antenna on the ground is in no-flight air, with their area.",
        _write_zones,
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution at a rover's antenna is the limit, half of it and twice as much.",
        _write_contours,
    ),
    Layer(
        "surface.glb",
        "model/gltf-binary",
        "The surface on which the dilution is the limit, overhangs included, as triangles in metres from the origin "
        "that the mesh's extras name; y is up, x east.",
        _write_glb,
    ),
    Layer(
        "surface.stl",
        "model/stl",
        "The same as binary STL: x east, y north, z altitude, metres from the DEM's south-west post; z from 0.",
        _write_stl,
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the height above ground from which one may fly, over shaded relief.",
        _write_picture,
    ),
    Layer(
        "frames_altitude.tif",
        COG,
        "float32 metres, a band for each frame: what altitude.tif is then.",
        write_frames_altitude,
        needs="frames",
    ),
    Layer(
        "frames_state.tif",
        COG,
        "uint8, a band for each frame: what band 1 of flags.tif is then.",
        write_frames_state,
        needs="frames",
    ),
    Layer(
        "availability.tif",
        COG,
        "float64: the first and last frame at which a place is in flyable air, from when to when the longest run of "
        "such frames lasts, all in seconds, NaN never; share of frames at which it is, and at which that is unknown.",
        write_availability,
        needs="frames",
    ),
    Layer(
        "availability.png",
        PNG,
        "A picture of the share of the time at which each place is in flyable air, over shaded relief.",
        _write_availability_picture,
        needs="frames",
    ),
    Layer(
        "animation.gif",
        "image/gif",
        "The picture of map.png, frame by frame, with anchors where they are then.",
        _write_animation,
        needs="frames",
    ),
)
