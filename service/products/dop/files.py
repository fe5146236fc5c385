"""The layers of DOP maps and of morphing maps."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from service.files.layer import COG, GEOJSON, JSON, PNG, Layer, later
from service.parts.volumes import MOST_CUTS
from service.products.dop.calculate import FinishedDopMap

__all__ = ["DOP_LAYERS", "MORPHING_LAYERS"]

OVERLAYS = "service.drawing.overlay"
RASTERS = "service.products.dop.rasters"
ZONES = "service.products.dop.zones"
MESHES = "service.products.dop.meshes"
VOLUMES = "service.products.dop.volume_files"
CSV = "text/csv; charset=utf-8"
GEOTIFF = "image/tiff; application=geotiff"


def _write_cut(number: int, finished: FinishedDopMap, path: Path) -> None:
    from service.products.dop.cut_picture import write_cut_picture

    write_cut_picture(finished, number, path)


DOP_LAYERS = (
    Layer(
        "dop.tif",
        COG,
        "float32: the dilution of precision asked for; +inf no fix, NaN (nodata) unknown.",
        later(RASTERS, "write_dop"),
    ),
    Layer(
        "count.tif",
        COG,
        "How many anchors are surely in sight, nodata (largest value) where that is unknown.",
        later(RASTERS, "write_count_of_dop"),
    ),
    Layer(
        "position_error.tif",
        COG,
        "float32 metres, one sigma: position error horizontally, vertically and in space, from the sigmas of ranges "
        "and poses; +inf no fix, NaN (nodata) unknown.",
        later(RASTERS, "write_position_error"),
    ),
    Layer(
        "no_go.tif",
        COG,
        "uint8: 1 where the dilution is the limit or more, or too few anchors are in sight; 0 elsewhere; 255 (nodata) "
        "unknown.",
        later(RASTERS, "write_no_go"),
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts of no_go.tif that are 1, with their area.",
        later(ZONES, "write_no_go_zones"),
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution is the limit, half of it and twice as much.",
        later(ZONES, "write_contours"),
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the dilution over shaded relief, with the line of the limit, anchors and legend.",
        later("service.pictures", "write_dop_picture"),
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        later(OVERLAYS, "write_dop_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        later(OVERLAYS, "write_dop_legend"),
        for_screens=True,
    ),
    Layer(
        "path.csv",
        CSV,
        "A line for each point of the path: metres, ids in sight, dilutions, one-sigma position errors in metres.",
        later("service.products.paths.table", "write_path"),
        needs="path",
    ),
    *(
        Layer(
            f"cut-{number}.png",
            PNG,
            f"A picture of cut {number}: anchors in sight and the dilution, with the ground.",
            partial(_write_cut, number - 1),
            needs="cuts",
            at_least=number,
        )
        for number in range(1, MOST_CUTS + 1)
    ),
    Layer(
        "volume_dop.tif",
        GEOTIFF,
        "float32, a band for each layer of the volume, the lowest first: the dilution; +inf no fix, NaN (nodata) "
        "unknown.",
        later(VOLUMES, "write_volume_dop"),
        needs="volume",
    ),
    Layer(
        "volume_count.tif",
        GEOTIFF,
        "A band for each layer of the volume: how many anchors are surely in sight, nodata (largest value) where that "
        "of some is unknown.",
        later(VOLUMES, "write_volume_count"),
        needs="volume",
    ),
    Layer(
        "volume.npz",
        "application/x-npz",
        "Arrays over layers, rows and columns for numpy: dilution, count, and the visible set as bits, anchor a being "
        "bit a % 64 of word a // 64.",
        later(VOLUMES, "write_volume_arrays"),
        needs="volume",
    ),
    Layer(
        "volume.nc",
        "application/x-netcdf",
        "The same as NetCDF with coordinates and CRS, as xarray opens it.",
        later(VOLUMES, "write_volume_dataset"),
        needs="volume",
    ),
)

MORPHING_LAYERS = (
    Layer(
        "altitude.tif",
        COG,
        "float32 metres: the altitude above which positioning is good enough up to the ceiling; NaN (nodata) where "
        "there is none, see flags.tif.",
        later(RASTERS, "write_altitude"),
    ),
    Layer(
        "above_ground.tif",
        COG,
        "float32 metres: the same as a height above the ground.",
        later(RASTERS, "write_above_ground"),
    ),
    Layer(
        "flags.tif",
        COG,
        "Band 1: state, 0 flyable nowhere, 1 from the ground up, 2 from altitude.tif up, 3 closed at the ceiling, "
        "4 ground above the ceiling, 255 unknown. Band 2: how many separate stretches of no-flight air.",
        later(RASTERS, "write_flags"),
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts where a rover's antenna on the ground is in no-flight air, with their area.",
        later(ZONES, "write_no_go_zones"),
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution at a rover's antenna is the limit, half of it and twice as much.",
        later(ZONES, "write_contours"),
    ),
    Layer(
        "surface.glb",
        "model/gltf-binary",
        "The surface on which the dilution is the limit, overhangs included, as triangles in metres from the origin "
        "that the mesh's extras name; y is up, x east.",
        later(MESHES, "write_glb"),
    ),
    Layer(
        "surface.stl",
        "model/stl",
        "The same as binary STL: x east, y north, z altitude, metres from the DEM's south-west post; z from 0.",
        later(MESHES, "write_stl"),
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the height above ground from which one may fly, over shaded relief.",
        later("service.pictures", "write_morphing_picture"),
    ),
    Layer(
        "frames_altitude.tif",
        COG,
        "float32 metres, a band for each frame: what altitude.tif is then.",
        later(RASTERS, "write_frames_altitude"),
        needs="frames",
    ),
    Layer(
        "frames_state.tif",
        COG,
        "uint8, a band for each frame: what band 1 of flags.tif is then.",
        later(RASTERS, "write_frames_state"),
        needs="frames",
    ),
    Layer(
        "availability.tif",
        COG,
        "float64: the first and last frame at which a place is in flyable air, from when to when the longest run of "
        "such frames lasts, all in seconds, NaN never; share of frames at which it is, and at which that is unknown.",
        later(RASTERS, "write_availability"),
        needs="frames",
    ),
    Layer(
        "availability.png",
        PNG,
        "A picture of the share of the time at which each place is in flyable air, over shaded relief.",
        later("service.products.morphing.frame_pictures", "write_availability_picture"),
        needs="frames",
    ),
    Layer(
        "animation.gif",
        "image/gif",
        "The picture of map.png, frame by frame, with anchors where they are then.",
        later("service.products.morphing.frame_pictures", "write_animation"),
        needs="frames",
    ),
)
