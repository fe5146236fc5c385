"""A raster of any size that is read by windows: known by its header, its heights stay in the file."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyproj

from ..crs.parts import same_map, split_shift
from ..datums.conversion import with_vertical_datum
from ..datums.references import parse_vertical_datum
from ..errors import DemReadError, DemTooLargeError, DemUnsupportedError
from ..grid import ElevationGrid, Provenance, RasterFile
from ..heights import heights_of
from ..limits import DEFAULT_MAX_CELLS
from ..units import HEIGHT_UNITS
from ..voids import unknown_posts
from .formats import local_file, sniff_format, unchanged
from .overviews import levels_of_file
from .placing import place
from .raster import read_raster, read_raster_head
from .raw import PostWindow
from .reading import grid_of, heights_in_metres, read_dem

__all__ = ["LargeDem", "open_dem"]

# posts of the middle from which units, datum and frame are told
SAMPLE_POSTS = 64


@dataclass(frozen=True, slots=True)
class LargeDem(RasterFile):
    """A GeoTIFF in metres that is read by windows; it goes to other processes as it is.

    A file that was changed since it was opened is refused.
    """

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.rows, self.cols

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """(west, south, east, north) of the outermost posts, metres."""
        east_m = self.origin_east_m + (self.cols - 1) * self.cell_east_m
        south_m = self.origin_north_m - (self.rows - 1) * self.cell_north_m
        return self.origin_east_m, south_m, east_m, self.origin_north_m

    def post_at(self, east_m: float, north_m: float) -> tuple[float, float]:
        """Fractional (row, col) of a position, also outside."""
        row = (self.origin_north_m - north_m) / self.cell_north_m
        return row, (east_m - self.origin_east_m) / self.cell_east_m

    def window(self, first_row: int, last_row: int, first_col: int, last_col: int) -> ElevationGrid:
        """The posts of some rows and columns, ends included, read from the file; equal to a window of the whole.

        Raises DemReadError (GroundChangedError where the file is not what it was when it was opened), IndexError.
        """
        if not (0 <= first_row <= last_row < self.rows and 0 <= first_col <= last_col < self.cols):
            raise IndexError(f"Rows {first_row}…{last_row}, columns {first_col}…{last_col} are not all in the DEM.")
        window = PostWindow(first_row, last_row, first_col, last_col)
        with unchanged(self, since="it was opened", then="ask again"):
            file = local_file(self.path)
            grid = _read(file, self.driver, window, nodata=self.nodata, height_unit=self.height_unit)
        return grid if self.wanted_datum is None else with_vertical_datum(grid, self.wanted_datum)

    def frame(self) -> ElevationGrid:
        """Its bounds, CRS and vertical datum: a grid of the four posts at its corners, without heights."""
        west_m, south_m, east_m, north_m = self.bounds_m
        return ElevationGrid(
            np.full((2, 2), np.nan, np.float32),
            max(east_m - west_m, self.cell_east_m),
            max(north_m - south_m, self.cell_north_m),
            west_m, north_m, self.crs, self.vertical_datum,
            Provenance(self.name, self.driver, overview_of=self),
        )  # fmt: skip

    def overview(self, *, max_cells: int, resolution_m: float | None = None) -> ElevationGrid:
        """The whole, as coarse as the finest level of the file that has no more than ``max_cells`` posts.

        resolution_m: as coarse as ``read_dem`` takes it instead. Its provenance says what it is the overview of.
        Raises DemReadError (DemTooLargeError where no level has so few posts).
        """
        if resolution_m is None:
            levels = levels_of_file(Path(self.path), self.driver, self.crs)
            fit = [level for level in levels if level.rows * level.cols <= max_cells]
            if not fit:
                raise DemTooLargeError(
                    f"{self.name} has {self.rows * self.cols:,} posts and no overview of {max_cells:,} or fewer; "
                    f"gdaladdo -r average {self.name} 2 4 8 16 32 64 makes some.",
                    cells=self.rows * self.cols,
                    limit_cells=max_cells,
                )
            resolution_m = fit[0].cell_m
        grid = read_dem(
            self.path,
            nodata=self.nodata,
            height_unit=self.height_unit,
            vertical_datum=self.wanted_datum,
            resolution_m=resolution_m,
            max_cells=max_cells,
        )
        return replace(grid, provenance=replace(grid.provenance, overview_of=self))


def open_dem(
    path: str | os.PathLike[str],
    *,
    nodata: float | None = None,
    height_unit: str | None = None,
    vertical_datum: str | None = None,
) -> LargeDem:
    """Open a raster to be read by windows; only its header and a few posts of its middle are read.

    Its posts stay where they are: a raster in degrees, or on a map that does not measure ground truly, is refused.
    nodata, height_unit, vertical_datum: as ``read_dem`` takes them.
    Raises DemReadError, FrameError, VerticalDatumError.
    """
    if height_unit is not None and height_unit not in HEIGHT_UNITS:
        raise DemReadError(f"height_unit must be one of {', '.join(HEIGHT_UNITS)}, not {height_unit!r}.")
    wanted = None if vertical_datum is None else parse_vertical_datum(vertical_datum).name
    file = local_file(path).absolute()
    driver, found = sniff_format(file), file.stat()
    if driver != "GTiff":
        raise DemUnsupportedError(
            f"{file.name} is a {driver} file; only GeoTIFFs are read by windows (gdal_translate -of COG makes one)."
        )
    head = read_raster_head(file, driver)
    row, col = (max(0, posts // 2 - SAMPLE_POSTS // 2) for posts in (head.rows, head.cols))
    middle = PostWindow(row, min(row + SAMPLE_POSTS, head.rows) - 1, col, min(col + SAMPLE_POSTS, head.cols) - 1)
    grid = _read(file, driver, middle, nodata=nodata, height_unit=height_unit)
    if wanted is not None:
        grid = with_vertical_datum(grid, wanted)
    return LargeDem(
        str(file), driver, found.st_size, found.st_mtime_ns, head.rows, head.cols,
        grid.cell_east_m,
        grid.cell_north_m,
        head.x0 * (grid.cell_east_m / head.step_x),
        head.y0 * (grid.cell_north_m / head.step_y),
        grid.crs, grid.vertical_datum, nodata, height_unit, wanted,
    )  # fmt: skip


def _read(
    file: Path, driver: str, window: PostWindow, *, nodata: float | None, height_unit: str | None
) -> ElevationGrid:
    raw = read_raster(file, driver, cell_m=None, band=None, max_cells=DEFAULT_MAX_CELLS, window=window)
    heights = heights_of(file.name, raw, unit=height_unit, given=None)
    void, _ = unknown_posts(
        file.name, raw, factor=heights.factor, offset_m=heights.offset_m, nodata=nodata, may_be_void=True
    )
    heights_m = heights_in_metres(raw, void, heights)
    if raw.crs is not None and raw.crs.is_geographic:
        raise DemUnsupportedError(_to_metres(file.name, "is in degrees"))
    placed = place(
        file.name, raw, heights_m,
        crs=None, target_crs=None, height_unit_known=heights.unit_known, max_cells=DEFAULT_MAX_CELLS,
    )  # fmt: skip
    if placed.heights_m.shape != heights_m.shape or (
        raw.crs is not None and placed.crs is not None and not _same(raw.crs, placed.crs)
    ):
        raise DemUnsupportedError(_to_metres(file.name, "lies on a map that does not measure ground truly"))
    return grid_of(placed, heights.vertical_datum, Provenance(file.name, driver, (), placed.warnings))


def _same(file_crs: pyproj.CRS, grid_crs: pyproj.CRS) -> bool:
    """Whether posts have stayed where they were, units of the axes aside."""
    one, other = split_shift(file_crs)[0], split_shift(grid_crs)[0]
    return same_map(one, other) or one.axis_info[0].unit_conversion_factor != 1.0


def _to_metres(name: str, why: str) -> str:
    return f"{name} {why}; to be read by windows it has to be in metres: gdalwarp -t_srs EPSG:326XX -of COG does it."
