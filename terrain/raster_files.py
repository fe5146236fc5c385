"""DEM files that GDAL reads, each opened with one driver and nothing beside the file itself."""

from __future__ import annotations

import math
import re
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyproj
import rasterio
from rasterio._err import CPLE_BaseError  # damaged tags raise it bare
from rasterio.enums import ColorInterp, MaskFlags
from rasterio.errors import NotGeoreferencedWarning, RasterioError

from .ascii_header import ascii_place, check_ascii_header
from .ascii_values import check_ascii_values
from .crs_parts import horizontal_part, vertical_part
from .crs_texts import parse_crs
from .errors import DemFormatError, DemUnsupportedError, FrameError
from .limits import check_declared_size
from .raw import RawDem
from .stated_crs import check_stated_crs, prj_text
from .units import HeightUnit

__all__ = ["read_raster"]

# the file alone: no side cars, no world files, no overviews elsewhere, nothing written back, compound CRS kept; only an
# ESRI ASCII grid has its CRS, as text, in the .prj beside it
SEALED = {
    "GDAL_DISABLE_READDIR_ON_OPEN": "EMPTY_DIR",
    "GDAL_PAM_ENABLED": "NO",
    "GDAL_GEOREF_SOURCES": "INTERNAL",
    "GTIFF_REPORT_COMPD_CS": "YES",
    "GTIFF_POINT_GEO_IGNORE": "NO",
    "DTED_VERIFY_CHECKSUM": "YES",
}
PICTURE = {ColorInterp.red, ColorInterp.green, ColorInterp.blue, ColorInterp.palette}
DTED_DATUMS = {"E96": "EGM96 geoid", "E08": "EGM2008 geoid", "MSL": "mean sea level", "WGS84": "ellipsoid of WGS 84"}
SHEAR_TOLERANCE = 1e-6
LONGEST_SHOWN = 80
ZUNITS_PER_METRE = {"1": "m", "10": "dm", "100": "cm", "1000": "mm"}
ZUNITS = re.compile(r"^[ \t]*zunits[ \t]+(\S+)", re.IGNORECASE | re.MULTILINE)


def read_raster(
    file: Path, driver: str, *, cell_m: tuple[float, float] | None, band: int | None, max_cells: int
) -> RawDem:
    """Read one elevation band as it stands in the file; ``cell_m`` (east, north) serves files without georeference.

    band: from 1; None takes the first, and says so where there are others.

    Raises DemFormatError, DemTooLargeError (before any pixel is read) and DemUnsupportedError.
    """
    check_stated_crs(file, driver)
    try:
        with rasterio.Env(**SEALED), warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            with rasterio.open(file, driver=driver) as dataset:
                if driver != "AAIGrid" or dataset.dtypes[0] != "int32":
                    return _read(file, dataset, cell_m, band, max_cells)
            # among whole numbers GDAL makes 0 of nan and inf, and wraps those that are too large
            with rasterio.open(file, driver=driver, DATATYPE="Float64") as dataset:
                raw = _read(file, dataset, cell_m, band, max_cells)
                return replace(raw, values=_whole(raw.values))
    except (RasterioError, CPLE_BaseError) as error:
        raise DemFormatError(f"{file.name} is damaged or cut short: GDAL cannot read it as {driver}.") from error
    except UnicodeDecodeError as error:
        shown = error.object.decode("latin-1")[:LONGEST_SHOWN]
        raise DemFormatError(
            f"{file.name} is damaged, or was written by an old program: its text {shown!r} is not UTF-8; write it anew."
        ) from error


def _read(
    file: Path, dataset: Any, cell_m: tuple[float, float] | None, asked_band: int | None, max_cells: int
) -> RawDem:
    name, notes = file.name, _Notes()
    rows, cols = dataset.height, dataset.width
    file_bytes = file.stat().st_size
    band = _band(name, dataset, asked_band, notes)
    at = band - 1
    kind = np.dtype(dataset.dtypes[at]) if dataset.dtypes[at] != "complex_int16" else np.dtype("complex64")
    check_declared_size(name, rows, cols, max_cells=max_cells, bytes_per_value=kind.itemsize, file_bytes=file_bytes)
    if dataset.driver == "AAIGrid" and rows * cols * 2 > file_bytes + 1:
        raise DemFormatError(f"{name} is cut short: {rows} × {cols} heights do not fit into {file_bytes:,} bytes.")
    if dataset.driver == "AAIGrid":
        check_ascii_header(file)
        check_ascii_values(file, rows, cols)
    if kind.kind == "c":
        raise DemUnsupportedError(f"{name} holds complex numbers, not heights.")
    scale, offset = float(dataset.scales[at]), float(dataset.offsets[at])
    if not (math.isfinite(scale) and math.isfinite(offset)) or scale == 0.0:
        raise DemUnsupportedError(
            f"{name} says that its heights are its values × {scale:g} + {offset:g}, which makes no heights of them."
        )
    x0, y0, step_x, step_y = _geometry(name, dataset, cell_m, notes)
    if dataset.driver == "AAIGrid":
        x0, y0 = ascii_place(file, rows, (step_x, step_y)) or (x0, y0)
    crs, datum, crs_unit = _crs(file, dataset, notes)
    tags = dataset.tags()
    if dataset.driver == "DTED" or "DTED_VerticalDatum" in tags:
        written = tags.get("DTED_VerticalDatum", "").strip()
        datum = datum or DTED_DATUMS.get(written, written or None)
    if dataset.driver == "SRTMHGT":
        datum = datum or "EGM96 geoid"
    if tags.get("AREA_OR_POINT") == "Point":
        notes.conversions.append("Pixel-is-point: the file's points are the posts, its bounds lie half a cell outside.")
    declared_void = None
    if MaskFlags.all_valid not in dataset.mask_flag_enums[at]:
        declared_void = dataset.read_masks(band) == 0
    elif ColorInterp.alpha in dataset.colorinterp:  # GDAL heeds only an alpha band of uint8 or uint16
        declared_void = dataset.read(dataset.colorinterp.index(ColorInterp.alpha) + 1) == 0
    values = dataset.read(band)
    if step_y < 0.0:
        notes.conversions.append("Rows run from south to north in the file; turned so that row 0 is northmost.")
        values, y0, step_y = values[::-1], y0 + (rows - 1) * -step_y, -step_y
        declared_void = None if declared_void is None else declared_void[::-1]
    return RawDem(
        values, declared_void, x0, y0, step_x, step_y, crs,
        driver=dataset.driver,
        scale=scale,
        offset=offset,
        height_unit=_unit(dataset, at) or (_zunits(file) if dataset.driver == "AAIGrid" else None),
        crs_height_unit=crs_unit,
        vertical_datum=datum,
        conversions=tuple(notes.conversions),
        warnings=tuple(notes.warnings),
    )  # fmt: skip


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


def _whole(values: npt.NDArray[np.float64]) -> npt.NDArray[Any]:
    """The values as 32 bit integers where that is what they all are."""
    limits = np.iinfo(np.int32)
    if np.isfinite(values).all() and limits.min <= values.min() and values.max() <= limits.max:
        return values.astype(np.int32)
    return values


def _zunits(file: Path) -> str | None:
    """What an Arc/Info .prj beside an ESRI ASCII grid says of its heights, which GDAL leaves out."""
    found = ZUNITS.search(prj_text(file) or "")
    return None if found is None or found[1].upper() == "NO" else ZUNITS_PER_METRE.get(found[1], found[1])


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
            crs = parse_crs(dataset.crs.to_wkt(version="WKT2_2019"))
        except FrameError as error:
            notes.warnings.append(f"The file's CRS was left out; give crs=. {error}")
            return None, None, None
        if dataset.driver == "AAIGrid":
            notes.conversions.append(f"The CRS was taken from {file.stem}.prj beside the file.")
        datum, unit = vertical_part(crs)
        return horizontal_part(crs), datum, unit
    return None, None, None
