"""The layers of DOP maps and of morphing maps."""

from __future__ import annotations

from .layer import COG, GEOJSON, PNG, Layer, later

__all__ = ["DOP_LAYERS", "MORPHING_LAYERS"]

RASTERS = "service.layers.positioning_rasters"
ZONES = "service.layers.zones"

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
        "map.png",
        PNG,
        "A picture of the height above ground from which one may fly, over shaded relief.",
        later("service.pictures", "write_morphing_picture"),
    ),
)
