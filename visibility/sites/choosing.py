"""The sites that see most, apart from each other: candidates to place anchors at."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.errors import VisibilityInputError

from .site_maps import SiteMap

__all__ = ["Site", "best_sites"]


@dataclass(frozen=True, slots=True)
class Site:
    """A post as a site: where it is, and how much of the target ground it surely sees, m² and 0..1."""

    row: int
    col: int
    east_m: float
    north_m: float
    ground_m: float
    seen_m2: float
    seen_share: float


def best_sites(
    found: SiteMap, count: int, min_separation_m: float = 0.0, within: npt.NDArray[np.bool_] | None = None
) -> tuple[Site, ...]:
    """Up to so many sites by what they see, most first, each at least so far from those before it.

    within: (rows, cols) bool, posts where a site may stand; None: any known one. Sites that see nothing are none.
    Raises VisibilityInputError.
    """
    if count < 1:
        raise VisibilityInputError(f"At least one site is asked for, not {count}.")
    if not (0.0 <= min_separation_m < math.inf):
        raise VisibilityInputError(f"Sites are a finite distance apart, not {min_separation_m:g} m.")
    grid = found.grid
    left = np.where(np.isnan(found.seen_m2), np.float32(0.0), found.seen_m2)
    if within is not None:
        if within.shape != grid.shape:
            raise VisibilityInputError(f"Where sites may stand is {grid.shape} like the grid, not {within.shape}.")
        left = np.where(within, left, np.float32(0.0))
    sites: list[Site] = []
    while len(sites) < count:
        row, col = (int(index) for index in np.unravel_index(int(np.argmax(left)), left.shape))
        if not left[row, col] > 0.0:
            break
        east_m, north_m = (float(value) for value in grid.position_of(row, col))
        seen_m2 = float(found.seen_m2[row, col])
        share = float(found.seen_share[row, col])
        sites.append(Site(row, col, east_m, north_m, float(grid.heights_m[row, col]), seen_m2, share))
        left[row, col] = 0.0
        _clear_around(left, row, col, min_separation_m / grid.cell_north_m, min_separation_m / grid.cell_east_m)
    return tuple(sites)


def _clear_around(left: npt.NDArray[np.float32], row: int, col: int, rows: float, cols: float) -> None:
    """Nothing is left nearer than that to a post; both reaches in posts."""
    if rows <= 0.0:
        return
    first_row, first_col = max(0, row - int(rows)), max(0, col - int(cols))
    part = left[first_row : row + int(rows) + 1, first_col : col + int(cols) + 1]
    down = (np.arange(part.shape[0]) + first_row - row) / rows
    right = (np.arange(part.shape[1]) + first_col - col) / cols
    part[np.add.outer(down**2, right**2) < 1.0] = 0.0
