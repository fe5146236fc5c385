"""How near buildings are in space: the exact distance to their triangles, negative inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from visibility.cover.buildings import Buildings
from visibility.cover.kernels.triangles import LEAF, Tree, bodies_around, nearest_on_mesh
from visibility.errors import VisibilityInputError

__all__ = ["NearestBuilding", "nearest_building", "solid_bodies"]

Array = npt.NDArray[np.float64]

# edges and faces no higher than this over a body's lowest place are its foot
FOOT_M = 0.01
# triangles are put in an order in which neighbours are near each other: so many bits for each axis
BITS = 16


@dataclass(frozen=True, eq=False)
class NearestBuilding:
    """The answer to ``nearest_building``, for n points.

    distance_m: (n,) to the nearest place of a building, in space; negative inside one. nearest_m: (n, 3) that place.
    open_bodies: how many bodies are open surfaces, of which no point is inside.
    """

    distance_m: Array
    nearest_m: Array
    open_bodies: int


def nearest_building(buildings: Buildings, points_m: npt.ArrayLike) -> NearestBuilding:
    """Signed distance of points (n, 3), east, north, altitude in the grid's frame, to buildings.

    A point is inside a body that is closed, or open at its foot only, and has an odd number of its faces straight
    above; which way faces are wound does not matter. From there the nearest place is sought on walls and roofs:
    nobody leaves through the floor. Raises VisibilityInputError.
    """
    try:
        points = np.array(points_m, np.float64, ndmin=2)
    except (TypeError, ValueError) as error:
        raise VisibilityInputError(f"points_m must hold east, north and altitude in metres ({error}).") from error
    if points.size == 0:
        points = points.reshape(0, 3)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise VisibilityInputError(f"points_m must be finite numbers (n, 3), not shape {points.shape}.")
    # about their middle, where numbers are finest
    middle_m = (buildings.vertices_m.min(axis=0) + buildings.vertices_m.max(axis=0)) / 2.0
    corners_m = (buildings.vertices_m - middle_m)[buildings.faces]
    nearest_m, distance_m = np.zeros((len(points), 3)), np.zeros(len(points))
    here_m = np.ascontiguousarray(points - middle_m)
    ordered_m, tree = _tree(corners_m)
    nearest_on_mesh(here_m, ordered_m, tree, nearest_m, distance_m)
    solid = solid_bodies(buildings)
    if solid.any():
        bodies_around(here_m, *_solids(corners_m, buildings.bodies(), solid), nearest_m, distance_m)
    return NearestBuilding(distance_m, nearest_m + middle_m, int(np.count_nonzero(~solid)))


def solid_bodies(buildings: Buildings) -> npt.NDArray[np.bool_]:
    """(bodies,) whether each has an inside: every edge has faces on both sides, but for edges at its foot."""
    body = buildings.bodies()
    corners = buildings.merged_corners()
    edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
    altitude_m = buildings.vertices_m[buildings.faces][..., 2]
    lowest_m = np.full(int(body.max()) + 1, np.inf)
    np.minimum.at(lowest_m, body, altitude_m.min(axis=1))
    above_m = altitude_m - lowest_m[body][:, None]
    top_m = np.concatenate([np.maximum(above_m[:, i], above_m[:, (i + 1) % 3]) for i in range(3)])
    _, first, edge, faces = np.unique(edges, axis=0, return_index=True, return_inverse=True, return_counts=True)
    loose = (faces % 2 == 1) & (top_m[first] > FOOT_M)
    solid = np.ones(len(lowest_m), np.bool_)
    solid[np.tile(body, 3)[loose[edge.reshape(-1)]]] = False
    # a flat sheet on the ground is all foot
    highest_m = np.zeros(len(lowest_m))
    np.maximum.at(highest_m, body, above_m.max(axis=1))
    return solid & (highest_m > FOOT_M)


def _solids(
    corners_m: Array, body: npt.NDArray[np.int32], solid: npt.NDArray[np.bool_]
) -> tuple[Array, npt.NDArray[np.int64], Array]:
    """(corners, bodies, boxes) as ``bodies_around`` takes them: body after body, the floor last."""
    chosen = np.flatnonzero(solid[body])
    number = (np.cumsum(solid) - 1)[body[chosen]]
    count = int(np.count_nonzero(solid))
    corners_m = corners_m[chosen]
    low_m, high_m = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    np.minimum.at(low_m, number, corners_m.min(axis=1))
    np.maximum.at(high_m, number, corners_m.max(axis=1))
    floor = corners_m[..., 2].max(axis=1) <= low_m[number, 2] + FOOT_M
    order = np.lexsort((floor, number))
    faces, walls = np.bincount(number, minlength=count), np.bincount(number[~floor], minlength=count)
    stop = np.cumsum(faces)
    bodies = np.stack([stop - faces, stop - faces + walls, stop], axis=1).astype(np.int64)
    return np.ascontiguousarray(corners_m[order]), bodies, np.stack([low_m, high_m], axis=1)


def _tree(corners_m: Array) -> tuple[Array, Tree]:
    """(corners in the order of a space-filling curve, the tree over them)."""
    centre_m = corners_m.mean(axis=1)
    low_m, extent_m = centre_m.min(axis=0), max(float(np.ptp(centre_m, axis=0).max()), 1e-9)
    cell = ((centre_m - low_m) / extent_m * (2**BITS - 1)).astype(np.uint64)
    code = np.zeros(len(cell), np.uint64)
    for bit in range(BITS):
        for axis in range(3):
            code |= ((cell[:, axis] >> np.uint64(bit)) & np.uint64(1)) << np.uint64(3 * bit + axis)
    ordered_m = np.ascontiguousarray(corners_m[np.argsort(code, kind="stable")])
    starts = np.arange(0, len(ordered_m), LEAF)
    lows = [np.minimum.reduceat(ordered_m.min(axis=1), starts)]
    highs = [np.maximum.reduceat(ordered_m.max(axis=1), starts)]
    while len(lows[-1]) > 1:
        pairs = np.arange(0, len(lows[-1]), 2)
        highs.append(np.maximum.reduceat(highs[-1], pairs))
        lows.append(np.minimum.reduceat(lows[-1], pairs))
    counts = np.array([len(level) for level in lows], np.int64)
    levels = np.stack([np.cumsum(counts) - counts, counts], axis=1)
    return ordered_m, Tree(np.concatenate(lows), np.concatenate(highs), levels)
