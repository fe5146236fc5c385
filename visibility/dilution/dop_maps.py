"""Maps of dilution of precision for a rover: at every post of the grid, at one height above the ground."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import get_args

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.dilution.columns_of_air import ColumnTables, column_tables
from visibility.dilution.dop import Dop, solve
from visibility.dilution.dop_per_set import solve_per_set
from visibility.dilution.dop_questions import DopKind, DopReason, Measure, kind_code
from visibility.dilution.ground_normals import post_normals
from visibility.dilution.sets_in_sight import sets_of
from visibility.errors import VisibilityInputError
from visibility.sight.minimum_altitude import UNKNOWN, MinimumVisibleAltitude

__all__ = ["GO", "NO_GO", "DopMap", "antenna_points", "check_receiver", "dop_map"]

GO, NO_GO = np.uint8(0), np.uint8(1)

# How many posts are in work at once: what is kept of each between two kernels stays near the processor.
POSTS_AT_ONCE = 65_536


@dataclass(frozen=True, eq=False)
class DopMap:
    """The answer to ``dop_map``.

    dop: (rows, cols) float32, the dilution asked for; +inf = no fix, NaN = unknown. reasons: same shape, DopReason.
    count: same shape uint16, anchors in sight for certain. unknown: same shape bool.
    """

    minimum: MinimumVisibleAltitude
    dop: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint16]
    unknown: npt.NDArray[np.bool_]
    reasons: npt.NDArray[np.uint8]
    above_ground_m: float
    kind: DopKind
    measure: Measure
    on_surface: bool
    per_visible_set: bool
    elapsed_s: float
    version: str

    def posts_of(self) -> dict[DopReason, int]:
        """How many posts there are of each reason."""
        return {reason: int(np.count_nonzero(self.reasons == reason)) for reason in DopReason}

    def no_go(self, dop_limit: float, anchors: int = 0) -> npt.NDArray[np.uint8]:
        """(rows, cols) uint8: NO_GO 1 where the dilution is dop_limit or more, or fewer than so many anchors are seen.

        GO 0 elsewhere, UNKNOWN 255 where the visible set is unknown. Raises VisibilityInputError.
        """
        if not (math.isfinite(dop_limit) and dop_limit > 0.0):
            raise VisibilityInputError(f"dop_limit must be a number > 0, not {dop_limit}.")
        ground = np.where((self.dop >= np.float32(dop_limit)) | (self.count < anchors), NO_GO, GO)
        ground[self.unknown] = UNKNOWN
        return ground


def dop_map(
    minimum: MinimumVisibleAltitude,
    above_ground_m: float,
    kind: DopKind = "ranging",
    *,
    measure: Measure = "pdop",
    on_surface: bool = False,
    per_visible_set: bool = False,
) -> DopMap:
    """Dilution of precision of a rover's antenna over every post of the grid.

    above_ground_m: height of the antenna, metres, >= 0. measure: which dilution; De Vivo's (eq. 16) is "pdop".
    on_surface: the rover is on the ground and only its motion along it is unknown, by the slope at each post.
    per_visible_set: calculate one dilution for each distinct visible set, in the middle of the posts that have it, as
        De Vivo et al. (II-C) do for volumes of about 1 km; see docs/dop.md for its error. Not together with
        on_surface.
    Raises VisibilityInputError.
    """
    started_s = time.perf_counter()
    grid = minimum.grid
    check_receiver(above_ground_m)
    if measure not in get_args(Measure):
        raise VisibilityInputError(f"measure must be one of {', '.join(get_args(Measure))}, not {measure!r}.")
    if on_surface and per_visible_set:
        raise VisibilityInputError("per_visible_set has no one slope; ask for it without on_surface.")
    kind_code(kind)
    tables = column_tables(minimum)
    dop = np.empty(grid.shape, np.float32)
    count, reasons = np.empty(grid.shape, np.uint16), np.empty(grid.shape, np.uint8)
    step = grid.rows if per_visible_set else max(POSTS_AT_ONCE // grid.cols, 1)
    for first in range(0, grid.rows, step):
        stop = min(first + step, grid.rows)
        found = _of_rows(minimum, tables, (first, stop), above_ground_m, kind, on_surface, per_visible_set)
        dop[first:stop] = getattr(found, measure).reshape(stop - first, -1)
        count[first:stop] = found.count.reshape(stop - first, -1)
        reasons[first:stop] = found.reason.reshape(stop - first, -1)
    return DopMap(
        minimum=minimum,
        dop=dop,
        count=count,
        unknown=reasons == DopReason.UNKNOWN,
        reasons=reasons,
        above_ground_m=float(above_ground_m),
        kind=kind,
        measure=measure,
        on_surface=on_surface,
        per_visible_set=per_visible_set,
        elapsed_s=time.perf_counter() - started_s,
        version=VERSION,
    )


def check_receiver(above_ground_m: float) -> None:
    """Refuse an antenna below the ground; raises VisibilityInputError."""
    if not (math.isfinite(above_ground_m) and above_ground_m >= 0.0):
        raise VisibilityInputError(f"Receiver above_ground_m must be >= 0 m, not {above_ground_m}.")


def antenna_points(grid: ElevationGrid, rows: tuple[int, int], above_ground_m: float) -> npt.NDArray[np.float64]:
    """(posts, 3) east, north, altitude of an antenna over the posts of some rows, (first, stop); NaN = unknown."""
    east_m, north_m = grid.position_of(np.arange(*rows)[:, None], np.arange(grid.cols))
    points_m = np.empty((rows[1] - rows[0], grid.cols, 3))
    points_m[..., 0], points_m[..., 1] = east_m, north_m
    points_m[..., 2] = grid.heights_m[slice(*rows)] + np.float32(above_ground_m)
    return points_m.reshape(-1, 3)


def _of_rows(
    minimum: MinimumVisibleAltitude,
    tables: ColumnTables,
    rows: tuple[int, int],
    above_ground_m: float,
    kind: DopKind,
    on_surface: bool,
    per_visible_set: bool,
) -> Dop:
    """Dilutions at the posts of some rows, (first, stop)."""
    grid = minimum.grid
    points = antenna_points(grid, rows, above_ground_m)
    sets = sets_of(minimum, tables, points)
    if per_visible_set:
        return solve_per_set(points, tables.sources, sets.mask, sets.unknown, kind)
    normals = post_normals(grid, *rows) if on_surface else None
    return solve(points, tables.sources, sets.mask, sets.unknown, kind, normals)
