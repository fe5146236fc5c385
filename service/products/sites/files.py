"""The files of maps of sites: rasters, the named sites as anchors that other questions take, pictures; their list."""

from __future__ import annotations

from pathlib import Path

from service.files.csv_table import TableWriter
from service.files.geojson import feature, place_of, write_collection
from service.files.layer import COG, GEOJSON, JSON, PNG, Layer
from service.parts.map_facts import altitude_datum_of
from service.products.in_common import Drawn, Later, Raster, common_tags

from .calculate import FinishedSiteMap

__all__ = ["LAYERS"]

SURELY_AND_IF_OPEN = ["surely", "only if unknown ground hides nothing"]


def _tags(finished: FinishedSiteMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished.grid, finished.answer, "sightline map of sites"),
        "site": f"{parameters.site_above_ground_m:g} m above ground",
        "receiver": f"{parameters.receiver_above_ground_m:g} m above ground",
    }


def _write_geojson(finished: FinishedSiteMap, path: Path) -> None:
    """Points in longitude and latitude; without a CRS in the DEM's local metres, and says so."""
    grid, features = finished.grid, []
    for site in finished.answer.sites:
        told = {
            "id": site.id,
            "altitude_m": site.altitude_m,
            **altitude_datum_of(grid),
            "seen_share": site.seen_share,
            "seen_m2": site.seen_m2,
        }
        features.append(feature("Point", place_of(grid, site.east_m, site.north_m), told, site.id))
    write_collection(grid, features, path, indent=1)


def _write_csv(finished: FinishedSiteMap, path: Path) -> None:
    """id, east_m, north_m, altitude_m and what that counts from, where it is known: a table of anchors."""
    datum = altitude_datum_of(finished.grid)
    with path.open("w", encoding="utf-8", newline="") as file:
        names = ["id", "east_m", "north_m", "altitude_m", *datum]
        TableWriter(file).rows(names, ({**site.model_dump(), **datum} for site in finished.answer.sites))


LAYERS = (
    Layer(
        "seen.tif",
        COG,
        "float32, share of the target ground that a site over the post sees. Band 1: surely. Band 2: what comes to it "
        "if unknown ground hides nothing. NaN (nodata) over unknown ground.",
        Raster(_tags, lambda one: [one.seen, one.seen_undecided], lambda _: SURELY_AND_IF_OPEN, "1"),
    ),
    Layer(
        "seen_from.tif",
        COG,
        "float32, share of the ground where sites may stand from which a receiver over the post is seen, in the same "
        "bands.",
        Raster(_tags, lambda one: [one.seen_from, one.from_undecided], lambda _: SURELY_AND_IF_OPEN, "1"),
    ),
    Layer("sites.geojson", GEOJSON, "The named sites as points, best first.", _write_geojson),
    Layer(
        "sites.csv",
        "text/csv; charset=utf-8",
        "The same as a table of anchors, which other questions take.",
        _write_csv,
    ),
    Layer(
        "map.png",
        PNG,
        "Picture: share of the target ground that each post sees, and the named sites.",
        Drawn("service.products.sites.picture:draw_sites"),
    ),
    Layer(
        "overlay.png",
        PNG,
        "The same as pixels to lay over a map, clear where no ground is known.",
        Later("service.products.sites.picture:write_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "Classes of both with colour and posts.",
        Later("service.products.sites.picture:write_legend"),
        for_screens=True,
    ),
)
