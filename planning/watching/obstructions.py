"""Where a path leads through what no rover is on: a building, unknown ground, what is off the map."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from terrain import ElevationGrid

__all__ = ["Obstacle", "ObstructedStretch", "obstructions", "runs_along"]

Floats = npt.NDArray[np.float64]


class Obstacle(StrEnum):
    """Why a rover cannot be on a stretch of its path, as far as the map tells."""

    BUILDING = "building"
    UNKNOWN_GROUND = "unknown ground"
    OUTSIDE = "outside the map"


@dataclass(frozen=True, slots=True)
class ObstructedStretch:
    """Where the path leads through what no rover is on. from_m, to_m: metres along it."""

    from_m: float
    to_m: float
    what: Obstacle


def obstructions(
    grid: ElevationGrid, along_m: Floats, level_m: Floats, known: npt.NDArray[np.bool_], inside: npt.NDArray[np.bool_]
) -> tuple[ObstructedStretch, ...]:
    """Runs of the path that are no ground to drive on; inside: (n,) whether a place is in a building."""
    row, col = grid.post_at(level_m[:, 0], level_m[:, 1])
    outside = (row < 0.0) | (row > grid.rows - 1.0) | (col < 0.0) | (col > grid.cols - 1.0)
    found = []
    for what, there in (
        (Obstacle.BUILDING, inside), (Obstacle.OUTSIDE, outside), (Obstacle.UNKNOWN_GROUND, ~known & ~inside & ~outside)
    ):  # fmt: skip
        for low_m, high_m, _ in runs_along(there, along_m):
            found.append(ObstructedStretch(low_m, high_m, what))
    return tuple(sorted(found, key=lambda one: one.from_m))


def runs_along(there: npt.NDArray[np.bool_], along_m: Floats) -> list[tuple[float, float, slice]]:
    """(from, to, which points) of each run of points; one reaches half way to the next point that is not in it."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    return [
        (
            float(0.5 * (along_m[first] + along_m[max(first - 1, 0)])),
            float(0.5 * (along_m[end - 1] + along_m[min(end, len(along_m) - 1)])),
            slice(first, end),
        )
        for first, end in edges.reshape(-1, 2).tolist()
    ]
