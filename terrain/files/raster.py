"""DEM files that GDAL reads, each opened with one driver and nothing beside the file itself."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj
import rasterio
from rasterio._err import CPLE_BaseError  # damaged tags raise it bare
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import NotGeoreferencedWarning, RasterioError
from rasterio.windows import Window

from ..crs.parts import horizontal_part, vertical_part
from ..crs.stated import check_stated_crs
from ..crs.texts import parse_crs
from ..errors import DemFormatError, DemUnsupportedError, FrameError
from ..limits import check_declared_size
from ..units import HeightUnit
from .ascii_header import ascii_place, check_ascii_header, unit_in_prj
from .ascii_values import check_ascii_values, whole_numbers
from .raw import PostWindow, RawDem, RawHead

__all__ = ["overview_sizes", "read_raster", "read_raster_head"]

# the file alone: no side cars, no world files, no overviews elsewhere, nothing written back, compound CRS kept; only an
# ESRI ASCII grid has its CRS, as text, in the .prj beside it
SEALED = {
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR",
    "GDAL_PAM_ENABLED": "NO",
    "GDAL_GEOREF_SOURCES": "INTERNAL",
    "GTIFF_REPORT_COMPD_CS": "YES",
    "GTIFF_POINT_GEO_IGNORE": "NO",
    "DTED_VERIFY_CHECKSUM": "YES",
    "GDAL_NUM_THREADS": "ALL_CPUS",
}
PICTURE = {ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.palette}
DTED_DATUMS = {"E96": "EGM96 geoid", "E08": "EGM2008 geoid", "MSL": "mean sea level", "WGS84": "ellipsoid of WGS 84"}
SHEAR_TOLERANCE = 1e-6
# share of a number within which GDAL, too, tells it from another
NEAR_NODATA = 1e-5
LONGEST_SHOWN = 80


def read_raster_head(file: Path, driver: str) -> RawHead:
    """What a raster says of itself. Raises DemFormatError and DemUnsupportedError."""
    check_stated_crs(file, driver)
    with _opened(file, driver) as dataset:
        return _head(file, dataset, None, None)


def overview_sizes(file: Path, driver: str, band: int) -> tuple[tuple[int, int], ...]:
    """(rows, cols) of each coarser level that a raster brings along, finest first. Raises DemFormatError."""
    with _opened(file, driver) as dataset:
        levels = len(dataset.overviews(band))
    sizes = []
    for level in range(1, levels + 1):  # who wrote it has rounded them up or down
        with _opened(file, driver, level) as dataset:
            sizes.append((dataset.height, dataset.width))
    return tuple(sizes)


def read_raster(
    file: Path,
    driver: str,
    *,
    cell_m: tuple[float, float] | None,
    band: int | None,
    max_cells: int,
    window: PostWindow | None = None,
    level: int = 0,
) -> RawDem:
    """Read one elevation band as it stands in the file; ``cell_m`` (east, north) serves files without georeference.

    band: from 1; None takes the first, and says so where there are others. window: only these posts, which must lie in
    the raster; the limit is for them then, and for the blocks that the file is packed in. level: 0 for the file's own
    posts, from 1 on for those of its overviews.

    Raises DemFormatError, DemTooLargeError (before any pixel is read) and DemUnsupportedError.
    """
    check_stated_crs(file, driver)
    with _opened(file, driver, level) as dataset:
        _check_size(file, dataset, band, window, max_cells)
        return _read(file, dataset, _head(file, dataset, cell_m, band), window)


@contextmanager
def _opened(file: Path, driver: str, level: int = 0) -> Iterator[Any]:
    """The file, opened with one driver; what GDAL finds damaged is a DemFormatError."""
    try:
        with rasterio.Env(**SEALED), warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            of_level = {"overview_level": level - 1} if level else {}
            with rasterio.open(file, driver=driver, **of_level) as dataset:
                if driver != "AAIGrid" or dataset.dtypes[0] != "int32":
                    yield dataset
                    return
            # among whole numbers GDAL makes 0 of nan and inf, and wraps those that are too large
            with rasterio.open(file, driver=driver, DATATYPE="Float64") as dataset:
                yield dataset
    except (RasterioError, CPLE_BaseError) as error:
        raise DemFormatError(f"{file.name} is damaged or cut short: GDAL cannot read it as {driver}.") from error
    except UnicodeDecodeError as error:
        shown = error.object.decode("latin-1")[:LONGEST_SHOWN]
        raise DemFormatError(
            f"{file.name} is damaged, or was written by an old program: its text {shown!r} is not UTF-8; write it anew."
        ) from error


def _head(file: Path, dataset: Any, cell_m: tuple[float, float] | None, asked_band: int | None) -> RawHead:
    name, notes = file.name, _Notes()
    band = _band(name, dataset, asked_band, notes)
    at = band - 1
    if dataset.dtypes[at].startswith("complex"):
        raise DemUnsupportedError(f"{name} holds complex numbers, not heights.")
    if dataset.driver == "AAIGrid":
        check_ascii_header(file)
    scale, offset = float(dataset.scales[at]), float(dataset.offsets[at])
    if not (math.isfinite(scale) and math.isfinite(offset)) or scale == 0.0:
        raise DemUnsupportedError(
            f"{name} says that its heights are its values × {scale:g} + {offset:g}, which makes no heights of them."
        )
    x0, y0, step_x, step_y = _geometry(name, dataset, cell_m, notes)
    if dataset.driver == "AAIGrid":
        x0, y0 = ascii_place(file, dataset.height, (step_x, step_y)) or (x0, y0)
    crs, datum, crs_unit = _crs(file, dataset, notes)
    tags = dataset.tags()
    if dataset.driver == "DTED" or "DTED_VerticalDatum" in tags:
        written = tags.get("DTED_VerticalDatum", "").strip()
        datum = datum or DTED_DATUMS.get(written, written or None)
    if dataset.driver == "SRTMHGT":
        datum = datum or "EGM96 geoid"
    if tags.get("AREA_OR_POINT") == "Point":
        notes.conversions.append("Pixel-is-point: the file's points are the posts, its bounds lie half a cell outside.")
    south_up = step_y < 0.0
    if south_up:
        notes.conversions.append("Rows run from south to north in the file; turned so that row 0 is northmost.")
        y0, step_y = y0 + (dataset.height - 1) * -step_y, -step_y
    return RawHead(
        dataset.height, dataset.width, band, x0, y0, step_x, step_y, south_up, scale, offset,
        height_unit=_unit(dataset, at) or (unit_in_prj(file) if dataset.driver == "AAIGrid" else None),
        crs=crs,
        crs_height_unit=crs_unit,
        vertical_datum=datum,
        conversions=tuple(notes.conversions),
        warnings=tuple(notes.warnings),
    )  # fmt: skip


def _read(file: Path, dataset: Any, head: RawHead, window: PostWindow | None) -> RawDem:
    if dataset.driver == "AAIGrid":
        check_ascii_values(file, head.rows, head.cols)
    at, band = head.band - 1, head.band
    chosen = PostWindow(0, head.rows - 1, 0, head.cols - 1) if window is None else window
    first_row = head.rows - 1 - chosen.last_row if head.south_up else chosen.first_row
    part = Window(chosen.first_col, first_row, chosen.shape[1], chosen.shape[0])
    values = dataset.read(band, window=part)
    declared_void = None
    if dataset.mask_flag_enums[at] == [MaskFlags.nodata] and _lies_beside(dataset.nodatavals[at], values):
        declared_void = np.zeros(values.shape, np.bool_)
    elif MaskFlags.all_valid not in dataset.mask_flag_enums[at]:
        declared_void = dataset.read_masks(band, window=part) == 0
    elif ColorInterp.alpha in dataset.colorinterp:  # GDAL heeds only an alpha band of uint8 or uint16
        declared_void = dataset.read(dataset.colorinterp.index(ColorInterp.alpha) + 1, window=part) == 0
    if dataset.driver == "AAIGrid" and values.dtype == np.float64:
        values = whole_numbers(values)
    if head.south_up:
        values = values[::-1]
        declared_void = None if declared_void is None else declared_void[::-1]
    return RawDem(
        values, declared_void,
        head.x0 + chosen.first_col * head.step_x,
        head.y0 - chosen.first_row * head.step_y,
        head.step_x, head.step_y, head.crs,
        driver=dataset.driver,
        scale=head.scale,
        offset=head.offset,
        height_unit=head.height_unit,
        crs_height_unit=head.crs_height_unit,
        vertical_datum=head.vertical_datum,
        conversions=head.conversions,
        warnings=head.warnings,
    )  # fmt: skip


def _lies_beside(nodata: float, values: npt.NDArray[Any]) -> bool:
    """Whether all values are known to be far from nodata; the mask of GDAL would have every block unpacked again."""
    lowest, highest = float(values.min()), float(values.max())
    near = NEAR_NODATA * abs(nodata)
    return not math.isnan(lowest) and (math.isnan(nodata) or not lowest - near <= nodata <= highest + near)


def _check_size(file: Path, dataset: Any, band: int | None, window: PostWindow | None, max_cells: int) -> None:
    """Before any pixel is read. Raises DemFormatError, DemTooLargeError."""
    at = band - 1 if band is not None and 1 <= band <= dataset.count else 0
    kind = dataset.dtypes[at] if dataset.dtypes[at] != "complex_int16" else "complex64"
    file_bytes, value_bytes = file.stat().st_size, np.dtype(kind).itemsize
    rows, cols = (dataset.height, dataset.width) if window is None else window.shape
    weighed = file_bytes if window is None else None
    check_declared_size(file.name, rows, cols, max_cells=max_cells, bytes_per_value=value_bytes, file_bytes=weighed)
    if window is not None:  # a block is unpacked whole, whatever part of it is wanted
        block = f"A block of {file.name}"
        sides = dataset.block_shapes[at]
        check_declared_size(block, *sides, max_cells=max_cells, bytes_per_value=value_bytes, file_bytes=file_bytes)
    if dataset.driver == "AAIGrid" and dataset.height * dataset.width * 2 > file_bytes + 1:
        heights = f"{dataset.height} × {dataset.width} heights"
        raise DemFormatError(f"{file.name} is cut short: {heights} do not fit into {file_bytes:,} bytes.")


class _Notes:
    """Sentences gathered while a file is read."""

    def __init__(self) -> None:
        self.conversions: list[str] = []
        self.warnings: list[str] = []


def _band(name: str, dataset: Any, asked: int | None, notes: _Notes) -> int:
    """Which band holds the heights, from 1."""
    if asked is not None:
        if not 1 <= asked <= dataset.count:
            raise DemUnsupportedError(f"{name} has {dataset.count} bands, from 1, so there is no band {asked}.")
        if dataset.colorinterp[asked - 1] in PICTURE | {ColorInterp.alpha}:
            raise DemUnsupportedError(
                f"Band {asked} of {name} holds {dataset.colorinterp[asked - 1].name}, not heights."
            )
        return asked
    if PICTURE & set(dataset.colorinterp):
        raise DemUnsupportedError(f"{name} is a picture (colours), not a DEM.")
    heights_bands = [colour for colour in dataset.colorinterp if colour is not ColorInterp.alpha]
    if len(heights_bands) > 1:
        notes.warnings.append(
            f"The file has {dataset.count} bands; band 1 was taken as heights. Give band= if another holds them."
        )
    return 1


def _unit(dataset: Any, at: int) -> str | None:
    """What a band says of its unit; of a file with one band in Latin-1 too, as older programs write it."""
    try:
        unit: str | None = dataset.units[at]
    except UnicodeDecodeError as error:
        if dataset.count > 1:
            raise
        return error.object.decode("latin-1")
    return unit


def _geometry(
    name: str, dataset: Any, cell_m: tuple[float, float] | None, notes: _Notes
) -> tuple[float, float, float, float]:
    """Centre of post (0, 0) and steps; step_y < 0 where rows run northward."""
    affine = dataset.transform
    if affine.is_identity:
        if cell_m is None:
            raise DemUnsupportedError(
                f"{name} has no georeference, so its cell size is unknown; give cell_m=, the metres between posts."
            )
        notes.warnings.append("The file has no georeference; its cell size was given, its north-west post is (0, 0).")
        return 0.0, 0.0, *cell_m
    shear = max(abs(affine.b * dataset.height), abs(affine.d * dataset.width))
    if shear > SHEAR_TOLERANCE * max(abs(affine.a), abs(affine.e)):
        raise DemUnsupportedError(f"{name} is rotated or sheared; warp it to a north-up grid first (gdalwarp does).")
    if affine.a <= 0.0 or affine.e == 0.0 or not all(map(math.isfinite, affine[:6])):
        raise DemUnsupportedError(f"{name} is mirrored or has no cell size: its columns do not run eastward.")
    return affine.c + affine.a / 2.0, affine.f + affine.e / 2.0, affine.a, -affine.e


def _crs(file: Path, dataset: Any, notes: _Notes) -> tuple[pyproj.CRS | None, str | None, HeightUnit | None]:
    """(horizontal CRS, vertical datum, height unit); an ESRI ASCII grid may have its CRS in NAME.prj."""
    if dataset.crs is not None:
        try:
            crs = _parsed(dataset.crs.to_wkt(version="WKT2_2019"))
        except FrameError as error:
            notes.warnings.append(f"The file's CRS was left out; give crs=. {error}")
            return None, None, None
        if dataset.driver == "AAIGrid":
            notes.conversions.append(f"The CRS was taken from {file.stem}.prj beside the file.")
        datum, unit = vertical_part(crs)
        return horizontal_part(crs), datum, unit
    return None, None, None


@lru_cache(maxsize=64)
def _parsed(wkt: str) -> pyproj.CRS:
    """Tiles of one set state one CRS, and parsing it takes longer than all else of a header."""
    return parse_crs(wkt)
