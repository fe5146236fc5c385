"""Places as fractional posts and in metres, the triangles that a way crosses, the squares that a polygon touches."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import shapely

from terrain import ElevationGrid
from visibility.dilution import surface_normals

__all__ = [
    "Cells",
    "metres_of",
    "middles",
    "outside_of",
    "sampled",
    "squares_touched",
    "squares_with_middle_in",
    "steepest_rad",
]

Floats = npt.NDArray[np.float64]
BESIDE = 1e-6  # cells: a way along an edge lies on the triangles on both sides
Mask = npt.NDArray[np.bool_]
Posts = npt.NDArray[np.integer[Any]]  # row or column numbers
# blocks of so many squares each way are asked before their squares are
BLOCK = 32
# a buffer's arcs are chords inside the true ones; this much further out they are outside
QUARTER = 16
OUTWARD = 1.0 / math.cos(math.pi / (4 * QUARTER))


class Cells(NamedTuple):
    """Size of a grid's cells, as kernels take it, metres."""

    east_m: float
    north_m: float

    @classmethod
    def of(cls, grid: ElevationGrid) -> Cells:
        """Those of a grid."""
        return cls(grid.cell_east_m, grid.cell_north_m)


def metres_of(grid: ElevationGrid, places: Floats) -> tuple[Floats, Floats]:
    """(east_m, north_m), each (n,), of fractional posts (n, 2)."""
    east_m = grid.origin_east_m + places[:, 1] * grid.cell_east_m
    north_m = grid.origin_north_m - places[:, 0] * grid.cell_north_m
    return east_m, north_m


def sampled(places: Floats, apart: float) -> tuple[Floats, npt.NDArray[np.int64]]:
    """(places at most so many cells apart, which of them are the way's own)."""
    out, corners = [places[:1]], [0]
    for begin, end in itertools.pairwise(places):
        steps = max(math.ceil(float(np.hypot(*(end - begin))) / apart), 1)
        share = np.arange(1, steps + 1)[:, None] / steps
        piece = begin + share * (end - begin)
        piece[-1] = end
        out.append(piece)
        corners.append(corners[-1] + steps)
    return np.concatenate(out), np.array(corners, np.int64)


def middles(places: Floats) -> tuple[Floats, Floats]:
    """Of the pieces into which rows, columns and diagonals of the grid cut a way, the middle of each.

    places: (n, 2) fractional posts, less than two cells apart. Returns (m, 2), in order, and (m,): on which of the
    n - 1 pieces of the way each lies, and how far along, as one number.
    """
    begin, end = places[:-1], places[1:]
    shares = [np.zeros(len(begin)), np.ones(len(begin))]
    for before, after in (
        (begin[:, 0], end[:, 0]),
        (begin[:, 1], end[:, 1]),
        (begin[:, 0] - begin[:, 1], end[:, 0] - end[:, 1]),
    ):
        first = np.floor(np.minimum(before, after)) + 1.0
        run = np.where(after == before, np.nan, after - before)
        with np.errstate(over="ignore"):  # a piece that runs along a line by next to nothing crosses it nowhere near
            shares += [np.clip(np.nan_to_num((first + more - before) / run), 0.0, 1.0) for more in range(4)]
    cuts = np.sort(np.stack(shares, axis=1), axis=1)
    middle, length = 0.5 * (cuts[:, 1:] + cuts[:, :-1]), cuts[:, 1:] - cuts[:, :-1]
    piece, number = np.nonzero(length > 0.0)
    share = middle[piece, number]
    return begin[piece] + share[:, None] * (end - begin)[piece], piece + share


def steepest_rad(grid: ElevationGrid, places: Floats) -> float:
    """Slope of the steepest triangle that a way (n, 2) crosses, or runs along the edge of."""
    middle, at = middles(places)
    ahead = np.diff(places, axis=0)[at.astype(np.intp)]
    aside = BESIDE * ahead[:, ::-1] * (1.0, -1.0) / np.hypot(*ahead.T)[:, None]
    normals = [surface_normals(grid, *metres_of(grid, middle + side)) for side in (aside, -aside)]
    upward = np.concatenate(normals)[:, 2]
    return float(np.arccos(np.clip(np.nanmin(upward), -1.0, 1.0)))


def squares_touched(grid: ElevationGrid, zone: shapely.Geometry, apart_m: float) -> Mask:
    """(rows - 1, cols - 1) bool: squares that come within apart_m of a zone, for certain all of them."""
    touched = np.zeros((grid.rows - 1, grid.cols - 1), np.bool_)
    wide = zone.buffer(apart_m * OUTWARD, quad_segs=QUARTER) if apart_m > 0.0 else zone
    shapely.prepare(wide)
    block_rows, block_cols = np.arange(0, grid.rows - 1, BLOCK), np.arange(0, grid.cols - 1, BLOCK)
    row, col = (index.ravel() for index in np.meshgrid(block_rows, block_cols, indexing="ij"))
    last_row, last_col = np.minimum(row + BLOCK, grid.rows - 1), np.minimum(col + BLOCK, grid.cols - 1)
    blocks = _boxes(grid, row, col, last_row, last_col)
    whole, some = shapely.contains_properly(wide, blocks), shapely.intersects(wide, blocks)
    for n in np.flatnonzero(some):
        part = slice(row[n], last_row[n]), slice(col[n], last_col[n])
        if whole[n]:
            touched[part] = True
            continue
        r, c = (
            index.ravel()
            for index in np.meshgrid(np.arange(row[n], last_row[n]), np.arange(col[n], last_col[n]), indexing="ij")
        )
        touched[part] = shapely.intersects(wide, _boxes(grid, r, c, r + 1, c + 1)).reshape(touched[part].shape)
    return touched


def squares_with_middle_in(grid: ElevationGrid, zone: shapely.Geometry) -> Mask:
    """(rows - 1, cols - 1) bool: squares whose middle lies in a zone."""
    inside = np.zeros((grid.rows - 1, grid.cols - 1), np.bool_)
    west_m, south_m, east_m, north_m = zone.bounds
    top, left = grid.post_at(west_m, north_m)
    bottom, right = grid.post_at(east_m, south_m)
    rows = np.arange(max(math.floor(top - 0.5), 0), min(math.ceil(bottom + 0.5), grid.rows - 1))
    cols = np.arange(max(math.floor(left - 0.5), 0), min(math.ceil(right + 0.5), grid.cols - 1))
    if len(rows) and len(cols):
        shapely.prepare(zone)
        e, n = grid.position_of(rows[:, None] + 0.5, cols + 0.5)
        inside[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1] = shapely.intersects_xy(zone, *np.broadcast_arrays(e, n))
    return inside


def outside_of(grid: ElevationGrid, areas: Sequence[shapely.Geometry]) -> shapely.Geometry:
    """What is around the grid and in none of the areas."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    far_m = (east_m - west_m) + (north_m - south_m)
    return shapely.box(west_m - far_m, south_m - far_m, east_m + far_m, north_m + far_m).difference(
        shapely.union_all(areas)
    )


def _boxes(grid: ElevationGrid, row: Posts, col: Posts, last_row: Posts, last_col: Posts) -> npt.NDArray[np.object_]:
    west_m, north_m = grid.position_of(row, col)
    east_m, south_m = grid.position_of(last_row, last_col)
    boxes: npt.NDArray[np.object_] = shapely.box(west_m, south_m, east_m, north_m)
    return boxes
