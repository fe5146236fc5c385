"""Rasters of any size, written block row by block row and turned into cloud-optimised GeoTIFFs in the end."""

from __future__ import annotations

import math
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import rasterio
import rasterio.shutil
from rasterio.enums import Resampling
from rasterio.transform import Affine

from service.files.layer import COG, Layer
from visibility.sight.in_reach import Raster, Reach

from .answer import WindowMap
from .ground import posts_asked_about
from .parcels import Parcel

__all__ = ["BLOCK", "COUNT", "LAYERS", "LOWEST", "NOTHING", "UNITS", "combined", "to_cog", "unfinished_raster"]

COUNT, LOWEST = "count.tif", "min_visible_altitude.tif"
UNITS = {COUNT: {"units": "anchors"}, LOWEST: {"units": "metre", "infinity": "at no altitude"}}
BLOCK = 512
# in reach of no anchor, or nothing known
NOTHING = 255
CACHE_MB = 128

Pieces = Sequence[tuple[Parcel, npt.NDArray[np.float32], npt.NDArray[np.uint8], tuple[slice, slice]]]


@contextmanager
def unfinished_raster(
    dem: Raster, part: Reach, path: Path, dtype: str, nodata: float, descriptions: Sequence[str]
) -> Iterator[Any]:
    """A tiled GeoTIFF on part of a raster's posts, to be written by windows; blocks without anything take no room."""
    west_m = dem.origin_east_m + (part.first_col - 0.5) * dem.cell_east_m
    north_m = dem.origin_north_m - (part.first_row - 0.5) * dem.cell_north_m
    rows, cols = part.shape
    profile = {
        "driver": "GTiff", "height": rows, "width": cols, "count": len(descriptions), "dtype": dtype,
        "nodata": nodata,
        "crs": None if dem.crs is None else rasterio.crs.CRS.from_wkt(dem.crs.to_wkt()),
        "transform": Affine(dem.cell_east_m, 0.0, west_m, 0.0, -dem.cell_north_m, north_m),
        # not compressed: it is read once, and soon goes
        "tiled": True, "blockxsize": BLOCK, "blockysize": BLOCK,
        "sparse_ok": True, "bigtiff": "IF_SAFER", "interleave": "band",
    }  # fmt: skip
    with rasterio.Env(GDAL_CACHEMAX=CACHE_MB), rasterio.open(path, "w", **profile) as dataset:
        for number, description in enumerate(descriptions, 1):
            dataset.set_band_description(number, description)
        yield dataset


def to_cog(unfinished: Path, path: Path, tags: Mapping[str, str]) -> None:
    """The raster as a cloud-optimised GeoTIFF with overviews (nearest: classes stay classes); the unfinished goes."""
    options = {
        "compress": "ZSTD", "level": "1", "overview_resampling": "NEAREST", "bigtiff": "IF_SAFER", "blocksize": BLOCK,
        "sparse_ok": "YES", "num_threads": "ALL_CPUS",
    }  # fmt: skip
    with rasterio.Env(GDAL_CACHEMAX=CACHE_MB):
        with rasterio.open(unfinished, "r+") as dataset:
            dataset.update_tags(**tags)
            # where the driver makes them itself it packs them twice
            dataset.build_overviews(_halvings(dataset.shape), Resampling.nearest)
        rasterio.shutil.copy(unfinished, path, driver="COG", **options)
    unfinished.unlink()


def _made(name: str, finished: WindowMap, path: Path) -> None:
    """The raster, which the calculation has written, under another path."""
    made = Path(finished.folder) / name
    path.unlink(missing_ok=True)
    try:
        path.hardlink_to(made)
    except OSError:  # another disk
        shutil.copyfile(made, path)


LAYERS = (
    Layer(
        COUNT,
        COG,
        "Anchors in sight (uint8, 255 in reach of none or all unknown) and anchors in reach that are unknown.",
        partial(_made, COUNT),
    ),
    Layer(
        LOWEST,
        COG,
        "Lowest altitude from which an anchor is in sight, metres (float32): +inf at none, NaN unknown or in reach of "
        "none.",
        partial(_made, LOWEST),
    ),
)


def _halvings(shape: tuple[int, int]) -> list[int]:
    """How much coarser each overview is, to the first of one block."""
    count = math.ceil(math.log2(max(*shape, BLOCK) / BLOCK))
    return [2**level for level in range(1, count + 1)]


def combined(
    dem: Raster, block: Reach, pieces: Pieces
) -> tuple[npt.NDArray[np.uint8], npt.NDArray[np.uint8], npt.NDArray[np.float32]]:
    """(anchors in sight, anchors unknown, lowest altitude with one in sight) over a block, from what anchors see.

    pieces: the parcel, its altitudes and classes where its window and the block overlap, and where in the block that
    is. NOTHING, NOTHING and NaN where no anchor is in reach; NOTHING and NaN where all in reach are unknown.
    """
    shape = block.shape
    visible, unknown, in_reach = (np.zeros(shape, np.uint8) for _ in range(3))
    lowest_m = np.full(shape, np.nan, np.float32)
    for parcel, altitude_m, seen, (rows, cols) in pieces:
        first_row, first_col = block.first_row + rows.start, block.first_col + cols.start
        here = (first_row, first_row + seen.shape[0]), (first_col, first_col + seen.shape[1])
        within = posts_asked_about(dem, parcel.anchor, parcel.shape, *here)
        in_reach[rows, cols] += within
        visible[rows, cols] += within & (seen == 1)
        unknown[rows, cols] += within & (seen == NOTHING)
        part_m = lowest_m[rows, cols]
        np.fmin(part_m, altitude_m, out=part_m, where=within)
    visible[unknown == in_reach] = NOTHING
    unknown[in_reach == 0] = NOTHING
    return visible, unknown, lowest_m
