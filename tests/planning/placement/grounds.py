"""Small grounds and questions for placement tests."""

from __future__ import annotations

import numpy as np

from planning.placement import Candidates, Targets, area_targets, candidate_grid
from terrain import ElevationGrid
from terrain.synthetic import fractal
from visibility import Anchor, lines_of_sight


def rough_grid(posts: int = 48, seed: int = 3, relief_m: float = 400.0, cell_m: float = 30.0) -> ElevationGrid:
    return fractal(posts, seed, relief_m=relief_m, cell_m=cell_m)


def small_question(
    seed: int = 3, candidates: int = 16, height_m: float = 60.0
) -> tuple[ElevationGrid, Candidates, Targets]:
    grid = rough_grid(seed=seed)
    west, _, east, _ = grid.bounds_m
    side = int(np.ceil(np.sqrt(candidates)))
    found = candidate_grid(grid, (east - west) / side * 0.999, above_ground_m=[height_m])
    return grid, found.take(np.arange(min(candidates, len(found)))), area_targets(grid)


def exact_sight(grid: ElevationGrid, position_m: np.ndarray, point_m: np.ndarray) -> np.ndarray:
    """(n, m) bool, line by line."""
    return np.array(
        [lines_of_sight(grid, np.broadcast_to(place, point_m.shape), point_m).verdict == 1 for place in position_m]
    )


def anchor_positions(anchors: tuple[Anchor, ...]) -> np.ndarray:
    return np.array([(a.east_m, a.north_m, a.altitude_m) for a in anchors])
