"""Runs an engine for every anchor: near ones, distant ones, and unknown ground on the way to either."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Literal

import numba
import numpy as np
import numpy.typing as npt

from compiled.fresh_memory import take_pages
from terrain import ElevationGrid, height_at
from visibility.sight.anchors import Anchor, DistantAnchor, middle_m
from visibility.sight.curvature import Curvature
from visibility.sight.roofs import raise_behind_roofs
from visibility.sight.sectors import Eye

__all__ = ["Engine", "UnknownGround", "clear_altitudes", "raise_behind_standing"]

UnknownGround = Literal["unknown", "open", "blocked"]
Heights = npt.NDArray[np.float32]

# fills out_m (n_eyes, rows, cols): (heights_m, eyes, curvature drop per squared row and column step, out_m)
Engine = Callable[[Heights, Sequence[Eye], tuple[float, float], Heights], None]

ALWAYS_FRESH_BYTES = 32 << 20  # smaller pieces of memory the C library may give out again, pages and all
PARCEL = 8  # anchors between two reports of progress


def clear_altitudes(
    grid: ElevationGrid,
    anchors: tuple[Anchor | DistantAnchor, ...],
    engine: Engine,
    curvature: Curvature,
    unknown: UnknownGround,
    progress: Callable[[float], None] | None,
) -> tuple[Heights, Heights]:
    """(hidden_below_m, altitude_m), both (n_anchors, rows, cols): terrain only, antenna limits apart.

    Below hidden_below_m known ground hides the anchor; altitude_m is NaN (or what ``unknown`` asks for) where the line
    crosses unknown ground, and the same array where nothing is unknown.
    """
    heights_m = _at_least_two_lines(grid.heights_m)
    # not zeroed: the engines write every post
    altitude_m = np.empty((len(anchors), *heights_m.shape), np.float32)
    if altitude_m.nbytes >= ALWAYS_FRESH_BYTES:
        take_pages(altitude_m.reshape(-1), numba.get_num_threads())
    finished = 0
    for distant, run in itertools.groupby(anchors, key=lambda anchor: isinstance(anchor, DistantAnchor)):
        run_of = tuple(run)
        # all at once shares out best; with someone watching, in parcels
        parcel = len(run_of) if progress is None else PARCEL
        drop_m = _drop_from_middle_m(grid, heights_m.shape, curvature) if distant else None
        for start in range(0, len(run_of), parcel):
            some = run_of[start : start + parcel]
            out_m = altitude_m[finished : finished + len(some)]
            eyes = [_eye(grid, anchor) for anchor in some]
            if drop_m is None:
                c = curvature.drop_per_m2
                engine(heights_m, eyes, (c * grid.cell_north_m**2, c * grid.cell_east_m**2), out_m)
            else:
                engine(heights_m - drop_m, eyes, (0.0, 0.0), out_m)
                out_m += drop_m
            finished += len(some)
            if progress is not None:
                progress(finished / len(anchors))
    hidden_below_m = altitude_m
    if grid.unknown_posts:
        hidden_below_m, altitude_m = _with_unknown(grid, heights_m, anchors, engine, altitude_m, unknown)
    posts_m = altitude_m[:, : grid.rows, : grid.cols]
    # one array where they are the same, so that nobody works on it twice
    return posts_m if hidden_below_m is altitude_m else hidden_below_m[:, : grid.rows, : grid.cols], posts_m


def raise_behind_standing(
    grid: ElevationGrid,
    anchors: tuple[Anchor | DistantAnchor, ...],
    curvature: Curvature,
    altitude_m: Heights,
) -> None:
    """Raise altitudes (n_anchors, rows, cols) in place to what is clear of all that stands on the grid; NaN stays."""
    if grid.standing is None:
        return
    start = 0
    for distant, run in itertools.groupby(anchors, key=lambda anchor: isinstance(anchor, DistantAnchor)):
        eyes = np.array([_eye(grid, anchor) for anchor in run], np.float64)
        raise_behind_roofs(grid, eyes, curvature.drop_per_m2, altitude_m[start : start + len(eyes)], distant=distant)
        start += len(eyes)


def _eye(grid: ElevationGrid, anchor: Anchor | DistantAnchor) -> Eye:
    if isinstance(anchor, DistantAnchor):
        east_m, north_m, altitude_m = anchor.position_m(grid)
    else:
        east_m, north_m, altitude_m = anchor.east_m, anchor.north_m, anchor.altitude_m
    row, col = grid.post_at(east_m, north_m)
    # beside a single row or column it makes no difference on which side; the second line of the engines is on the other
    return (-abs(row) if grid.rows == 1 else row, -abs(col) if grid.cols == 1 else col, altitude_m)


def _at_least_two_lines(heights_m: Heights) -> Heights:
    """Give a single row or column of posts the second line that engines need, south or east of it."""
    rows, cols = heights_m.shape
    if rows > 1 and cols > 1:
        return heights_m
    return np.ascontiguousarray(np.pad(heights_m, ((0, int(rows == 1)), (0, int(cols == 1))), mode="edge"))


def _drop_from_middle_m(grid: ElevationGrid, shape: tuple[int, ...], curvature: Curvature) -> Heights:
    """(rows, cols) how far each post lies below the plane that touches the grid's middle."""
    row, col = grid.post_at(*middle_m(grid))
    north_m = (np.arange(shape[0]) - row) * grid.cell_north_m
    east_m = (np.arange(shape[1]) - col) * grid.cell_east_m
    drop_m: Heights = (curvature.drop_per_m2 * np.add.outer(north_m**2, east_m**2)).astype(np.float32)
    return drop_m


def _with_unknown(
    grid: ElevationGrid,
    heights_m: Heights,
    anchors: tuple[Anchor | DistantAnchor, ...],
    engine: Engine,
    hidden_below_m: Heights,
    unknown: UnknownGround,
) -> tuple[Heights, Heights]:
    """(hidden_below_m, altitude_m) once lines over unknown ground are told apart.

    An eye at height 0 over flat known ground with unknown posts as bumps: whatever a bump hides is behind unknown.
    """
    # nothing known in the way, and no ground of its own; straight below the eye NaN says the same
    hidden_below_m[~(hidden_below_m >= -1e20)] = -np.inf
    if unknown == "open":
        return hidden_below_m, hidden_below_m
    void = np.isnan(heights_m)
    bumps = void.astype(np.float32)
    shadow = np.zeros((1, *heights_m.shape), np.float32)
    altitude_m = hidden_below_m.copy()
    for number, anchor in enumerate(anchors):
        row, col, _ = _eye(grid, anchor)
        engine(bumps, [(row, col, 0.0)], (0.0, 0.0), shadow)
        behind = (shadow[0] > 0.0) | void
        east_m, north_m = grid.position_of(row, col)
        if grid.contains(east_m, north_m) and np.isnan(height_at(grid, east_m, north_m)):
            behind[:] = True  # every line starts over unknown ground
        altitude_m[number][behind] = np.nan if unknown == "unknown" else np.inf
    if unknown == "blocked":
        return altitude_m, altitude_m
    return hidden_below_m, altitude_m
