"""Rasters on disk that are read by windows, and anchors with a range limit over them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rasterio
from rasterio import Affine
from scipy import ndimage

from service.products.visibility.request import VisibilityMapParameters

POSTS, CELL_M, WEST_M, NORTH_M = 1200, 5.0, 400_000.0, 4_000_000.0
# (east, south of the corner, range), metres: two overlap, one at the border, one beyond it, one far beyond
PLACES = {
    "A": (1500.0, 1700.0, 900.0),
    "B": (2300.0, 1500.0, 1100.0),
    "C": (10.0, 3000.0, 700.0),
    "D": (4000.0, 5800.0, 600.0),
}


def hills_m(posts: int = POSTS, seed: int = 2) -> npt.NDArray[np.float32]:
    """Hills of many sizes with some unknown ground."""
    rng = np.random.default_rng(seed)
    heights_m = np.full((posts, posts), 500.0)
    for k in range(2, 8):
        step = 2**k
        coarse = rng.normal(0.0, 1.2 * step, (posts // step + 3,) * 2)
        heights_m += ndimage.zoom(coarse, step, order=1)[:posts, :posts]
    heights_m[340:365, 400:440] = np.nan
    return heights_m.astype(np.float32)


def write_cog(path: Path, heights_m: npt.NDArray[np.float32], crs: str | None = "EPSG:32611", **more: Any) -> Path:
    """A COG of float32 heights."""
    rows, cols = heights_m.shape
    west_m, north_m = WEST_M - CELL_M / 2.0, NORTH_M + CELL_M / 2.0
    profile = {
        "driver": "COG", "height": rows, "width": cols, "count": 1, "dtype": "float32", "nodata": float("nan"),
        "crs": crs, "transform": Affine(CELL_M, 0.0, west_m, 0.0, -CELL_M, north_m), "compress": "DEFLATE", **more,
    }  # fmt: skip
    with rasterio.open(path, "w", **profile) as file:
        file.write(heights_m, 1)
    return path


def anchors(**changes: Any) -> list[dict[str, Any]]:
    """As in requests."""
    return [
        {
            "id": name,
            "east_m": WEST_M + east_m,
            "north_m": NORTH_M - south_m,
            "above_ground_m": 40.0,
            "max_range_m": range_m,
            **changes,
        }
        for name, (east_m, south_m, range_m) in PLACES.items()
    ]


def parameters(some: list[dict[str, Any]] | None = None, **changes: Any) -> VisibilityMapParameters:
    """The request."""
    asked = {"anchors": anchors() if some is None else some, "receiver_above_ground_m": 1.5, **changes}
    return VisibilityMapParameters.model_validate(asked)
