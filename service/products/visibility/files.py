"""The layers of a visibility map."""

from __future__ import annotations

from service.files.layer import COG, GEOJSON, JSON, PNG, Layer, later

__all__ = ["VISIBILITY_LAYERS"]

OVERLAYS = "service.drawing.overlay"
RASTERS = "service.products.visibility.geotiff"

VISIBILITY_LAYERS = (
    Layer(
        "visible.tif",
        COG,
        "One uint8 band per anchor: 1 visible, 0 hidden, 255 (nodata) unknown, at the receiver height asked for.",
        later(RASTERS, "write_visible"),
    ),
    Layer(
        "min_visible_altitude.tif",
        COG,
        "One float32 band per anchor: lowest altitude in metres from which it is in sight; NaN (nodata) unknown, "
        "+inf at no altitude.",
        later(RASTERS, "write_min_visible_altitude"),
    ),
    Layer(
        "count.tif",
        COG,
        "Band 1: how many anchors are surely visible, nodata where the sight of every anchor is unknown. "
        "Band 2: how many are unknown.",
        later(RASTERS, "write_count"),
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the count over shaded relief, with anchors and legend.",
        later("service.pictures", "write_map_picture"),
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        later(OVERLAYS, "write_count_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        later(OVERLAYS, "write_count_legend"),
        for_screens=True,
    ),
    Layer(
        "arrays.npz",
        "application/x-npz",
        "All arrays for numpy: heights_m, visible, min_visible_altitude_m, count, unknown_count, positions.",
        later("service.products.visibility.arrays", "write_arrays"),
    ),
    Layer(
        "anchors.geojson",
        GEOJSON,
        "The anchors as points, with what part of the map sees each.",
        later("service.products.visibility.features", "write_anchors"),
    ),
)
