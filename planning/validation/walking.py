"""A path walked over the DEM: where the samples lie, what ground is under them, when the rover is there."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid, height_at

__all__ = ["STEPS_PER_CELL", "Walk", "walk_along"]

Numbers = npt.NDArray[np.float64]
Speed = Callable[[Numbers], Numbers]

STEPS_PER_CELL = 4
# A place this near a line between triangles, in cells, is on it, and then both triangles count.
ON_EDGE = 1e-9
# So many directions around a vertex find all triangles that meet at a post.
AROUND = 8
# Vertices nearer to one another are the same one.
SAME_PLACE_M = 1e-6


@dataclass(frozen=True, eq=False)
class Walk:
    """n samples in the order of the way: each vertex, and the middle of each piece between lines of the triangulation.

    corners_m: (m, 2) the vertices, repeated ones left out. vertex: (n,) number of the corner that a sample is, -1 else.
    place_m: (n, 2) east, north. ground_m: (n,) altitude; NaN outside the grid and on unknown ground.
    heading: (n, 2) unit vector east, north of the way on; zeros where there is none.
    gradients: (n, k, 2) rise per metre (east, north) of the triangles that meet at a sample: those left and right of
        the way, one and the same except on an edge, and at a vertex all around it. NaN where a post is unknown.
    distance_m: (n,) along the ground. time_s: (n,) from the start.
    """

    grid: ElevationGrid
    corners_m: Numbers
    vertex: npt.NDArray[np.int64]
    place_m: Numbers
    ground_m: Numbers
    heading: Numbers
    gradients: Numbers
    distance_m: Numbers
    time_s: Numbers

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.place_m)

    @property
    def slope(self) -> Numbers:
        """(n, k) tangent of the ground's slope."""
        size: Numbers = np.hypot(self.gradients[..., 0], self.gradients[..., 1])
        return size

    @property
    def along(self) -> Numbers:
        """(n, k) tangent of the ground along the way, uphill positive; NaN at vertices, where the way turns."""
        return _dot(self.gradients, self._driven)

    @property
    def across(self) -> Numbers:
        """(n, k) tangent of the ground across the way; NaN likewise."""
        return _dot(self.gradients, self._driven[:, ::-1] * (1.0, -1.0))

    @property
    def _driven(self) -> Numbers:
        return np.where((self.vertex >= 0)[:, None], np.nan, self.heading)


def walk_along(grid: ElevationGrid, vertices_m: Numbers, speed: Speed, step_m: float) -> Walk:
    """Walk straight from vertex to vertex (m, 2) with samples at most step_m apart, so that no triangle is passed over.

    speed: m/s over (n,) slopes along the way, radians.
    """
    corners = _without_repeats(vertices_m)
    segment, share, weight = _pieces(grid, corners, step_m)
    legs = np.diff(corners, axis=0)
    length = np.hypot(legs[:, 0], legs[:, 1])
    headings = legs / length[:, None] if len(legs) else np.zeros((1, 2))
    place = corners[segment] + share[:, None] * legs[segment] if len(legs) else np.empty((0, 2))
    heading = headings[segment]
    gradients = _touching(grid, place, np.stack([_left_of(heading), -_left_of(heading)] * (AROUND // 2), axis=1))
    turn = np.linspace(0.0, 2.0 * math.pi, AROUND, endpoint=False) + math.pi / AROUND
    around = np.broadcast_to(np.column_stack([np.sin(turn), np.cos(turn)]), (len(corners), AROUND, 2))
    tangent = np.nan_to_num(_dot(gradients, heading)[:, 0])
    flat_m = weight * length[segment] if len(legs) else np.empty(0)
    ground_m = flat_m * np.sqrt(1.0 + tangent**2)
    seconds = ground_m / speed(np.arctan(tangent))
    # vertices go in between the pieces that end and begin there: segment + share alone rounds away how near one begins
    at_vertex = np.arange(len(corners))
    of_vertex = np.append(headings, headings[-1:], axis=0)[: len(corners)]
    along, legs_begun = np.append(share, np.full(len(corners), -1.0)), np.append(segment, at_vertex)
    order = np.lexsort((along, legs_begun))
    before = np.searchsorted(segment, at_vertex)
    all_places = np.concatenate([place, corners])[order]
    return Walk(
        grid,
        corners,
        np.concatenate([np.full(len(segment), -1), at_vertex])[order],
        all_places,
        height_at(grid, all_places[:, 0], all_places[:, 1]),
        np.concatenate([heading, of_vertex])[order],
        np.concatenate([gradients, _touching(grid, corners, around)])[order],
        _so_far(ground_m, before)[order],
        _so_far(seconds, before)[order],
    )


def gradients_at(grid: ElevationGrid, row: Numbers, col: Numbers) -> Numbers:
    """(n, 2) rise per metre, east and north, of the triangles over which fractional posts lie; NaN outside, unknown."""
    found = np.full((len(row), 2), np.nan)
    if min(grid.shape) < 2:
        return found
    slack = 2.0 * ON_EDGE
    inside = (row >= -slack) & (row <= grid.rows - 1 + slack) & (col >= -slack) & (col <= grid.cols - 1 + slack)
    row, col = row[inside], col[inside]
    top = np.clip(np.floor(row), 0, grid.rows - 2).astype(np.intp)
    left = np.clip(np.floor(col), 0, grid.cols - 2).astype(np.intp)
    heights = grid.heights_m.astype(np.float64, copy=False)
    north_west, south_east = heights[top, left], heights[top + 1, left + 1]
    west = row - top >= col - left
    corner = np.where(west, heights[top + 1, left], heights[top, left + 1])
    east = np.where(west, south_east - corner, corner - north_west) / grid.cell_east_m
    north = np.where(west, north_west - corner, corner - south_east) / grid.cell_north_m
    found[inside] = np.column_stack([east, north])
    return found


def _dot(gradients: Numbers, direction: Numbers) -> Numbers:
    product: Numbers = (gradients * direction[:, None, :]).sum(axis=-1)
    return product


def _without_repeats(vertices_m: Numbers) -> Numbers:
    moved = np.hypot(*np.diff(vertices_m, axis=0).T) > SAME_PLACE_M
    corners: Numbers = vertices_m[np.concatenate([[True], moved])]
    return corners


def _left_of(heading: Numbers) -> Numbers:
    """Unit vectors (n, 2) to the left, in east and north."""
    left: Numbers = heading[:, ::-1] * (-1.0, 1.0)
    return left


def _touching(grid: ElevationGrid, place_m: Numbers, aside: Numbers) -> Numbers:
    """(n, k, 2) gradients right beside places, in directions aside (n, k, 2)."""
    row = (grid.origin_north_m - place_m[:, 1]) / grid.cell_north_m
    col = (place_m[:, 0] - grid.origin_east_m) / grid.cell_east_m
    beside = row[:, None] - ON_EDGE * aside[..., 1], col[:, None] + ON_EDGE * aside[..., 0]
    return gradients_at(grid, beside[0].ravel(), beside[1].ravel()).reshape(*aside.shape)


def _pieces(grid: ElevationGrid, corners: Numbers, step_m: float) -> tuple[npt.NDArray[np.int64], Numbers, Numbers]:
    """(segment, share of it in the middle, share of it taken) of each piece, in the order of the way."""
    row = (grid.origin_north_m - corners[:, 1]) / grid.cell_north_m
    col = (corners[:, 0] - grid.origin_east_m) / grid.cell_east_m
    legs = len(corners) - 1
    found = [(np.arange(legs), np.zeros(legs)), (np.arange(legs), np.ones(legs))]
    found += [_crossings(line[:-1], line[1:]) for line in (row, col, row - col)]
    steps = np.ceil(np.hypot(*np.diff(corners, axis=0).T) / step_m).astype(np.int64)
    found.append(_crossings(np.zeros(legs), steps.astype(np.float64)))
    segment = np.concatenate([numbers for numbers, _ in found])
    share = np.concatenate([shares for _, shares in found])
    order = np.lexsort((share, segment))
    segment, share = segment[order], share[order]
    taken = np.diff(share)
    piece = (np.diff(segment) == 0) & (taken > 0.0)
    return segment[:-1][piece], 0.5 * (share[:-1] + share[1:])[piece], taken[piece]


def _crossings(start: Numbers, end: Numbers) -> tuple[npt.NDArray[np.int64], Numbers]:
    """(segment, share) of every whole number strictly between the ends of each segment."""
    first = np.floor(np.minimum(start, end)) + 1.0
    count = np.maximum(np.ceil(np.maximum(start, end)) - first, 0.0).astype(np.int64)
    segment = np.repeat(np.arange(len(start)), count)
    nth = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    share = (first[segment] + nth - start[segment]) / (end - start)[segment]
    return segment, np.clip(share, 0.0, 1.0)


def _so_far(amount: Numbers, before: npt.NDArray[np.intp]) -> Numbers:
    """Sums up to the middle of each piece, and up to each vertex."""
    ends = np.concatenate([[0.0], np.cumsum(amount)])
    return np.concatenate([ends[:-1] + 0.5 * amount, ends[before]])
