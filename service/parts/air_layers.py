"""Altitude layers between the ground and a ceiling, where a request does not name each of them."""

from __future__ import annotations

import numpy as np

from terrain import ElevationGrid
from visibility import VisibilityInputError, altitude_layers
from visibility.air import AltitudeLayers
from visibility.air.morphing_maps import check_ceiling

__all__ = ["air_layers"]

MOST_LAYERS = 100


def air_layers(
    grid: ElevationGrid,
    ceiling_m: float,
    above_ground: bool,
    *,
    floor_m: float | None = None,
    layer_m: float | None = None,
) -> AltitudeLayers:
    """Layers from floor_m (None = the lowest ground) up to the ceiling, three or more where layer_m is None.

    layer_m: None = as thick as the DEM's cells are wide, but no more than MOST_LAYERS layers.
    Raises VisibilityInputError.
    """
    check_ceiling(grid, ceiling_m, above_ground)
    if floor_m is None:
        floor_m = 0.0 if above_ground else float(np.nanmin(grid.heights_m))
    height_m = ceiling_m - floor_m
    if layer_m is None:
        layer_m = min(max(min(grid.cell_east_m, grid.cell_north_m), height_m / (MOST_LAYERS - 1)), height_m / 2.0)
    if height_m <= 0.0:
        raise VisibilityInputError(f"The floor at {floor_m:g} m is not below the ceiling at {ceiling_m:g} m.")
    return altitude_layers(floor_m, ceiling_m, layer_m, above_ground=above_ground)
