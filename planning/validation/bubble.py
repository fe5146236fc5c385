"""The safety bubble along a walk: what may not be driven stays further away than the filter's covariance asks for."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from navigation import initial_state, predict_bubble
from planning.questions.problems import PathProblem
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor

from .reports import LimitCheck, PathLimit, check_of
from .sight import AnyAnchor, SightAlong
from .walking import Walk, gradients_at

__all__ = ["bubble_check", "room_m"]

Numbers = npt.NDArray[np.float64]

ROOM_SLACK_M = 1e-3
# no range is exact
LEAST_RANGE_SIGMA_M = 1e-3
# a moving anchor is taken to stand still for so many parts of the way
MOMENTS = 200
# how far beyond the widest bubble it is looked how much room there is
CELLS_BEYOND = 10.0
# inside a triangle, away from its edges, in cells
INSIDE = 1.0 / 3.0


def bubble_check(problem: PathProblem, walk: Walk, sight: SightAlong) -> LimitCheck:
    """d - r at every sample (De Vivo et al., eqs. 25, 27): d to ground too steep or unknown, areas and the border."""
    radius_m = _radii_m(problem, walk, sight)
    widest_m = float(radius_m[np.isfinite(radius_m)].max(initial=0.0))
    reach_m = widest_m + CELLS_BEYOND * max(walk.grid.cell_east_m, walk.grid.cell_north_m)
    room = room_m(walk, reach_m, problem.rover.max_slope_rad, problem.no_go, problem.keep_in)
    return check_of(walk, PathLimit.BUBBLE, room - radius_m, 0.0, at_least=True, slack=ROOM_SLACK_M)


def room_m(
    walk: Walk,
    reach_m: float,
    max_slope_rad: float,
    no_go: Sequence[shapely.Geometry],
    keep_in: Sequence[shapely.Geometry],
) -> Numbers:
    """(n,) horizontal distance to what may not be driven; what is further off than reach_m counts as that far."""
    grid, points = walk.grid, shapely.points(walk.place_m)
    west_m, south_m, east_m, north_m = grid.bounds_m
    border = shapely.box(west_m, south_m, east_m, north_m).exterior
    found = np.asarray(shapely.distance(points, border))
    found[np.isnan(walk.ground_m)] = 0.0
    if no_go:
        found = np.minimum(found, shapely.distance(points, shapely.union_all(no_go)))
    if keep_in:
        allowed = shapely.union_all(keep_in)
        edge_m = shapely.distance(points, shapely.boundary(allowed))
        found = np.minimum(found, np.where(shapely.covers(allowed, points), edge_m, 0.0))
    barred = _barred_triangles(walk, reach_m, math.tan(min(max_slope_rad, 1.57)))
    if len(barred):
        near, apart_m = shapely.STRtree(barred).query_nearest(points, return_distance=True, all_matches=False)
        nearest = np.full(len(points), np.inf)
        nearest[near[0]] = apart_m
        found = np.minimum(found, nearest)
    room: Numbers = np.minimum(found, reach_m)
    return room


def _radii_m(problem: PathProblem, walk: Walk, sight: SightAlong) -> Numbers:
    """(n,) radius of the bubble; +inf over unknown ground."""
    model, limits = problem.navigation, problem.limits
    known = np.isfinite(sight.antenna_m).all(axis=1)
    if not known.any():
        return np.full(len(walk), np.inf)
    points_m, seen = sight.antenna_m[known], sight.seen[known]
    anchors_m, sigma_m, visible = _standing(problem.anchors, sight.sources_m[known], seen)
    first = initial_state(
        0.0,
        points_m[0],
        position_sigma_m=model.initial_sigma_m,
        velocity_sigma_m_per_s=model.initial_velocity_sigma_m_per_s,
    )
    predicted = predict_bubble(
        points_m,
        walk.time_s[known],
        anchors_m,
        visible,
        sigma_m,
        motion=model.motion,
        interval_s=model.interval_s,
        initial_covariance=first.covariance,
        ground_slope=np.nan_to_num(walk.gradients[known, 0]),
        ground_sigma_m=model.ground_sigma_m,
        epsilon=limits.bubble_epsilon,
        dem_sigma_m=limits.dem_sigma_m,
    )
    radius_m = np.full(len(walk), np.inf)
    radius_m[known] = predicted.radius_m
    return radius_m


def _standing(
    anchors: Sequence[AnyAnchor], sources_m: Numbers, seen: npt.NDArray[np.bool_]
) -> tuple[Numbers, Numbers, npt.NDArray[np.bool_]]:
    """(positions, range sigmas, in sight) of anchors that stand; one that moves is one for each part of the way."""
    places, sigmas, columns = [np.zeros((0, 3))], [], []
    part = np.minimum(np.arange(len(seen)) * MOMENTS // max(len(seen), 1), MOMENTS - 1)
    for number, anchor in enumerate(anchors):
        still = isinstance(anchor, Anchor | DistantAnchor)
        for one in [None] if still else np.unique(part).tolist():
            during = np.ones(len(seen), np.bool_) if one is None else part == one
            if one is not None:
                # ranges come between two samples that both have the anchor in sight
                during[1:] |= during[:-1].copy()
            if not (seen[:, number] & during).any():
                continue
            middle = np.flatnonzero(during)[np.count_nonzero(during) // 2]
            places.append(_far(anchor, sources_m[middle, number]))
            sigmas.append(_range_sigma_m(anchor))
            columns.append(seen[:, number] & during)
    visible = np.column_stack(columns) if columns else np.zeros((len(seen), 0), np.bool_)
    return np.concatenate(places), np.array(sigmas), visible


def _far(anchor: AnyAnchor, source_m: Numbers) -> Numbers:
    """(1, 3) a position, also for an anchor of which only the direction counts."""
    distance_m = anchor.range_m if isinstance(anchor, DistantAnchor) else 1.0
    place: Numbers = source_m[None, :] * distance_m
    return place


def _range_sigma_m(anchor: AnyAnchor) -> float:
    sigmas = (getattr(anchor, "ranging_sigma_m", 0.0), getattr(anchor, "pose_sigma_m", 0.0))
    return max(math.hypot(*sigmas), LEAST_RANGE_SIGMA_M)


def _barred_triangles(walk: Walk, reach_m: float, steepest: float) -> npt.NDArray[np.object_]:
    """Triangles near the way that are too steep or have an unknown post."""
    grid = walk.grid
    rows, cols = _squares_near(walk, reach_m)
    found = []
    for down, across, corners in (
        (1.0 - INSIDE, INSIDE, ((0, 0), (1, 0), (1, 1))),
        (INSIDE, 1.0 - INSIDE, ((0, 0), (0, 1), (1, 1))),
    ):
        gradient = gradients_at(grid, rows + down, cols + across)
        bad = ~(np.hypot(gradient[:, 0], gradient[:, 1]) <= steepest)
        if bad.any():
            ring = np.stack([_places(grid, rows[bad] + r, cols[bad] + c) for r, c in corners], axis=1)
            found.append(shapely.polygons(ring))
    return np.concatenate(found) if found else np.zeros(0, np.object_)


def _squares_near(walk: Walk, reach_m: float) -> tuple[Numbers, Numbers]:
    """Rows and columns of the squares that come within reach_m of a sample, and some more."""
    grid = walk.grid
    near = np.zeros((max(grid.rows - 1, 1), max(grid.cols - 1, 1)), np.bool_)
    row = (grid.origin_north_m - walk.place_m[:, 1]) / grid.cell_north_m
    col = (walk.place_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    down = min(math.ceil(reach_m / grid.cell_north_m), grid.rows)
    across = min(math.ceil(reach_m / grid.cell_east_m), grid.cols)
    for r, c in {(int(r), int(c)) for r, c in zip(row.tolist(), col.tolist(), strict=True)}:
        near[max(r - down - 1, 0) : max(r + down + 2, 0), max(c - across - 1, 0) : max(c + across + 2, 0)] = True
    rows, cols = np.nonzero(near)
    return rows.astype(np.float64), cols.astype(np.float64)


def _places(grid: ElevationGrid, row: Numbers, col: Numbers) -> Numbers:
    return np.column_stack([grid.origin_east_m + col * grid.cell_east_m, grid.origin_north_m - row * grid.cell_north_m])
