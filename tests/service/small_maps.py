"""A small ground with a wall and a hole, and maps over it, for tests of what is made from maps."""

from __future__ import annotations

import numpy as np

from service.products.visibility.calculate import VisibilityMap, calculate_visibility_map
from service.products.visibility.request import VisibilityMapParameters
from terrain import ElevationGrid, Provenance

ROWS, COLS, CELL_EAST_M, CELL_NORTH_M = 24, 30, 30.0, 20.0
WEST_M, NORTH_M = 400_000.0, 3_800_000.0
WALL_COLUMN, HOLE = 18, (slice(4, 7), slice(8, 11))


def small_grid(crs: str | None = "EPSG:32611") -> ElevationGrid:
    """A gentle slope with a north-south wall of 60 m and unknown posts near the north-west corner."""
    heights_m = np.add.outer(np.arange(ROWS), 0.5 * np.arange(COLS)).astype(np.float32)
    heights_m[:, WALL_COLUMN] += 60.0
    heights_m[HOLE] = np.nan
    provenance = Provenance("a/b/small.tif", "GTiff", (), ("The file is a made-up one.",))
    return ElevationGrid(heights_m, CELL_EAST_M, CELL_NORTH_M, WEST_M, NORTH_M, crs, provenance=provenance)


def small_parameters(**changes: object) -> VisibilityMapParameters:
    """One anchor in the west, one east of the wall, one outside."""
    anchors = [
        {"id": "west", "east_m": WEST_M + 95.0, "north_m": NORTH_M - 305.0, "above_ground_m": 12.0},
        {"id": "east", "east_m": WEST_M + 750.0, "north_m": NORTH_M - 200.0, "altitude_m": 60.0, "max_range_m": 600.0},
        {"id": "outside", "east_m": WEST_M - 900.0, "north_m": NORTH_M - 200.0, "altitude_m": 90.0},
    ]
    return VisibilityMapParameters.model_validate({"anchors": anchors, **changes})


def small_map(crs: str | None = "EPSG:32611", **changes: object) -> VisibilityMap:
    """The map of both."""
    return calculate_visibility_map(small_grid(crs), small_parameters(**changes))
