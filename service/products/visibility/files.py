"""The files of visibility maps: rasters, arrays, the anchors, pictures; and the list of all."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from service.files.geojson import feature, place_of, write_collection
from service.files.layer import COG, GEOJSON, JSON, KML, PNG, Layer
from service.files.mission_files import MISSIONS
from service.parts.map_facts import altitude_datum_of, dem_name
from service.products.in_common import BYTES, Drawn, Later, Raster, add_array, common_tags, write_cog
from service.products.visibility.calculate import VisibilityMap
from visibility import UNKNOWN, VISIBLE
from visibility.dilution import zones

__all__ = ["LAYERS", "write_anchors", "write_arrays", "write_count"]

# of what sees one anchor each, told apart in daylight
OUTLINES = ("#2c5f9e", "#d9480f", "#2e9e4f", "#8a2f8f", "#b98a00", "#00808a")
(KML_OF_MAP,) = MISSIONS["visibility-map"]
# told by the geometry and by the altitude that came of it
TWICE = {"above_ground_m"}  # an anchor has one height; with two a file would be refused when it is read
POSITION = {"east_m", "north_m", "lon_deg", "lat_deg", "body", "above_ground_m", "altitude_m", "altitude_datum"}


def write_count(finished: VisibilityMap, path: Path) -> None:
    """Band 1 anchors surely visible, nodata (largest value) where all are unknown; band 2 anchors unknown."""
    nodata = int(np.iinfo(finished.count.dtype).max)
    nothing_known = finished.unknown_count == len(finished.anchors)
    visible = np.where(nothing_known, finished.count.dtype.type(nodata), finished.count)
    tags = {**_tags(finished), "units": "anchors"}
    bands = (visible, finished.unknown_count)
    write_cog(path, finished.grid, bands, ["visible anchors", "unknown anchors"], nodata, tags, BYTES)


def write_arrays(finished: VisibilityMap, path: Path) -> None:
    """The arrays and what places them; read with numpy.load, no pickles in it."""
    grid = finished.grid
    arrays: dict[str, npt.NDArray[Any]] = {
        "heights_m": grid.heights_m,
        "visible": finished.visible,
        "min_visible_altitude_m": finished.altitude_m,
        "count": finished.count,
        "unknown_count": finished.unknown_count,
        "anchor_ids": np.array([anchor.id for anchor in finished.anchors]),
        "anchor_positions_m": np.array([(a.east_m, a.north_m, a.altitude_m) for a in finished.anchors]),
        "origin_m": np.array([grid.origin_east_m, grid.origin_north_m]),
        "cell_m": np.array([grid.cell_east_m, grid.cell_north_m]),
        "crs": np.array("" if grid.crs is None else grid.crs.to_wkt()),
    }
    # numpy's own compressed writer knows only the slow level 6
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            add_array(archive, name, array)


def write_anchors(finished: VisibilityMap, path: Path) -> None:
    """A FeatureCollection of points in longitude and latitude; without a CRS in the DEM's local metres, and says so.

    Its properties are those that ``--anchors`` reads, so the file can be the next request's input.
    """
    grid = finished.grid
    features = []
    for anchor, asked, found in zip(
        finished.anchors, finished.parameters.anchors, finished.answer.anchors, strict=True
    ):
        limits = asked.model_dump(exclude_none=True, exclude=POSITION)
        properties = {**found.model_dump(exclude=TWICE), **limits, "altitude_m": anchor.altitude_m} | altitude_datum_of(
            grid
        )
        features.append(feature("Point", place_of(grid, anchor.east_m, anchor.north_m), properties, anchor.id))
    write_collection(grid, features, path, indent=1)


def _ids(finished: VisibilityMap) -> list[str]:
    return [anchor.id for anchor in finished.anchors]


def _tags(finished: VisibilityMap) -> dict[str, str]:
    parameters = finished.parameters
    receiver = (
        f"{parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"at altitude {parameters.receiver_altitude_m:g} m"
    )
    told = common_tags(finished.grid, finished.answer, "sightline visibility map")
    return {**told, "receiver": receiver, "sight": parameters.sight}


def _write_kml(finished: VisibilityMap, path: Path) -> None:
    """The anchors, and in a folder each what sees them. Raises FrameError for a DEM without CRS."""
    from service.files.kml import ANCHORS, Mark, anchor_mark, write_kml  # its library takes a while to load

    grid = finished.grid
    anchors: list[Mark] = []
    seen: list[Mark] = []
    usable = finished.parameters.usable
    of, folder = ("usable from", "Ground where usable") if usable else ("in sight of", "Ground in sight")
    for number, (anchor, told) in enumerate(zip(finished.anchors, finished.answer.anchors, strict=True)):
        share = {"visible_share": told.visible_share}
        at_m = (anchor.east_m, anchor.north_m, anchor.altitude_m)
        anchors.append(anchor_mark(grid, anchor.id, at_m, told.above_ground_m, share))
        in_sight = zones(grid, finished.visible[number] == VISIBLE)
        outlines = [shapely.Polygon(zone.exterior, zone.holes) for zone in in_sight]
        if outlines:
            colour = OUTLINES[number % len(OUTLINES)]
            where = shapely.MultiPolygon(outlines)
            seen.append(Mark(f"{of} {anchor.id}", where, told=share, colour=colour, shown=not seen))
    write_kml(grid, f"Visibility: {dem_name(grid)}", {ANCHORS: anchors, folder: seen}, path)


LAYERS = (
    Layer(
        "visible.tif",
        COG,
        "One uint8 band per anchor: 1 visible, 0 hidden, 255 (nodata) unknown, at the receiver height asked for.",
        Raster(
            *(_tags, lambda finished: finished.visible, _ids),
            "class: 1 visible, 0 hidden, 255 unknown",
            nodata=int(UNKNOWN),
        ),
    ),
    Layer(
        "min_visible_altitude.tif",
        COG,
        "One float32 band per anchor: lowest altitude in metres from which it is in sight; NaN (nodata) unknown, "
        "+inf at no altitude.",
        Raster(*(_tags, lambda finished: finished.altitude_m, _ids), "metre", infinity="at no altitude"),
    ),
    Layer(
        "margin_db.tif",
        COG,
        "One float32 band per anchor: what arrives beyond the receiver's need, dB, at the receiver height asked for; "
        "usable from 0 on; NaN (nodata) unknown, -inf nothing arrives. Only where usable was asked for.",
        Raster(*(_tags, lambda finished: finished.margin_db, _ids), "dB", infinity="nothing arrives"),
        needs="sight",
        word="usable",
    ),
    Layer(
        "count.tif",
        COG,
        "Band 1: how many anchors are surely visible, nodata where the sight of every anchor is unknown. "
        "Band 2: how many are unknown.",
        write_count,
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the count over shaded relief, with anchors and legend.",
        Drawn("service.products.visibility.picture:draw_map"),
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        Later("service.products.visibility.picture:write_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        Later("service.products.visibility.picture:write_legend"),
        for_screens=True,
    ),
    Layer(
        "arrays.npz",
        "application/x-npz",
        "All arrays for numpy: heights_m, visible, min_visible_altitude_m, count, unknown_count, positions.",
        write_arrays,
    ),
    Layer("anchors.geojson", GEOJSON, "The anchors as points, with what part of the map sees each.", write_anchors),
    Layer(
        "map.kml",
        KML,
        "The anchors above mean sea level, and the outline of the ground that each sees; on Earth.",
        _write_kml,
        mission=KML_OF_MAP,
    ),
)
