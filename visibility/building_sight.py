"""Visibility maps with buildings: terrain first, then whatever a building still hides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

from .anchors import Anchor
from .buildings import Buildings
from .curvature import Curvature
from .minimum_altitude import HIDDEN, Mode, UnknownGround, min_visible_altitude
from .ray_triangle import Engine, MeshHits, lowered_m, mesh_blocks

__all__ = ["building_hits", "visible_with_buildings"]

# Segments cast at a time: a million need about 100 MB.
PARCEL = 1 << 18


def visible_with_buildings(
    grid: ElevationGrid,
    anchors: Sequence[Anchor],
    receiver_above_ground_m: float,
    buildings: Buildings,
    engine: Engine = "embree",
    *,
    mode: Mode = "exact",
    curvature: Curvature | None = None,
    unknown: UnknownGround = "unknown",
) -> npt.NDArray[np.uint8]:
    """(n_anchors, rows, cols) uint8 for receivers above every post's ground: 1 visible, 0 hidden, 255 unknown.

    Terrain decides as in ``min_visible_altitude``; lines that it leaves clear or unknown are then cast against the
    buildings, so a building in the way hides, whatever ground lies below. A post inside a building is hidden.
    Raises AnchorError, VisibilityInputError.
    """
    curvature = Curvature.of(grid) if curvature is None else curvature
    anchors = tuple(anchors)
    answer = min_visible_altitude(grid, anchors, mode, curvature, unknown=unknown)
    visible = answer.visible(above_ground_m=receiver_above_ground_m)
    posts = np.argwhere(np.isfinite(grid.heights_m))
    receivers_m = np.column_stack(
        [
            grid.origin_east_m + posts[:, 1] * grid.cell_east_m,
            grid.origin_north_m - posts[:, 0] * grid.cell_north_m,
            grid.heights_m[posts[:, 0], posts[:, 1]].astype(np.float64) + receiver_above_ground_m,
        ]
    )
    for number, anchor in enumerate(anchors):
        eye_m = np.array([anchor.east_m, anchor.north_m, anchor.altitude_m])
        open_posts = np.flatnonzero(visible[number, posts[:, 0], posts[:, 1]] != HIDDEN)
        for start in range(0, len(open_posts), PARCEL):
            some = open_posts[start : start + PARCEL]
            eyes_m = np.broadcast_to(eye_m, (len(some), 3))
            hidden = some[building_hits(grid, buildings, curvature, eyes_m, receivers_m[some], engine).blocked]
            visible[number, posts[hidden, 0], posts[hidden, 1]] = HIDDEN
    return visible


def building_hits(
    grid: ElevationGrid,
    buildings: Buildings,
    curvature: Curvature,
    from_points_m: npt.NDArray[np.float64],
    to_points_m: npt.NDArray[np.float64],
    engine: Engine,
) -> MeshHits:
    """What lines between points in the grid's frame meet of the buildings, in the frame that curvature straightens."""
    west_m, south_m, east_m, north_m = grid.bounds_m
    middle_m = ((west_m + east_m) / 2.0, (south_m + north_m) / 2.0)

    def lowered(points_m: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.column_stack([points_m[:, :2], points_m[:, 2] - lowered_m(curvature, middle_m, points_m)])

    straight = Buildings(lowered(buildings.vertices_m), buildings.faces, buildings.source)
    return mesh_blocks(straight, lowered(from_points_m), lowered(to_points_m), engine)
