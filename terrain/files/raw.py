"""A DEM as its file has it: own numbers, own units, own CRS, nothing interpreted yet; and its head alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pyproj

from ..units import HeightUnit

__all__ = ["PostWindow", "RawDem", "RawHead"]


class PostWindow(NamedTuple):
    """Some rows and columns of posts, ends included, row 0 northmost."""

    first_row: int
    last_row: int
    first_col: int
    last_col: int

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.last_row - self.first_row + 1, self.last_col - self.first_col + 1


@dataclass(frozen=True, slots=True, eq=False)
class RawHead:
    """What a file says of itself before any height is read.

    x0, y0: centre of post (0, 0), row 0 northmost; step_x > 0 eastward, step_y > 0 southward; units of ``crs``.
    band: which one holds the heights, from 1; height = value · scale + offset. south_up: the
    file's rows run northward.
    """

    rows: int
    cols: int
    band: int
    x0: float
    y0: float
    step_x: float
    step_y: float
    south_up: bool
    scale: float
    offset: float
    height_unit: str | None
    crs: pyproj.CRS | None
    crs_height_unit: HeightUnit | None
    vertical_datum: str | None
    conversions: tuple[str, ...]
    warnings: tuple[str, ...]
    from_grid: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RawDem:
    """What a file says, row 0 northmost.

    values: (rows, cols) real numbers of the file's own type; height = values · scale + offset, in ``height_unit``,
        which may count downward.
    declared_void: (rows, cols) bool, True where the file itself says "no data", or None when it says nothing.
    x0, y0: centre of post (0, 0); step_x > 0 eastward, step_y > 0 southward, all in units of ``crs``.
    crs: None when the file has none, with its datum shift where it states one.
    height_unit: as the file spells it, None when it does not say; crs_height_unit: that of its vertical CRS, with
        its direction.
    from_grid: written from an ElevationGrid, so its positions stay as they are and only NaN means unknown.
    """

    values: npt.NDArray[Any]
    declared_void: npt.NDArray[np.bool_] | None
    x0: float
    y0: float
    step_x: float
    step_y: float
    crs: pyproj.CRS | None
    driver: str
    scale: float = 1.0
    offset: float = 0.0
    height_unit: str | None = None
    crs_height_unit: HeightUnit | None = None
    vertical_datum: str | None = None
    from_grid: bool = False
    conversions: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
