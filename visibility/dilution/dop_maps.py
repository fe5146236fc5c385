"""Maps of dilution of precision at one height above the ground; their no-go zones as polygons, and contour lines."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import cast, get_args

import contourpy
import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from terrain.version import VERSION
from visibility.dilution.dop import Dop, solve, solve_per_set
from visibility.dilution.dop_questions import DopKind, DopReason, Measure, kind_code
from visibility.dilution.ground_normals import post_normals
from visibility.dilution.sets_in_sight import ColumnTables, column_tables, sets_of
from visibility.errors import VisibilityInputError
from visibility.sight.minimum_altitude import UNKNOWN, MinimumVisibleAltitude

__all__ = ["GO", "NO_GO", "DopMap", "Zone", "antenna_points", "check_receiver", "contour_lines", "dop_map", "zones"]

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


Ring = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Zone:
    """A polygon with holes: closed rings (n, 2) of east_m, north_m, first point = last.

    exterior runs counter-clockwise, holes clockwise, as GeoJSON (RFC 7946) wants them.
    """

    exterior: Ring
    holes: tuple[Ring, ...]

    @property
    def area_m2(self) -> float:
        """Area within the exterior and outside the holes."""
        return _signed_area_m2(self.exterior) + sum(_signed_area_m2(hole) for hole in self.holes)


def zones(grid: ElevationGrid, inside: npt.ArrayLike) -> tuple[Zone, ...]:
    """Polygons around the posts (rows, cols) that are inside: every such post is in one of them, and no other post is.

    Borders run half way between a post inside and its neighbour outside, at the edge of the grid half a cell beyond the
    outermost posts. Diagonal neighbours are joined. Raises VisibilityInputError for an array of another shape.
    """
    mask = np.asarray(inside, np.bool_)
    if mask.shape != grid.shape:
        raise VisibilityInputError(f"A mask of zones must have the grid's shape {grid.shape}, not {mask.shape}.")
    generator = contourpy.contour_generator(
        *_half_a_cell_wider(grid), np.pad(mask.astype(np.float64), 1, mode="edge"), fill_type="OuterOffset"
    )
    points, offsets = cast(tuple[list[Ring], list[npt.NDArray[np.uint32]]], generator.filled(0.5, 2.0))
    found = []
    for ring_points, ring_offsets in zip(points, offsets, strict=True):
        rings = [ring_points[start:stop] for start, stop in pairwise(ring_offsets)]
        exterior = rings[0] if _signed_area_m2(rings[0]) > 0.0 else rings[0][::-1]
        holes = tuple(hole if _signed_area_m2(hole) < 0.0 else hole[::-1] for hole in rings[1:])
        found.append(Zone(exterior, holes))
    return tuple(found)


def contour_lines(
    grid: ElevationGrid, dop: npt.ArrayLike, levels: Sequence[float]
) -> dict[float, tuple[npt.NDArray[np.float64], ...]]:
    """Lines (n, 2) of east_m, north_m along which a dilution (rows, cols) has each level.

    Interpolated in 1/dop, which is 0 where there is no fix, so that lines end at no cliff of infinity; none goes where
    dop is NaN. Raises VisibilityInputError.
    """
    values = np.asarray(dop, np.float64)
    if values.shape != grid.shape or min(grid.shape) < 2:
        raise VisibilityInputError(f"Contours need two rows and columns of the grid's shape {grid.shape}.")
    wrong = [level for level in levels if not (np.isfinite(level) and level > 0.0)]
    if wrong:
        raise VisibilityInputError(f"Contour levels of a dilution must be numbers > 0, not {wrong[0]}.")
    east_m = grid.origin_east_m + np.arange(grid.cols) * grid.cell_east_m
    north_m = grid.origin_north_m - np.arange(grid.rows) * grid.cell_north_m
    generator = contourpy.contour_generator(east_m, north_m, np.ma.masked_invalid(1.0 / values), line_type="Separate")
    return {float(level): tuple(cast(list[Ring], generator.lines(1.0 / level))) for level in levels}


def _half_a_cell_wider(grid: ElevationGrid) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """East and north of the posts, and of one more on each side at half the distance."""
    col = np.concatenate([[-0.5], np.arange(grid.cols), [grid.cols - 0.5]])
    row = np.concatenate([[-0.5], np.arange(grid.rows), [grid.rows - 0.5]])
    return grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m


def _signed_area_m2(ring: Ring) -> float:
    """Area of a closed ring, positive counter-clockwise."""
    east_m, north_m = (ring - ring[0]).T  # near zero, so that products lose no digits
    return float(0.5 * np.sum(east_m[:-1] * north_m[1:] - east_m[1:] * north_m[:-1]))
