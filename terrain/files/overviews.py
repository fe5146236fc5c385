"""Coarser levels of a file: the overviews that it brings along, and which of them a resolution means."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.enums import TransformDirection

from ..crs.frames import degrees_to_crs, geodesics_of
from ..errors import DemReadError, DemUnsupportedError
from .raster import overview_sizes, read_raster_head
from .raw import RawHead

__all__ = ["POSTS", "FileLevel", "cell_of", "level_for", "levels_of_file", "to_degrees"]

# of the cell that is asked for: overviews of odd sizes are a little coarser than a power of two
SLACK = 1e-3


@dataclass(frozen=True, slots=True)
class FileLevel:
    """One level of a file: 0 holds its own posts, the others are overviews; cell_m: ground that a cell covers."""

    number: int
    rows: int
    cols: int
    cell_m: float


# the file's own posts, whatever they are
POSTS = 0


def levels_of_file(file: Path, driver: str, crs: pyproj.CRS | None = None) -> tuple[FileLevel, ...]:
    """All levels of a raster, finest first; only headers are read. crs: of a file that names none.

    A level covers the ground of all others, so its cells follow from its size. Raises DemReadError.
    """
    head = read_raster_head(file, driver)
    own_m = cell_of(file.name, head, head.crs or crs)
    return tuple(
        FileLevel(number, rows, cols, own_m * math.sqrt(head.rows / rows * (head.cols / cols)))
        for number, (rows, cols) in enumerate(((head.rows, head.cols), *overview_sizes(file, driver, head.band)))
    )


def level_for(
    file: Path, driver: str, resolution_m: float | None, crs: pyproj.CRS | None = None
) -> tuple[int, str | None]:
    """(the coarsest level of a file whose cells are no coarser than asked, what there is to tell about it).

    Where there is none, the file's own posts. Raises DemReadError.
    """
    if resolution_m is None:
        return POSTS, None
    if not (math.isfinite(resolution_m) and resolution_m > 0.0):
        raise DemReadError(f"resolution_m must be a positive number of metres, not {resolution_m:g}.")
    if driver in ("NPZ", "NPY"):
        return POSTS, "The file has no overviews, so its own posts were read."
    own, *coarser = levels_of_file(file, driver, crs)
    fit = [level for level in coarser if level.cell_m <= resolution_m * (1.0 + SLACK)]
    if fit:
        taken = fit[-1]
        return taken.number, (
            f"Heights are those of the file's overview with cells of {taken.cell_m:.3g} m, in place of "
            f"{own.cell_m:.3g} m."
        )
    why = f"no overview with cells of {resolution_m:g} m or less" if coarser else "no overviews"
    return POSTS, f"The file has {why}, so its own posts, {own.cell_m:.3g} m apart, were read."


def cell_of(name: str, head: RawHead, crs: pyproj.CRS | None) -> float:
    """Metres of ground that a cell in the middle of a file covers, the geometric mean of both directions.

    Raises DemUnsupportedError where the CRS is not defined there.
    """
    if crs is None or not (crs.is_projected or crs.is_geographic):
        return math.sqrt(head.step_x * head.step_y)
    x = head.x0 + head.step_x * (head.cols - 1) / 2.0 + head.step_x * np.array([-0.5, 0.5, 0.0, 0.0])
    y = head.y0 - head.step_y * (head.rows - 1) / 2.0 + head.step_y * np.array([0.0, 0.0, -0.5, 0.5])
    lon, lat = to_degrees(crs, x, y)
    if not np.isfinite(lon).all():
        raise DemUnsupportedError(f"{name} does not lie where its CRS {crs.name!r} is defined.")
    _, _, ground_m = geodesics_of(crs).inv(lon[[0, 2]], lat[[0, 2]], lon[[1, 3]], lat[[1, 3]])
    return math.sqrt(float(np.prod(ground_m)))


def to_degrees(
    crs: pyproj.CRS, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """(longitudes, latitudes) of positions in a CRS."""
    lon, lat = degrees_to_crs(crs).transform(x, y, direction=TransformDirection.INVERSE)
    return np.asarray(lon), np.asarray(lat)
