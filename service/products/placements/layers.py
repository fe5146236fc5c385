"""The layers of placements."""

from __future__ import annotations

from service.files.layer import COG, GEOJSON, PNG, Layer, later
from service.files.missions import MISSIONS

__all__ = ["PLACEMENT_LAYERS"]

RASTERS = "service.products.placements.rasters"
FILES = "service.products.placements.files"
PICTURES = "service.products.placements.picture"
PLANS, BEACONS = MISSIONS["placement"]

PLACEMENT_LAYERS = (
    Layer(
        "anchors.geojson", GEOJSON, "The placed anchors as points, with what each adds.", later(FILES, "write_geojson")
    ),
    Layer(
        "anchors.csv",
        "text/csv; charset=utf-8",
        "The placed anchors as a table that --anchors reads: metres in the DEM's CRS.",
        later(FILES, "write_csv"),
    ),
    Layer(
        "plans.zip",
        "application/zip",
        "A QGroundControl .plan file for each placed drone: take off, fly there, hold. On Earth.",
        later(FILES, "write_plans"),
        mission=PLANS,
    ),
    Layer(
        "beacons.parm",
        "text/plain; charset=utf-8",
        "ArduPilot parameters of the beacons' origin, and each beacon's offset from it in metres: true north, "
        "east, down. On Earth, above sea level.",
        later(FILES, "write_beacons"),
        mission=BEACONS,
    ),
    Layer(
        "count.tif",
        COG,
        "Band 1 how many anchors are surely in sight before, band 2 after; 255 (nodata) no ground.",
        later(RASTERS, "write_count"),
    ),
    Layer(
        "dop.tif",
        COG,
        "float32: dilution of precision, band 1 before, band 2 after; +inf no fix, NaN (nodata) unknown.",
        later(RASTERS, "write_dop"),
    ),
    Layer("map.png", PNG, "How many anchors are in sight after, over shaded relief.", later(PICTURES, "write_after")),
    Layer("before.png", PNG, "The same before.", later(PICTURES, "write_before")),
    Layer("dop.png", PNG, "The dilution of precision after, over shaded relief.", later(PICTURES, "write_dop_after")),
    Layer("dop_before.png", PNG, "The same before.", later(PICTURES, "write_dop_before")),
)
