"""Cloud-optimised GeoTIFFs of a visibility map."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rasterio
from rasterio.transform import Affine

from service.visibility_map import VisibilityMap
from terrain import ElevationGrid
from visibility import UNKNOWN

__all__ = ["write_count", "write_min_visible_altitude", "write_visible"]

# A download waits for the writer: 1024² posts and 4 anchors take 0.03 s as bytes and 0.1 s as floats with these,
# against 0.3 s with DEFLATE floats. Nearest-neighbour overviews keep classes classes and infinities apart.
BYTES = {"compress": "DEFLATE", "level": "1"}
FLOATS = {"compress": "ZSTD", "level": "1"}


def write_visible(finished: VisibilityMap, path: Path) -> None:
    """uint8, a band per anchor: 1 visible, 0 hidden, 255 unknown (nodata)."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "class: 1 visible, 0 hidden, 255 unknown"}
    _write_cog(path, finished.grid, finished.visible, ids, int(UNKNOWN), tags, BYTES)


def write_min_visible_altitude(finished: VisibilityMap, path: Path) -> None:
    """float32 metres, a band per anchor: NaN unknown (nodata), +inf at no altitude."""
    ids = [anchor.id for anchor in finished.anchors]
    tags = {**_tags(finished), "units": "metre", "infinity": "in sight at no altitude"}
    _write_cog(path, finished.grid, finished.altitude_m, ids, float("nan"), tags, FLOATS)


def write_count(finished: VisibilityMap, path: Path) -> None:
    """Band 1 anchors surely visible, nodata (largest value) where all are unknown; band 2 anchors unknown."""
    nodata = int(np.iinfo(finished.count.dtype).max)
    nothing_known = finished.unknown_count == len(finished.anchors)
    visible = np.where(nothing_known, finished.count.dtype.type(nodata), finished.count)
    tags = {**_tags(finished), "units": "anchors"}
    bands = (visible, finished.unknown_count)
    _write_cog(path, finished.grid, bands, ["visible anchors", "unknown anchors"], nodata, tags, BYTES)


def _write_cog(
    path: Path,
    grid: ElevationGrid,
    bands: Iterable[npt.NDArray[Any]],
    descriptions: list[str],
    nodata: float,
    tags: dict[str, str],
    compression: dict[str, str],
) -> None:
    bands = list(bands)
    profile = {
        "driver": "COG",
        "height": grid.rows,
        "width": grid.cols,
        "count": len(bands),
        "dtype": bands[0].dtype,
        "nodata": nodata,
        "crs": None if grid.crs is None else rasterio.crs.CRS.from_wkt(grid.crs.to_wkt()),
        "transform": _transform(grid),
        "overview_resampling": "NEAREST",
        "bigtiff": "IF_SAFER",
        **compression,
    }
    with rasterio.open(path, "w", **profile) as dataset:
        for number, (band, description) in enumerate(zip(bands, descriptions, strict=True), start=1):
            dataset.write(band, number)
            dataset.set_band_description(number, description)
            if tags["units"] == "metre":
                dataset.set_band_unit(number, "metre")
        dataset.update_tags(**tags)


def _transform(grid: ElevationGrid) -> Affine:
    """Pixel corners to metres: posts are cell centres, so the corner of the first cell is half a cell out."""
    west_m = grid.origin_east_m - 0.5 * grid.cell_east_m
    north_m = grid.origin_north_m + 0.5 * grid.cell_north_m
    return Affine(grid.cell_east_m, 0.0, west_m, 0.0, -grid.cell_north_m, north_m)


def _tags(finished: VisibilityMap) -> dict[str, str]:
    parameters, calculation = finished.parameters, finished.calculation
    receiver = (
        f"{parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"at altitude {parameters.receiver_altitude_m:g} m"
    )
    return {
        "product": "sightline visibility map",
        "version": calculation.version,
        "mode": parameters.mode,
        "error_statement": calculation.error_statement,
        "curvature": calculation.curvature,
        "receiver": receiver,
        "dem_sha256": finished.grid.digest,
    }
