"""Who is in sight, and how good positioning is, over the whole grid: before a placement and after it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility import Curvature, dop_map, min_visible_altitude

from .placing import Placement
from .targets import Targets

__all__ = ["PlacementMaps", "placement_maps"]


@dataclass(frozen=True, slots=True, eq=False)
class PlacementMaps:
    """Maps (rows, cols) of a placement.

    count_before, count_after: uint8, anchors surely in sight. dop_before, dop_after: float32, the goal's measure of
    dilution; +inf = no fix, NaN = unknown. is_target: uint8, 1 where a post counts. error_statement: of their lines.
    """

    count_before: npt.NDArray[np.uint8]
    count_after: npt.NDArray[np.uint8]
    dop_before: npt.NDArray[np.float32]
    dop_after: npt.NDArray[np.float32]
    is_target: npt.NDArray[np.uint8]
    error_statement: str
    curvature: Curvature


def placement_maps(
    grid: ElevationGrid, placement: Placement, unknown: Literal["unknown", "open", "blocked"] | None = None
) -> PlacementMaps:
    """The maps with the fixed anchors alone, and with those that were placed.

    unknown: what a line over unknown ground is; as the placement took it by default. Raises AnchorError.
    """
    sight, goal = placement.sight, placement.goal
    curvature, told = Curvature.over(grid, sight.curvature), ""
    maps: list[tuple[npt.NDArray[np.uint8], npt.NDArray[np.float32]]] = []
    for anchors in (placement.fixed, (*placement.fixed, *placement.anchors)):
        count = np.zeros(grid.shape, np.uint8)
        dop = np.where(np.isnan(grid.heights_m), np.float32(np.nan), np.float32(np.inf))
        if anchors:
            lines = min_visible_altitude(grid, anchors, sight.mode, curvature, unknown=unknown or sight.unknown)
            height_m = placement.targets.above_ground_m
            found = dop_map(lines, height_m, goal.kind, measure=goal.measure, on_surface=goal.on_surface)
            count, dop, told = found.count.astype(np.uint8), found.dop, lines.error_statement
        maps.append((count, dop))
    (count_before, dop_before), (count_after, dop_after) = maps
    is_target = np.zeros(grid.shape, np.uint8)
    is_target.reshape(-1)[_posts_of(grid, placement.targets)] = 1
    return PlacementMaps(count_before, count_after, dop_before, dop_after, is_target, told, curvature)


def _posts_of(grid: ElevationGrid, targets: Targets) -> npt.NDArray[np.intp]:
    """Flat indices of the posts nearest to the targets."""
    if targets.post is not None:
        return targets.post
    row = np.rint((grid.origin_north_m - targets.point_m[:, 1]) / grid.cell_north_m).astype(np.intp)
    col = np.rint((targets.point_m[:, 0] - grid.origin_east_m) / grid.cell_east_m).astype(np.intp)
    return row * grid.cols + col
