"""Visibility maps with buildings: terrain first, then whatever a building still hides."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.cover.buildings import Buildings
from visibility.cover.ray_triangle import Engine, MeshHits, lowered_m, mesh_blocks
from visibility.errors import VisibilityInputError
from visibility.sight.anchors import Anchor
from visibility.sight.curvature import Curvature
from visibility.sight.minimum_altitude import HIDDEN, Mode, UnknownGround, min_visible_altitude

__all__ = ["building_hits", "clear_of_buildings", "visible_with_buildings"]

# Segments cast at a time: a million need about 100 MB.
PARCEL = 1 << 18
# Anchors beyond this are satellites; what the Earth bends away within reach of the buildings does not matter to them.
DISTANT_M = 1e6


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
    curvature = Curvature.over(grid, curvature)
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


def clear_of_buildings(
    grid: ElevationGrid,
    buildings: Buildings,
    points_m: npt.ArrayLike,
    anchors_m: npt.ArrayLike,
    curvature: Curvature | None = None,
    *,
    asked: npt.ArrayLike = True,
    engine: Engine = "embree",
) -> npt.NDArray[np.bool_]:
    """(n, k) bool: whether no building stands between points (n, 3) and anchors (k, 3), in the grid's frame.

    Anchors may be as far away as satellites. The ground is not asked.
    asked: (n, k), which lines matter; the others come back False. Raises VisibilityInputError.
    """
    points, anchors = (np.array(given, np.float64, ndmin=2) for given in (points_m, anchors_m))
    for name, given in (("points_m", points), ("anchors_m", anchors)):
        if given.ndim != 2 or given.shape[1] != 3 or not np.isfinite(given).all():
            raise VisibilityInputError(f"{name} must be finite numbers (n, 3), not shape {given.shape}.")
    curvature = Curvature.over(grid, curvature)
    clear = np.array(np.broadcast_to(asked, (len(points), len(anchors))), np.bool_)
    low_m, high_m = buildings.vertices_m.min(axis=0), buildings.vertices_m.max(axis=0)
    for number, anchor_m in enumerate(anchors):
        some = np.flatnonzero(clear[:, number])
        for start in range(0, len(some), PARCEL):
            here = some[start : start + PARCEL]
            way_m = anchor_m - points[here]
            length_m = np.linalg.norm(way_m, axis=1)
            # a satellite's line ends at the farthest corner of all buildings: Embree's float32 holds no orbit
            corner_m = np.maximum(np.abs(points[here] - low_m), np.abs(points[here] - high_m))
            share = np.where(length_m > DISTANT_M, np.linalg.norm(corner_m, axis=1) / np.maximum(length_m, 1.0), 1.0)
            ends_m = points[here] + share[:, None] * way_m
            clear[here, number] = ~building_hits(grid, buildings, curvature, points[here], ends_m, engine).blocked
    return clear


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
