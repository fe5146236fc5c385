"""Anchors with a range limit over a raster of any size: each over the ground in its reach alone, read by a window."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, LargeDem
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor
from visibility.sight.curvature import Curvature
from visibility.sight.fast_errors import FastErrors, fast_errors
from visibility.sight.minimum_altitude import Mode, UnknownGround
from visibility.signal.usable import min_usable_altitude

__all__ = ["Raster", "Reach", "ReachOptions", "Reached", "box_of", "in_reach", "name_of", "reach_of", "work_bytes"]

# what windows are taken of: a file whose posts stay in it, or a grid
Raster = LargeDem | ElevationGrid

# heights, altitudes, turned ground, receivers, classes and masks of one anchor, per post of its window
BYTES_PER_POST = 4 * 5 + 4
# posts beyond the reach that a line to its border may still touch
RIM = 2


@dataclass(frozen=True, slots=True)
class Reach:
    """The posts that an anchor's range can touch, ends included."""

    first_row: int
    last_row: int
    first_col: int
    last_col: int

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, cols)."""
        return self.last_row - self.first_row + 1, self.last_col - self.first_col + 1

    @property
    def posts(self) -> int:
        """How many they are."""
        rows, cols = self.shape
        return rows * cols


@dataclass(frozen=True, slots=True)
class ReachOptions:
    """How sight is calculated, and at which height: exactly one of above_ground_m and altitude_m, metres."""

    above_ground_m: float | None
    altitude_m: float | None
    mode: Mode = "fast"
    unknown: UnknownGround = "unknown"
    curvature: Curvature | None = None


@dataclass(frozen=True, eq=False)
class Reached:
    """What one anchor sees of the ground in its reach.

    altitude_m: (rows, cols) float32 as in MinimumVisibleAltitude. seen: (rows, cols) uint8, 1 visible, 0 hidden, 255
    unknown, at the receiver's height. errors: of fast mode, None in exact mode and where a signal decided.
    error_statement: what it may be off by.
    """

    reach: Reach
    altitude_m: npt.NDArray[np.float32]
    seen: npt.NDArray[np.uint8]
    curvature: str
    errors: FastErrors | None
    error_statement: str
    warnings: tuple[str, ...]
    version: str


def name_of(dem: Raster) -> str:
    """What a raster is called in sentences."""
    return dem.name if isinstance(dem, LargeDem) else dem.provenance.source or "the DEM"


def reach_of(dem: Raster, anchor: Anchor) -> Reach | None:
    """The posts of a raster that an anchor's range can touch; None where there are none.

    Raises VisibilityInputError for an anchor without a range limit.
    """
    range_m = anchor.limits.max_range_m
    if not math.isfinite(range_m):
        posts = dem.rows * dem.cols
        raise VisibilityInputError(
            f"Anchor {anchor.id} has no range limit, so all {posts:,} posts of {name_of(dem)} are in its reach, which "
            f"take about {work_bytes(posts) / 1e9:,.2g} GB of memory; give it max_range_m, or read the DEM whole."
        )
    row, col = dem.post_at(anchor.east_m, anchor.north_m)
    rows, cols = range_m / dem.cell_north_m + RIM, range_m / dem.cell_east_m + RIM
    first_row, last_row = max(0, math.ceil(row - rows)), min(dem.rows - 1, math.floor(row + rows))
    first_col, last_col = max(0, math.ceil(col - cols)), min(dem.cols - 1, math.floor(col + cols))
    if first_row > last_row or first_col > last_col:
        return None
    return Reach(first_row, last_row, first_col, last_col)


def box_of(reaches: Sequence[Reach]) -> Reach:
    """The posts around all of some reaches, at least one."""
    return Reach(
        min(reach.first_row for reach in reaches),
        max(reach.last_row for reach in reaches),
        min(reach.first_col for reach in reaches),
        max(reach.last_col for reach in reaches),
    )


def work_bytes(posts: int) -> int:
    """About how much memory one anchor's sight over so many posts takes."""
    return BYTES_PER_POST * posts


def in_reach(dem: Raster, anchor: Anchor, reach: Reach, options: ReachOptions) -> Reached:
    """Read the ground in an anchor's reach and work out its sight over it: what ``min_usable_altitude`` says of it.

    Ground beyond the range hides nothing within it. Raises DemReadError, AnchorError, VisibilityInputError.
    """
    grid = dem.window(reach.first_row, reach.last_row, reach.first_col, reach.last_col)
    found = min_usable_altitude(grid, [anchor], options.mode, options.curvature, unknown=options.unknown)
    seen = found.visible(above_ground_m=options.above_ground_m, altitude_m=options.altitude_m)
    exact = options.mode == "exact" or found.of_signals
    errors = None if exact else fast_errors(grid.heights_m, found.altitude_m)
    return Reached(
        reach=reach,
        altitude_m=found.altitude_m[0],
        seen=seen[0],
        curvature=found.curvature.sentence(),
        errors=errors,
        error_statement=found.error_statement if errors is None else errors.sentence(),
        warnings=(*grid.provenance.warnings, *found.warnings),
        version=found.version,
    )
