"""read_dem: from a file to a grid in metres, telling everything that was changed or guessed on the way."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj

from ..crs.frames import datum_doubt
from ..crs.parts import horizontal_part, vertical_part
from ..crs.texts import parse_crs
from ..datums.conversion import with_vertical_datum
from ..datums.references import parse_vertical_datum
from ..errors import DemReadError, DemUnsupportedError, ElevationGridError
from ..grid import ElevationGrid, Provenance
from ..heights import Heights, heights_of
from ..limits import DEFAULT_MAX_CELLS
from ..units import HEIGHT_UNITS
from ..voids import implausible_heights, unknown_posts
from .arrays import read_npy, read_npz
from .formats import local_file, sniff_format
from .overviews import POSTS, level_for
from .placing import Placed, place
from .raster import read_raster
from .raw import PostWindow, RawDem

__all__ = ["grid_of", "heights_in_metres", "horizontal_target", "read_dem", "read_part"]


def read_dem(
    path: str | os.PathLike[str],
    *,
    nodata: float | None = None,
    crs: Any = None,
    height_unit: str | None = None,
    target_crs: Any = None,
    cell_m: float | tuple[float, float] | None = None,
    resolution_m: float | None = None,
    band: int | None = None,
    vertical_datum: str | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> ElevationGrid:
    """Read a DEM file: GeoTIFF or COG, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy.

    The grid is north-up and in metres; ``provenance`` tells each conversion and each warning as a sentence.

    nodata: the value, as it stands in the file, that means "unknown", in place of what the file declares (nan: none).
    crs: CRS of the file's positions, for files without one; "local" for metres without a place on a planet. Where it
        has a vertical part, heights are in its unit and above its datum.
    height_unit: "m", "ft", "us-ft", "dm", "cm", "mm" or "km", in place of what the file and crs declare.
    target_crs: metric CRS of the grid; without it the file's own where that measures metres truly, else a local one.
    cell_m: metres between posts, one number or (east, north), for files that do not tell.
    resolution_m: read the coarsest overview in the file whose cells are no coarser, in place of the posts, where it has
        one; which it was is told.
    band: which band holds the heights, from 1; without it the first.
    vertical_datum: what heights count from in the grid: "msl", "hae", "EGM96", "EGM2008", or a vertical CRS that PROJ
        knows. Heights above another datum are brought to it; those of a file that does not tell are taken as above it.
    max_cells: a larger raster is refused before its pixels are read.
    Raises DemReadError (DemFormatError, DemTooLargeError, DemUnsupportedError), FrameError for an unknown CRS,
    VerticalDatumError for a datum that heights cannot be brought to.
    """
    wanted = None if vertical_datum is None else parse_vertical_datum(vertical_datum)
    if height_unit is not None and height_unit not in HEIGHT_UNITS:
        raise DemReadError(f"height_unit must be one of {', '.join(HEIGHT_UNITS)}, not {height_unit!r}.")
    file = local_file(path)
    given = None if crs is None or (isinstance(crs, str) and crs == "local") else parse_crs(crs)
    target = None if target_crs is None else horizontal_target(target_crs)
    driver = sniff_format(file)
    level, told = level_for(file, driver, resolution_m, given)
    raw = _read_raw(file, driver, _cell_pair(cell_m), band, max_cells, level)
    heights = heights_of(file.name, raw, unit=height_unit, given=given)
    void, void_warnings = unknown_posts(file.name, raw, factor=heights.factor, offset_m=heights.offset_m, nodata=nodata)
    conversions = [*([told] if told else []), *raw.conversions, *heights.conversions]
    warnings = [*raw.warnings, *heights.warnings, *void_warnings]
    heights_m = heights_in_metres(raw, void, heights)
    placed = place(
        file.name, raw, heights_m,
        crs="local" if crs is not None and given is None else None if given is None else horizontal_part(given),
        target_crs=target,
        height_unit_known=heights.unit_known,
        max_cells=max_cells,
    )  # fmt: skip
    if placed.on_earth:
        warnings += implausible_heights(heights_m)
    provenance = Provenance(
        source=file.name,
        driver=raw.driver,
        conversions=(*conversions, *placed.conversions),
        warnings=(*warnings, *placed.warnings),
    )
    grid = grid_of(placed, heights.vertical_datum, provenance)
    return grid if wanted is None else with_vertical_datum(grid, wanted)


def grid_of(placed: Placed, vertical_datum: str | None, provenance: Provenance) -> ElevationGrid:
    """The grid of heights that were placed, which it keeps; doubts about its datum are told. Raises DemReadError."""
    placed.heights_m.setflags(write=False)  # ours alone: spares the grid its protective copy
    try:
        grid = ElevationGrid(
            placed.heights_m,
            placed.cell_east_m,
            placed.cell_north_m,
            placed.origin_east_m,
            placed.origin_north_m,
            crs=placed.crs,
            vertical_datum=vertical_datum,
            provenance=provenance,
        )
    except ElevationGridError as error:
        raise DemReadError(f"{provenance.source}: {error}") from error
    doubt = datum_doubt(grid)
    if doubt is not None and doubt not in grid.provenance.warnings:
        grid = replace(grid, provenance=replace(grid.provenance, warnings=(*grid.provenance.warnings, doubt)))
    return grid


def read_part(
    file: Path, driver: str, window: PostWindow, *, max_cells: int, level: int = POSTS
) -> tuple[RawDem, Heights, npt.NDArray[np.float32], tuple[str, ...]]:
    """(what stands in the file, what it means, heights in metres with NaN = unknown, warnings) of some of its posts.

    level: whose posts, of an overview from 1 on.
    Raises DemReadError as ``read_dem`` does; that no post is known is no fault of a part.
    """
    if driver == "NPZ":
        raw = read_npz(file, max_cells=max_cells, window=window)
    else:
        raw = read_raster(file, driver, cell_m=None, band=None, max_cells=max_cells, window=window, level=level)
    heights = heights_of(file.name, raw, unit=None, given=None)
    void, warnings = unknown_posts(
        file.name, raw, factor=heights.factor, offset_m=heights.offset_m, nodata=None, may_be_void=True
    )
    return raw, heights, heights_in_metres(raw, void, heights), (*raw.warnings, *heights.warnings, *warnings)


def horizontal_target(target_crs: Any) -> pyproj.CRS:
    """The CRS that a grid is wanted in. Raises FrameError, DemUnsupportedError where it has heights."""
    target = parse_crs(target_crs)
    datum, _ = vertical_part(target)
    if datum is not None:
        raise DemUnsupportedError(
            f"target_crs must have no heights, but {target.name!r} has; they are not transformed."
        )
    return horizontal_part(target)


def _read_raw(
    file: Path, driver: str, cell_m: tuple[float, float] | None, band: int | None, max_cells: int, level: int
) -> RawDem:
    if band is not None and band != 1 and driver in ("NPZ", "NPY"):
        raise DemReadError(f"{file.name} holds one array of heights, so it has no band {band}.")
    if driver == "NPZ":
        return read_npz(file, max_cells=max_cells)
    if driver == "NPY":
        return read_npy(file, cell_m=cell_m, max_cells=max_cells)
    return read_raster(file, driver, cell_m=cell_m, band=band, max_cells=max_cells, level=level)


def _cell_pair(cell_m: float | tuple[float, float] | None) -> tuple[float, float] | None:
    if cell_m is None:
        return None
    east_m, north_m = cell_m if isinstance(cell_m, tuple) else (cell_m, cell_m)
    if not all(math.isfinite(value) and value > 0.0 for value in (east_m, north_m)):
        raise DemReadError(f"cell_m must be a positive number of metres, or a pair of them, not {cell_m}.")
    return float(east_m), float(north_m)


def heights_in_metres(raw: RawDem, void: npt.NDArray[np.bool_], heights: Heights) -> npt.NDArray[np.float32]:
    """What stands in a file as metres, float32; NaN where void."""
    with np.errstate(over="ignore", invalid="ignore"):
        # out of range only where void, and those become NaN in the next line
        if heights.factor == 1.0 and heights.offset_m == 0.0:
            heights_m = np.asarray(raw.values, dtype=np.float32, order="C")
        else:
            heights_m = (raw.values * np.float64(heights.factor) + heights.offset_m).astype(np.float32)
    if void.any():
        heights_m = heights_m.copy() if np.may_share_memory(heights_m, raw.values) else heights_m
        heights_m[void] = np.nan
    return heights_m
