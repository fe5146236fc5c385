"""GDAL's viewshed in this process: the peer for speed and the yardstick for accuracy.

rasterio has no viewshed, but its wheel carries the whole of libgdal; this module calls its C interface. For benchmarks
only: the product never goes this way.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np
import numpy.typing as npt
import rasterio

__all__ = ["GdalDem", "PeerMissingError", "version"]

FLOAT32, FLOAT64 = 6, 7
READ, WRITE = 0, 1
EDGE_MODE = 2  # GVM_Edge, the default of gdal_viewshed
BOOLEAN_OUTPUT, MINIMUM_ALTITUDE_OUTPUT = 1, 2  # GVOT_NORMAL, GVOT_MIN_TARGET_HEIGHT_FROM_DEM

pointer, number, text, real = ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_double


class PeerMissingError(Exception):
    """This rasterio does not come as a wheel with its own libgdal."""


def _load() -> ctypes.CDLL:
    folder = Path(rasterio.__file__).parent.with_name("rasterio.libs")
    found = sorted(folder.glob("libgdal*"))
    if not found:
        raise PeerMissingError(f"no libgdal in {folder.name}; install rasterio from its wheel")
    library = ctypes.CDLL(str(found[0]))
    signatures = {
        "GDALVersionInfo": (text, [text]),
        "GDALAllRegister": (None, []),
        "GDALGetDriverByName": (pointer, [text]),
        "GDALCreate": (pointer, [pointer, text, number, number, number, number, pointer]),
        "GDALSetGeoTransform": (number, [pointer, ctypes.POINTER(real)]),
        "GDALGetRasterBand": (pointer, [pointer, number]),
        "GDALRasterIO": (number, [pointer] + [number] * 5 + [pointer] + [number] * 5),
        "GDALViewshedGenerate": (
            pointer,
            [pointer, text, text, pointer] + [real] * 9 + [number, real, pointer, pointer, number, pointer],
        ),
        "GDALClose": (None, [pointer]),
    }
    for name, (result, arguments) in signatures.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    library.GDALAllRegister()
    return library


def version() -> str:
    """GDAL's release name."""
    return str(_load().GDALVersionInfo(b"RELEASE_NAME").decode())


class GdalDem:
    """A DEM in GDAL's memory, so that timing its viewshed times the viewshed alone. Flat, square or oblong cells."""

    def __init__(self, heights_m: npt.NDArray[np.float32], cell_east_m: float, cell_north_m: float) -> None:
        self._gdal = _load()
        self._cell_m = (cell_east_m, cell_north_m)
        self._shape = heights_m.shape
        rows, cols = heights_m.shape
        held = np.ascontiguousarray(heights_m, np.float32)
        driver = self._gdal.GDALGetDriverByName(b"MEM")
        self._dataset = self._gdal.GDALCreate(driver, b"", cols, rows, 1, FLOAT32, None)
        transform = (real * 6)(0.0, cell_east_m, 0.0, 0.0, 0.0, -cell_north_m)
        self._gdal.GDALSetGeoTransform(self._dataset, transform)
        self._band = self._gdal.GDALGetRasterBand(self._dataset, 1)
        self._transfer(self._band, WRITE, held, FLOAT32)

    def min_visible_altitude(self, row: int, col: int, above_ground_m: float) -> npt.NDArray[np.float64]:
        """(rows, cols) altitude of the lowest line to an observer over one post, as GDAL gives it.

        Over posts that it sees this may pass underground; and it stops at 0 m, so ground below that must be lifted.
        """
        output = self._viewshed(row, col, above_ground_m, 0.0, MINIMUM_ALTITUDE_OUTPUT)
        altitude_m = np.empty(self._shape)
        self._transfer(self._gdal.GDALGetRasterBand(output, 1), READ, altitude_m, FLOAT64)
        self._gdal.GDALClose(output)
        return altitude_m

    def run(self, row: int, col: int, above_ground_m: float, *, boolean: bool = False) -> None:
        """Compute and throw away: what is timed."""
        kind = BOOLEAN_OUTPUT if boolean else MINIMUM_ALTITUDE_OUTPUT
        self._gdal.GDALClose(self._viewshed(row, col, above_ground_m, 0.0, kind))

    def close(self) -> None:
        """Give the memory back."""
        self._gdal.GDALClose(self._dataset)

    def _viewshed(self, row: int, col: int, observer_m: float, target_m: float, kind: int) -> int:
        east_m, north_m = (col + 0.5) * self._cell_m[0], -(row + 0.5) * self._cell_m[1]
        seen, hidden, out_of_range, nodata = 255.0, 0.0, 0.0, -1.0
        curvature, unlimited_m = 0.0, 0.0
        output = self._gdal.GDALViewshedGenerate(
            self._band, b"MEM", b"", None, east_m, north_m, observer_m, target_m, seen, hidden, out_of_range, nodata,
            curvature, EDGE_MODE, unlimited_m, None, None, kind, None,
        )  # fmt: skip
        if not output:
            raise RuntimeError(f"GDAL made no viewshed for the observer over row {row}, column {col}.")
        return int(output)

    def _transfer(self, band: int, direction: int, array: npt.NDArray[np.floating], kind: int) -> None:
        rows, cols = array.shape
        failed = self._gdal.GDALRasterIO(band, direction, 0, 0, cols, rows, array.ctypes.data, cols, rows, kind, 0, 0)
        if failed:
            raise RuntimeError("GDAL could not copy the raster.")
