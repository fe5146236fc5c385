"""What stands on a grid in the way of its sight lines: behind it on maps, and over single lines."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.errors import AnchorError
from visibility.sight.kernels.roofs import (
    Buckets,
    cast_shadows,
    cover_posts,
    cover_squares,
    fill_buckets,
    highest_roof,
    scan_roofs,
)

__all__ = [
    "RoofsOverLines",
    "least_heights_clear",
    "raise_behind_roofs",
    "refuse_under_roof",
    "roof_edges_crossed",
    "roof_heights",
    "roofs_for_kernels",
    "roofs_over",
    "roofs_over_lines",
]

Reals = npt.NDArray[np.float64]
Heights = npt.NDArray[np.float32]

# squares of the map that shapes are sorted into: so many for each shape, and no more in all
SQUARES_PER_SHAPE = 0.5
MOST_SQUARES = 4_000_000
# an anchor that stands on a roof may be so far below it by rounding
ROOF_TOLERANCE_M = 1e-3


@dataclass(frozen=True, eq=False)
class RoofsOverLines:
    """What n lines find of roofs.

    clearance_m: (n,) least height over the edges of roofs that a line crosses and over the roofs at its ends; negative
    = in the way; +inf where it meets none. share: (n,) how far along the line; roof_m: (n,) altitude of the roof there;
    NaN where it meets none. zone_m: (n,) least clearance / sqrt(share·(1 - share)), +inf where it meets none.
    """

    clearance_m: Reals
    share: Reals
    roof_m: Reals
    zone_m: Reals


@dataclass(frozen=True, eq=False, slots=True)
class _InPosts:
    """The edges and triangles of what stands on one grid, (row, col, altitude), and where to look for them."""

    edges: Reals
    triangles: Reals
    edge_buckets: Buckets
    roof_buckets: Buckets


_of_grid: weakref.WeakKeyDictionary[ElevationGrid, _InPosts] = weakref.WeakKeyDictionary()


def roof_heights(grid: ElevationGrid) -> Heights:
    """(rows, cols) float32, altitude of the highest roof over each post, m; -inf where nothing stands."""
    highest_m = np.full(grid.shape, -np.inf, np.float32)
    if grid.standing is not None:
        cover_posts(_in_posts(grid).triangles, highest_m)
    return highest_m


def least_heights_clear(grid: ElevationGrid) -> Reals:
    """(rows, cols) post heights with those of every square that a roof touches raised to it; NaN = unknown ground.

    The surface between these posts is nowhere below ground or roofs.
    """
    heights_m = grid.heights_m.astype(np.float64)
    if grid.standing is not None:
        highest_m = np.full(grid.shape, -np.inf)
        cover_squares(_in_posts(grid).triangles, highest_m)
        heights_m = np.maximum(heights_m, highest_m)
    return heights_m


def roofs_over(grid: ElevationGrid, east_m: Reals, north_m: Reals) -> Reals:
    """(n,) altitude of the highest roof over each place, m; -inf where nothing stands."""
    if grid.standing is None:
        return np.full(len(east_m), -np.inf)
    found = _in_posts(grid)
    places = zip(*(values.tolist() for values in grid.post_at(east_m, north_m)), strict=True)
    return np.array([highest_roof(found.triangles, found.roof_buckets, row, col) for row, col in places], np.float64)


def roof_edges_crossed(grid: ElevationGrid, start_m: Reals, end_m: Reals) -> Reals:
    """(k,) shares 0..1, rising, of the straight way over the map from (east, north, …) to another where it crosses an
    edge at which a roof ends or bends.
    """
    if grid.standing is None:
        return np.empty(0)
    first = grid.standing.edges_m[:, 0, :2]
    edge, along, off = grid.standing.edges_m[:, 1, :2] - first, (end_m - start_m)[:2], first - start_m[:2]
    across = along[0] * edge[:, 1] - along[1] * edge[:, 0]
    meets = across != 0.0
    safe = np.where(meets, across, 1.0)
    share = (off[:, 0] * edge[:, 1] - off[:, 1] * edge[:, 0]) / safe
    on_edge = (off[:, 0] * along[1] - off[:, 1] * along[0]) / safe
    return np.unique(share[meets & (share >= 0.0) & (share <= 1.0) & (on_edge >= 0.0) & (on_edge <= 1.0)])


def refuse_under_roof(grid: ElevationGrid, called: str, east_m: float, north_m: float, altitude_m: float) -> None:
    """Raise AnchorError for an anchor below the roof of a building; called: what the sentence calls it."""
    roof_m = float(roofs_over(grid, np.array([east_m]), np.array([north_m]))[0])
    if altitude_m < roof_m - ROOF_TOLERANCE_M:
        raise AnchorError(
            f"{called} is inside a building, {roof_m - altitude_m:.1f} m below its roof ({roof_m:.1f} m); raise it "
            "above the roof, or move it."
        )


def raise_behind_roofs(
    grid: ElevationGrid, eyes: Reals, drop_per_m2: float, altitude_m: Heights, *, distant: bool = False
) -> None:
    """Raise minimum altitudes (k, rows, cols) in place to what is clear of every roof on the grid, NaN apart.

    eyes: (k, 3) row, col, altitude. drop_per_m2: of curvature. distant: the eyes' altitudes are over the plane that
    touches the grid's middle, from which ground and roofs bend away, and not over the ground below them.
    """
    found = _in_posts(grid)
    per_row2_m, per_col2_m = drop_per_m2 * grid.cell_north_m**2, drop_per_m2 * grid.cell_east_m**2
    if not distant:
        cast_shadows(found.edges, eyes, (per_row2_m, per_col2_m), altitude_m)
    else:
        middle_row, middle_col = (grid.rows - 1) / 2.0, (grid.cols - 1) / 2.0

        def drop_m(row: Reals, col: Reals) -> Reals:
            return per_row2_m * (row - middle_row) ** 2 + per_col2_m * (col - middle_col) ** 2

        edges = found.edges.copy()
        edges[..., 2] -= drop_m(edges[..., 0], edges[..., 1])
        bent_m = drop_m(
            np.arange(grid.rows, dtype=np.float64)[:, None], np.arange(grid.cols, dtype=np.float64)[None, :]
        )
        behind_m = np.full(altitude_m.shape, -np.inf, np.float32)
        cast_shadows(edges, eyes, (0.0, 0.0), behind_m)
        np.maximum(altitude_m, behind_m + bent_m.astype(np.float32), out=altitude_m)
    np.maximum(altitude_m, roof_heights(grid), out=altitude_m)


def roofs_over_lines(grid: ElevationGrid, start: Reals, end: Reals, drop_per_m2: float) -> RoofsOverLines:
    """What lines from start to end, (n, 3) row, col, altitude each, find of the roofs on a grid."""
    found = _in_posts(grid)
    lines = np.stack([start, end], axis=1)
    step = end - start
    sags_m = drop_per_m2 * ((step[:, 0] * grid.cell_north_m) ** 2 + (step[:, 1] * grid.cell_east_m) ** 2)
    least = np.empty((len(lines), 4))
    scan_roofs(found.edges, found.edge_buckets, found.triangles, found.roof_buckets, lines, sags_m, least)
    clearance_m, share, roof_m, zone_m = least.T.copy()
    return RoofsOverLines(clearance_m, share, roof_m, zone_m)


def roofs_for_kernels(grid: ElevationGrid) -> tuple[Reals, Buckets, Reals, Buckets]:
    """(edges, their buckets, triangles, their buckets) of what stands on a grid, empty where nothing does."""
    if grid.standing is None:
        edges, triangles = np.empty((0, 2, 3)), np.empty((0, 3, 3))
        return edges, _buckets(edges), triangles, _buckets(triangles)
    found = _in_posts(grid)
    return found.edges, found.edge_buckets, found.triangles, found.roof_buckets


def _in_posts(grid: ElevationGrid) -> _InPosts:
    kept = _of_grid.get(grid)
    if kept is None:
        standing = grid.standing
        assert standing is not None, "asked only where something stands"
        edges, faces = _posts_of(grid, standing.edges_m), _posts_of(grid, standing.faces_m)
        across = faces[:, 1:, :2] - faces[:, :1, :2]
        triangles = faces[np.linalg.det(across) != 0.0]  # walls are over nothing
        kept = _InPosts(edges, triangles, _buckets(edges), _buckets(triangles))
        _of_grid[grid] = kept
    return kept


def _posts_of(grid: ElevationGrid, corners_m: Reals) -> Reals:
    posts = np.empty(corners_m.shape)
    posts[..., 0], posts[..., 1] = grid.post_at(corners_m[..., 0], corners_m[..., 1])
    posts[..., 2] = corners_m[..., 2]
    return posts


def _buckets(corners: Reals) -> Buckets:
    """Squares of the map over shapes (n, corners, 3), about as many as there are shapes."""
    count = len(corners)
    if count == 0:
        return Buckets(np.zeros(2, np.int64), np.zeros(0, np.int64), np.zeros(1), 0.0, 0.0, 1.0, 1, 1)
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    low_row, low_col = low.min(axis=0)
    tall, broad = np.maximum(high.max(axis=0) - (low_row, low_col), 1e-6)
    squares = min(max(SQUARES_PER_SHAPE * count, 1.0), MOST_SQUARES)
    size = max(float(np.sqrt(tall * broad / squares)), float(max(tall, broad)) / squares, 1e-6)
    rows, cols = int(tall // size) + 1, int(broad // size) + 1
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    starts, highest_m = np.zeros(rows * cols + 1, np.int64), np.full(rows * cols, -np.inf)
    where = float(low_row), float(low_col), size, rows, cols
    tops_m = corners[..., 2].max(axis=1)
    fill_buckets(boxes, tops_m, Buckets(starts, np.zeros(0, np.int64), highest_m, *where), False)
    np.cumsum(starts, out=starts)
    numbers, filled = np.zeros(int(starts[-1]), np.int64), starts.copy()
    fill_buckets(boxes, tops_m, Buckets(filled, numbers, highest_m, *where), True)
    return Buckets(starts, numbers, highest_m, *where)
