"""The proof that no flight leads from a place to another: lines between posts over which there is no air to cross."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

from planning.questions.flight_problems import FlightProblem

from .leaves import Graph

__all__ = ["surely_shut"]

Floats = npt.NDArray[np.float64]


def surely_shut(problem: FlightProblem) -> bool:
    """Whether start and goal are parted by lines of the triangulation that cannot be crossed at any altitude.

    Over a place the air begins a bubble above its ground at least, however far the ground beside it is.
    """
    grid, heights_m = problem.grid, problem.grid.heights_m.astype(np.float64)
    lowest, highest = [heights_m + problem.bubble_m], [np.full(grid.shape, problem.ceiling_m)]
    if problem.ceiling_above_ground:
        highest[0] = highest[0] + heights_m
    if problem.above is not None:
        above = problem.above
        lowest.append(above.safe_above_m.astype(np.float64))
        highest.append(
            heights_m + above.ceiling_m if above.ceiling_above_ground else highest[0] * 0.0 + above.ceiling_m
        )
    # what is over unknown ground is shut, and so is what has no safe altitude, all along a line that ends there
    rooms = [np.nan_to_num(top - low, nan=-np.inf) for low, top in itertools.product(lowest, highest)]
    rows, cols = grid.rows - 1, grid.cols - 1
    west = 2 * np.arange(rows * cols).reshape(rows, cols)
    east = west + 1
    edges = [
        _open((west, east), rooms, (slice(None, -1), slice(None, -1)), (slice(1, None), slice(1, None))),
        _open((east[:, :-1], west[:, 1:]), rooms, (slice(None, -1), slice(1, -1)), (slice(1, None), slice(1, -1))),
        _open((west[:-1], east[1:]), rooms, (slice(1, -1), slice(None, -1)), (slice(1, -1), slice(1, None))),
    ]
    parts = Graph(2 * rows * cols, np.concatenate(edges)).labels()
    begin, end = (parts[_over(problem, place)] for place in (problem.start, problem.goal))
    return not np.isin(begin, end).any()


def _open(
    pair: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
    rooms: list[Floats],
    one: tuple[slice, slice],
    other: tuple[slice, slice],
) -> npt.NDArray[np.int64]:
    """(m, 2) triangles whose common lines, between posts one and other, may have air somewhere.

    Room between two surfaces is linear along a line, so it is greatest at one of its ends.
    """
    crossed = np.ones(pair[0].shape, np.bool_)
    for room_m in rooms:
        crossed &= np.maximum(room_m[one], room_m[other]) >= 0.0
        crossed &= np.isfinite(room_m[one]) & np.isfinite(room_m[other])
    return np.column_stack([side[crossed] for side in pair])


def _over(problem: FlightProblem, place: tuple[float, float, float]) -> npt.NDArray[np.int64]:
    """Triangles over which a place may be."""
    row, col = problem.grid.post_at(place[0], place[1])
    rows, cols = problem.grid.rows - 1, problem.grid.cols - 1
    top, left = min(max(int(row), 0), rows - 1), min(max(int(col), 0), cols - 1)
    return np.array([2 * (top * cols + left), 2 * (top * cols + left) + 1])
