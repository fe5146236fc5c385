"""Candidates that a map of sites proposes: the posts over which an anchor would see most of the targets."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import shapely

from planning.errors import PlacementError
from terrain import ElevationGrid
from visibility import Curvature
from visibility.sites import best_sites, site_map

from .candidates import MOST_CANDIDATES, Candidates, candidate_points, join_candidates
from .targets import Targets

__all__ = ["candidate_sites"]

Mask = npt.NDArray[np.bool_]
# a guide need not be fine: every so many posts only, and few directions
MOST_POSTS = 120_000
DIRECTIONS = 64
# of a square with an even share of the ground, so far apart are proposals
APART = 0.6


def candidate_sites(
    grid: ElevationGrid,
    count: int,
    targets: Targets,
    *,
    above_ground_m: Sequence[float],
    area: shapely.Geometry | None = None,
    max_range_m: float = math.inf,
    min_separation_m: float | None = None,
    what: str = "drone",
    curvature: Curvature | None = None,
    progress: Callable[[float], None] | None = None,
) -> Candidates:
    """Up to ``count`` posts at every height that see most of the targets, spread over the grid or an area of it.

    Of large grids the posts of a coarser one are looked at. min_separation_m: between two of one height; None = such
    that they would spread over all of the area. progress: called with the finished share 0..1. Raises PlacementError.
    """
    if not 1 <= count <= MOST_CANDIDATES:
        raise PlacementError(f"Proposed are 1 to {MOST_CANDIDATES:,} sites, not {count}.")
    if not len(above_ground_m) or not (np.isfinite(above_ground_m).all() and min(above_ground_m) >= 0.0):
        raise PlacementError("Proposed sites need at least one height above ground, each a number of metres >= 0.")
    step = math.ceil(math.sqrt(grid.heights_m.size / MOST_POSTS))
    coarse = ElevationGrid(
        *(grid.heights_m[::step, ::step], grid.cell_east_m * step, grid.cell_north_m * step),
        *(grid.origin_east_m, grid.origin_north_m, grid.crs),
    )
    where = _stands(coarse, area)
    if min_separation_m is None:
        cells_m2 = coarse.cell_east_m * coarse.cell_north_m
        min_separation_m = APART * math.sqrt(float(where.sum()) * cells_m2 / count)
    found = []
    for number, height_m in enumerate(above_ground_m):
        seen = site_map(
            *(coarse, height_m, targets.above_ground_m),
            targets=_wanted(grid, coarse, targets, step),
            max_range_m=max_range_m,
            directions=DIRECTIONS,
            curvature=curvature,
            progress=None if progress is None else _part(progress, number, len(above_ground_m)),
        )
        sites = best_sites(seen, count, min_separation_m, where)
        if sites:
            places_m = [(site.east_m, site.north_m) for site in sites]
            found.append(candidate_points(grid, places_m, above_ground_m=[height_m], what=what))
    if not found:
        raise PlacementError("No post of the area for candidates sees any of the targets, so no site is proposed.")
    return join_candidates(found)


def _part(progress: Callable[[float], None], number: int, of: int) -> Callable[[float], None]:
    return lambda share: progress((number + share) / of)


def _stands(grid: ElevationGrid, area: shapely.Geometry | None) -> Mask:
    """(rows, cols) posts over which a site may stand. Raises PlacementError where there are none."""
    known: Mask = ~np.isnan(grid.heights_m)
    if area is not None:
        col, row = np.meshgrid(np.arange(grid.cols), np.arange(grid.rows))
        known &= shapely.intersects_xy(area, *grid.position_of(row, col))
    if not known.any():
        raise PlacementError("The area for candidates holds no known post of the DEM to propose a site on.")
    return known


def _wanted(grid: ElevationGrid, coarse: ElevationGrid, targets: Targets, step: int) -> Mask:
    """(rows, cols) of the coarse grid: posts that stand for a target."""
    wanted = np.zeros(coarse.shape, np.bool_)
    if targets.post is not None:
        row, col = np.divmod(targets.post, grid.cols)
    else:
        at_row, at_col = grid.post_at(targets.point_m[:, 0], targets.point_m[:, 1])
        row, col = (np.rint(at).astype(np.intp) for at in (at_row, at_col))
    wanted[np.minimum(row // step, coarse.rows - 1), np.minimum(col // step, coarse.cols - 1)] = True
    known = ~np.isnan(coarse.heights_m)
    return wanted & known if (wanted & known).any() else known
