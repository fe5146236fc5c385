"""Small DEM files made for one test."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rasterio
from rasterio.errors import NotGeoreferencedWarning

SHARED_DEMS = Path(__file__).parents[2] / "../shared/data/dem"
needs_shared = pytest.mark.skipif(
    not SHARED_DEMS.is_dir(), reason="the DEMs made by others (../shared/data) are absent"
)
UTM_32N = "EPSG:32632"


def hill(rows: int = 12, cols: int = 15) -> np.ndarray:
    """Heights (rows, cols) float32 that no flip leaves as they are."""
    row, col = np.mgrid[0:rows, 0:cols]
    return (500.0 + 7.0 * row + 3.0 * col + 40.0 * np.exp(-((row - 3.0) ** 2 + (col - 5.0) ** 2) / 9.0)).astype("f4")


def write_tif(path: Path, heights: Any, **profile: Any) -> Path:
    """A GeoTIFF of heights (rows, cols) or (bands, rows, cols); UTM, 10 m cells, NW corner at 500 000 E 5 000 000 N."""
    heights = np.asarray(heights)
    bands = heights if heights.ndim == 3 else heights[None]
    tags = profile.pop("tags", {})
    settable = {key: profile.pop(key) for key in ("scales", "offsets", "units", "colorinterp") if key in profile}
    settings = {
        "driver": "GTiff", "count": bands.shape[0], "height": bands.shape[1], "width": bands.shape[2],
        "dtype": bands.dtype.name, "crs": UTM_32N, "transform": rasterio.Affine(10, 0, 500_000, 0, -10, 5_000_000),
    } | profile  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NotGeoreferencedWarning)  # some files are made without on purpose
        with rasterio.open(path, "w", **settings) as dataset:
            for key, value in settable.items():
                setattr(dataset, key, value)
            dataset.update_tags(**tags)
            dataset.write(bands)
    return path


def write_asc(path: Path, heights: np.ndarray, cell: float = 10.0, nodata: float | None = None) -> Path:
    """An ESRI ASCII grid with its lower left corner at (100, 200)."""
    rows, cols = heights.shape
    head = [f"ncols {cols}", f"nrows {rows}", "xllcorner 100", "yllcorner 200", f"cellsize {cell}"]
    head += [] if nodata is None else [f"NODATA_value {nodata:g}"]
    path.write_text("\n".join([*head, *(" ".join(f"{value:.3f}" for value in row) for row in heights), ""]))
    return path


def sentences(*texts: str) -> str:
    """All of a grid's warnings or conversions as one text."""
    return " ".join(texts)
