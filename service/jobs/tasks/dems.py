"""Reading an uploaded DEM: the only place where a stranger's file meets a raster library."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from service.jobs.dem_files import save_grid
from service.jobs.folder import make_durable
from terrain import ElevationGrid, read_dem

from .context import TaskContext

__all__ = ["read_uploaded_dem"]


def read_uploaded_dem(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read the file at ``path`` with ``options`` of read_dem, keep the grid in the work folder, and tell about it.

    Raises DemReadError.
    """
    path = Path(arguments["path"])
    grid = read_dem(path, max_cells=context.settings.max_dem_cells, **arguments["options"])
    save_grid(grid, context.work)
    make_durable(context.work)
    return _summary(grid)


def _summary(grid: ElevationGrid) -> dict[str, Any]:
    west_m, south_m, east_m, north_m = grid.bounds_m
    known = grid.unknown_posts < grid.heights_m.size
    return {
        "driver": grid.provenance.driver,
        "rows": grid.rows,
        "cols": grid.cols,
        "cells": grid.heights_m.size,
        "cell_east_m": grid.cell_east_m,
        "cell_north_m": grid.cell_north_m,
        "bounds_of_posts_m": {"west": west_m, "south": south_m, "east": east_m, "north": north_m},
        "crs": None if grid.crs is None else grid.crs.to_string(),
        "vertical_datum": grid.vertical_datum,
        "lowest_m": float(np.nanmin(grid.heights_m)) if known else None,
        "highest_m": float(np.nanmax(grid.heights_m)) if known else None,
        "unknown_posts": grid.unknown_posts,
        "conversions": list(grid.provenance.conversions),
        "warnings": list(grid.provenance.warnings),
        "sha256": grid.digest,
    }
