"""Buildings put onto a grid: from footprints with heights, and from meshes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from terrain import ElevationGrid, Standing, height_at
from visibility.cover.buildings import Buildings
from visibility.cover.footprints import Footprint
from visibility.errors import CoverError

__all__ = ["standing_footprints", "standing_mesh", "standing_solids", "with_standing"]

Reals = npt.NDArray[np.float64]

# two directions of faces closer than this are one roof: no line sees the edge between them
FLAT_COSINE = 1.0 - 1e-9


def with_standing(grid: ElevationGrid, parts: Sequence[Standing]) -> ElevationGrid:
    """The grid with buildings on it, beside those that it has: they hide wherever sight is asked for.

    What was done to get them is among the warnings of the grid's provenance.
    """
    parts = [*([] if grid.standing is None else [grid.standing]), *parts]
    if not parts:
        return grid
    notes = tuple(note for part in parts for note in part.notes)
    together = Standing(
        np.concatenate([part.edges_m for part in parts]),
        np.concatenate([part.faces_m for part in parts]),
        sum(part.bodies for part in parts),
        notes,
    )
    told = tuple(note for note in notes if note not in grid.provenance.warnings)
    provenance = replace(grid.provenance, warnings=(*grid.provenance.warnings, *told))
    return replace(grid, standing=together, provenance=provenance)


def standing_footprints(grid: ElevationGrid, footprints: Sequence[Footprint], told: Sequence[str] = ()) -> Standing:
    """Flat-roofed solids of footprints: each roof is its height over the ground under the middle of its footprint.

    told: what is to be known of them already. Footprints whose middle has no known ground are left out, and so are
    those outside the grid, which is told in the notes. Raises CoverError where that leaves nothing.
    """
    if not footprints:
        raise CoverError("There is no footprint of a building to stand on the ground.")
    outlines = [footprint.outline for footprint in footprints]
    middle_m = shapely.bounds(outlines).reshape(-1, 2, 2).mean(axis=1)
    ground_m = np.asarray(height_at(grid, middle_m[:, 0], middle_m[:, 1]), np.float64).reshape(-1)
    placed = np.flatnonzero(~np.isnan(ground_m))
    left_out, count = len(footprints) - len(placed), len(footprints)
    if len(placed) == 0:
        raise CoverError(
            f"None of {count} footprints has known ground under its middle; are they of this place, and in degrees or "
            "metres as their file says?"
        )
    roof_m = ground_m + np.array([footprint.height_m for footprint in footprints])
    raised = sum(footprints[number].min_height_m > 0.0 for number in placed.tolist())
    notes = [*told]
    if left_out:
        notes.append(f"{left_out} of {count} footprints have no known ground under their middle and are left out.")
    if raised:
        notes.append(f"{raised} of {count} footprints begin above the ground (min_height); they count as solid below.")
    edges = [_outline_edges(outlines[number], float(roof_m[number])) for number in placed.tolist()]
    roofs = [_flat_roof(outlines[number], float(roof_m[number])) for number in placed.tolist()]
    walls = [_walls(grid, edge, float(ground_m[number])) for number, edge in zip(placed.tolist(), edges, strict=True)]
    return Standing(np.concatenate(edges), np.concatenate([*roofs, *walls]), len(placed), tuple(notes))


def standing_mesh(buildings: Buildings) -> Standing:
    """The same of a mesh: every body solid from its highest faces down to the ground."""
    corners_m = buildings.vertices_m[buildings.faces]
    merged = buildings.merged_corners()
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    length = np.linalg.norm(normal, axis=1)
    real = length > 0.0
    corners_m, merged = corners_m[real], merged[real]
    normal = normal[real] / length[real, None]
    ends = np.concatenate([merged[:, [0, 1]], merged[:, [1, 2]], merged[:, [2, 0]]])
    places_m = np.concatenate([corners_m[:, [0, 1]], corners_m[:, [1, 2]], corners_m[:, [2, 0]]])
    _, first, edge = np.unique(np.sort(ends, axis=1), axis=0, return_index=True, return_inverse=True)
    face = np.tile(np.arange(len(merged)), 3)
    # the diagonal that cuts a flat face in two is no edge
    order = np.argsort(edge.reshape(-1), kind="stable")
    sizes = np.bincount(edge.reshape(-1))
    pair = np.cumsum(sizes) - sizes
    two = np.flatnonzero(sizes == 2)
    one, other = face[order[pair[two]]], face[order[pair[two] + 1]]
    flat = np.abs((normal[one] * normal[other]).sum(axis=1)) >= FLAT_COSINE
    seen = np.ones(len(sizes), np.bool_)
    seen[two[flat]] = False
    edges_m = places_m[first[seen]]
    level_m = np.hypot(*(edges_m[:, 1, :2] - edges_m[:, 0, :2]).T)
    return Standing(edges_m[level_m > 0.0], corners_m, buildings.count)


def standing_solids(grid: ElevationGrid) -> Buildings | None:
    """What stands on a grid as a mesh, to measure distances to; None where nothing does."""
    if grid.standing is None:
        return None
    corners_m = grid.standing.faces_m.reshape(-1, 3)
    return Buildings(corners_m, np.arange(len(corners_m)).reshape(-1, 3), "the buildings")


def _walls(grid: ElevationGrid, edges_m: Reals, ground_m: float) -> Reals:
    """(m, 3, 3) triangles from the roof's edges down to the lowest ground at them, or under the middle."""
    around_m = np.asarray(height_at(grid, edges_m[:, 0, 0], edges_m[:, 0, 1]), np.float64)
    foot_m = np.nanmin(np.append(around_m, ground_m))
    low_m = edges_m.copy()
    low_m[..., 2] = foot_m
    near, far, below, beyond = edges_m[:, 0], edges_m[:, 1], low_m[:, 0], low_m[:, 1]
    return np.concatenate([np.stack([near, far, beyond], axis=1), np.stack([near, beyond, below], axis=1)])


def _outline_edges(outline: shapely.Polygon, roof_m: float) -> Reals:
    """(n, 2, 3) of the outer ring and the holes."""
    edges = []
    for ring in (outline.exterior, *outline.interiors):
        places_m = shapely.get_coordinates(ring)
        corners_m = np.column_stack([places_m, np.full(len(places_m), roof_m)])
        edges.append(np.stack([corners_m[:-1], corners_m[1:]], axis=1))
    return np.concatenate(edges)


def _flat_roof(outline: shapely.Polygon, roof_m: float) -> Reals:
    """(m, 3, 3) triangles of a polygon at one altitude."""
    triangles = shapely.get_coordinates(shapely.constrained_delaunay_triangles(outline)).reshape(-1, 4, 2)[:, :3]
    return np.concatenate([triangles, np.full((*triangles.shape[:2], 1), roof_m)], axis=2)
