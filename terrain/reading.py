"""read_dem: from a file to a grid in metres, telling everything that was changed or guessed on the way."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .array_files import read_npy, read_npz
from .crs_parts import horizontal_part, parse_crs
from .errors import DemReadError, ElevationGridError
from .formats import local_file, sniff_format
from .grid import ElevationGrid, Provenance
from .limits import DEFAULT_MAX_CELLS
from .placing import place
from .raster_files import read_raster
from .raw import RawDem
from .units import HEIGHT_UNITS
from .voids import implausible_heights, unknown_posts

__all__ = ["read_dem"]


def read_dem(
    path: str | os.PathLike[str],
    *,
    nodata: float | None = None,
    crs: Any = None,
    height_unit: str | None = None,
    target_crs: Any = None,
    cell_m: float | tuple[float, float] | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> ElevationGrid:
    """Read a DEM file: GeoTIFF or COG, ESRI ASCII, SRTM .hgt, DTED, .npz or .npy.

    The grid is north-up and in metres; ``provenance`` tells each conversion and each warning as a sentence.

    nodata: the value, as it stands in the file, that means "unknown", in place of what the file declares (nan: none).
    crs: CRS of the file's positions, for files without one; "local" for metres without a place on a planet.
    height_unit: "m", "ft" or "us-ft", in place of what the file declares.
    target_crs: metric CRS of the grid; without it the file's own where that measures metres truly, else a local one.
    cell_m: metres between posts, one number or (east, north), for files that do not tell.
    max_cells: a larger raster is refused before its pixels are read.
    Raises DemReadError (DemFormatError, DemTooLargeError, DemUnsupportedError), FrameError for an unknown CRS.
    """
    if height_unit is not None and height_unit not in HEIGHT_UNITS:
        raise DemReadError(f"height_unit must be one of {', '.join(HEIGHT_UNITS)}, not {height_unit!r}.")
    file = local_file(path)
    raw = _read_raw(file, _cell_pair(cell_m), max_cells)
    void, void_warnings = unknown_posts(file.name, raw.values, raw.declared_void, nodata=nodata, only_nan=raw.from_grid)
    conversions, warnings = [*raw.conversions], [*raw.warnings, *void_warnings]
    unit = height_unit or raw.height_unit
    heights_m = _heights_m(raw, void, HEIGHT_UNITS[unit or "m"])
    if raw.scale != 1.0 or raw.offset != 0.0:
        conversions.append(f"Heights are the file's values × {raw.scale:g} + {raw.offset:g}, as the file says.")
    if unit is not None and unit != "m":
        conversions.append(f"Heights converted from {unit} to metres (× {HEIGHT_UNITS[unit]:.10g}).")
    if height_unit is not None and raw.height_unit not in (None, height_unit):
        warnings.append(f"The file says that heights are in {raw.height_unit}; height_unit={height_unit} was taken.")
    placed = place(
        file.name, raw, heights_m,
        crs=crs if crs is None or crs == "local" else horizontal_part(parse_crs(crs)),
        target_crs=None if target_crs is None else horizontal_part(parse_crs(target_crs)),
        height_unit_known=unit is not None,
        max_cells=max_cells,
    )  # fmt: skip
    if placed.on_earth:
        warnings += implausible_heights(heights_m)
    placed.heights_m.setflags(write=False)  # ours alone: spares the grid its protective copy
    try:
        return ElevationGrid(
            placed.heights_m,
            placed.cell_east_m,
            placed.cell_north_m,
            placed.origin_east_m,
            placed.origin_north_m,
            crs=placed.crs,
            vertical_datum=raw.vertical_datum,
            provenance=Provenance(
                source=file.name,
                driver=raw.driver,
                conversions=(*conversions, *placed.conversions),
                warnings=(*warnings, *placed.warnings),
            ),
        )
    except ElevationGridError as error:
        raise DemReadError(f"{file.name}: {error}") from error


def _read_raw(file: Path, cell_m: tuple[float, float] | None, max_cells: int) -> RawDem:
    driver = sniff_format(file)
    if driver == "NPZ":
        return read_npz(file, max_cells=max_cells)
    if driver == "NPY":
        return read_npy(file, cell_m=cell_m, max_cells=max_cells)
    return read_raster(file, driver, cell_m=cell_m, max_cells=max_cells)


def _cell_pair(cell_m: float | tuple[float, float] | None) -> tuple[float, float] | None:
    if cell_m is None:
        return None
    east_m, north_m = cell_m if isinstance(cell_m, tuple) else (cell_m, cell_m)
    if not all(math.isfinite(value) and value > 0.0 for value in (east_m, north_m)):
        raise DemReadError(f"cell_m must be a positive number of metres, or a pair of them, not {cell_m}.")
    return float(east_m), float(north_m)


def _heights_m(raw: RawDem, void: npt.NDArray[np.bool_], metres: float) -> npt.NDArray[np.float32]:
    factor, offset = raw.scale * metres, raw.offset * metres
    with np.errstate(over="ignore", invalid="ignore"):
        # out of range only where void, and those become NaN in the next line
        if factor == 1.0 and offset == 0.0:
            heights_m = np.array(raw.values, dtype=np.float32, order="C")
        else:
            heights_m = (raw.values * np.float64(factor) + offset).astype(np.float32)
    heights_m[void] = np.nan
    return heights_m
