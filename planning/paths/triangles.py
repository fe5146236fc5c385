"""The triangles that a way crosses: the ground is plane on each, so one place on each tells of all its slopes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid
from visibility.dilution import surface_normals

from .places import metres_of

__all__ = ["middles", "steepest_rad"]

Floats = npt.NDArray[np.float64]

BESIDE = 1e-6  # cells: a way along an edge lies on the triangles on both sides


def middles(places: Floats) -> tuple[Floats, Floats]:
    """Of the pieces into which rows, columns and diagonals of the grid cut a way, the middle of each.

    places: (n, 2) fractional posts, less than two cells apart. Returns (m, 2), in order, and (m,): on which of the
    n - 1 pieces of the way each lies, and how far along, as one number.
    """
    begin, end = places[:-1], places[1:]
    shares = [np.zeros(len(begin)), np.ones(len(begin))]
    for before, after in (
        (begin[:, 0], end[:, 0]),
        (begin[:, 1], end[:, 1]),
        (begin[:, 0] - begin[:, 1], end[:, 0] - end[:, 1]),
    ):
        first = np.floor(np.minimum(before, after)) + 1.0
        run = np.where(after == before, np.nan, after - before)
        shares += [np.clip(np.nan_to_num((first + more - before) / run), 0.0, 1.0) for more in range(4)]
    cuts = np.sort(np.stack(shares, axis=1), axis=1)
    middle, length = 0.5 * (cuts[:, 1:] + cuts[:, :-1]), cuts[:, 1:] - cuts[:, :-1]
    piece, number = np.nonzero(length > 0.0)
    share = middle[piece, number]
    return begin[piece] + share[:, None] * (end - begin)[piece], piece + share


def steepest_rad(grid: ElevationGrid, places: Floats) -> float:
    """Slope of the steepest triangle that a way (n, 2) crosses, or runs along the edge of."""
    middle, at = middles(places)
    ahead = np.diff(places, axis=0)[at.astype(np.intp)]
    aside = BESIDE * ahead[:, ::-1] * (1.0, -1.0) / np.hypot(*ahead.T)[:, None]
    normals = [surface_normals(grid, *metres_of(grid, middle + side)) for side in (aside, -aside)]
    upward = np.concatenate(normals)[:, 2]
    return float(np.arccos(np.clip(np.nanmin(upward), -1.0, 1.0)))
