"""The layers of planned paths."""

from __future__ import annotations

from service.files.layer import GEOJSON, PNG, Layer, later
from service.files.missions import MISSIONS

__all__ = ["PATH_LAYERS"]

FILES = "service.products.paths.files"
WRITERS = "service.products.paths.missions"
FOUND = "found"
GPX, PLAN = MISSIONS["path"]

PATH_LAYERS = (
    Layer(
        "path.geojson",
        GEOJSON,
        "The path as a LineString with totals, and each vertex as a point with what holds there; without a path the "
        "start, the goals and where the way is cut.",
        later(FILES, "write_geojson"),
    ),
    Layer(
        "path.csv",
        "text/csv; charset=utf-8",
        "A row per vertex: metres in the DEM's CRS, degrees, seconds, anchors in sight, dilution, margin.",
        later(FILES, "write_csv"),
        status=FOUND,
    ),
    Layer(
        "path.gpx",
        "application/gpx+xml",
        "The path as a GPX 1.1 track with altitudes and seconds from its start, a route of its corners. On Earth; "
        "without altitudes where the DEM counts from an ellipsoid.",
        later(WRITERS, "write_gpx"),
        status=FOUND,
        mission=GPX,
    ),
    Layer(
        "path.plan",
        "application/json",
        "The corners of the path as a QGroundControl mission for a rover. On Earth.",
        later(WRITERS, "write_plan"),
        status=FOUND,
        mission=PLAN,
    ),
    Layer(
        "map.png",
        PNG,
        "The path over shaded relief with the dilution of precision and the ground that may not be driven.",
        later("service.products.paths.picture", "write_path_picture"),
    ),
    Layer(
        "profile.png",
        PNG,
        "Height, slope, anchors in sight, dilution and clearances along the path.",
        later("service.products.paths.profile", "write_profile"),
        status=FOUND,
    ),
)
