"""The files of visibility maps: rasters, arrays, the anchors, pictures; and the list of all."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from service.files.arrays import add_array
from service.files.cog import BYTES, FLOATS, common_tags, write_cog
from service.files.geojson import write_collection
from service.files.layer import COG, GEOJSON, JSON, PNG, Layer
from service.parts.map_facts import altitude_datum_of
from service.products.visibility.calculate import VisibilityMap
from terrain import to_lon_lat
from visibility import UNKNOWN

__all__ = ["LAYERS", "write_anchors", "write_arrays", "write_count", "write_min_visible_altitude", "write_visible"]

# told by the geometry and by the altitude that came of it
TWICE = {"above_ground_m"}  # an anchor has one height; with two a file would be refused when it is read
POSITION = {"east_m", "north_m", "lon_deg", "lat_deg", "body", "above_ground_m", "altitude_m", "altitude_datum"}


def write_visible(finished: VisibilityMap, path: Path) -> None:
    """uint8, a band per anchor: 1 visible, 0 hidden, 255 unknown (nodata)."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "class: 1 visible, 0 hidden, 255 unknown"}
    write_cog(path, finished.grid, finished.visible, ids, int(UNKNOWN), tags, BYTES)


def write_min_visible_altitude(finished: VisibilityMap, path: Path) -> None:
    """float32 metres, a band per anchor: NaN unknown (nodata), +inf at no altitude."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "metre", "infinity": "in sight at no altitude"}
    write_cog(path, finished.grid, finished.altitude_m, ids, float("nan"), tags, FLOATS)


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
    features: list[dict[str, Any]] = []
    for anchor, asked, found in zip(
        finished.anchors, finished.parameters.anchors, finished.answer.anchors, strict=True
    ):
        position = (anchor.east_m, anchor.north_m)
        limits = asked.model_dump(exclude_none=True, exclude=POSITION)
        features.append(
            {
                "type": "Feature",
                "id": anchor.id,
                "geometry": {
                    "type": "Point",
                    "coordinates": position if grid.crs is None else to_lon_lat(grid, *position),
                },
                "properties": {
                    **found.model_dump(exclude={"above_ground_m"}),
                    **limits,
                    "altitude_m": anchor.altitude_m,
                    **altitude_datum_of(grid),
                },
            }
        )
    write_collection(grid, features, path, indent=1)


# matplotlib takes a second to load, and only a process that draws needs it


def _write_picture(finished: VisibilityMap, path: Path) -> None:
    from .picture import write_map_picture

    write_map_picture(finished, path)


def _write_overlay(finished: VisibilityMap, path: Path) -> None:
    from .picture import write_count_overlay

    write_count_overlay(finished, path)


def _write_legend(finished: VisibilityMap, path: Path) -> None:
    from .picture import write_count_legend

    write_count_legend(finished, path)


def _tags(finished: VisibilityMap) -> dict[str, str]:
    parameters = finished.parameters
    receiver = (
        f"{parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"at altitude {parameters.receiver_altitude_m:g} m"
    )
    return {**common_tags(finished.grid, finished.answer, "sightline visibility map"), "receiver": receiver}


LAYERS = (
    Layer(
        "visible.tif",
        COG,
        "One uint8 band per anchor: 1 visible, 0 hidden, 255 (nodata) unknown, at the receiver height asked for.",
        write_visible,
    ),
    Layer(
        "min_visible_altitude.tif",
        COG,
        "One float32 band per anchor: lowest altitude in metres from which it is in sight; NaN (nodata) unknown, "
        "+inf at no altitude.",
        write_min_visible_altitude,
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
        _write_picture,
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        _write_overlay,
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        _write_legend,
        for_screens=True,
    ),
    Layer(
        "arrays.npz",
        "application/x-npz",
        "All arrays for numpy: heights_m, visible, min_visible_altitude_m, count, unknown_count, positions.",
        write_arrays,
    ),
    Layer(
        "anchors.geojson",
        GEOJSON,
        "The anchors as points, with what part of the map sees each.",
        write_anchors,
    ),
)
