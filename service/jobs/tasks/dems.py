"""Reading an uploaded DEM, the only place where a stranger's file meets a raster library, and drawing it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dem_samples import sample_path
from service.ground.levels import write_level
from service.ground.place import place_of
from service.jobs.dem_files import save_grid
from service.jobs.folder import make_durable
from service.parts.map_facts import dem_summary
from terrain import ElevationGrid, read_dem

from .context import TaskContext

__all__ = ["draw_hillshade", "read_uploaded_dem", "summary_of", "write_dem_level"]


def read_uploaded_dem(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read the file at ``path``, or the bundled DEM ``sample``, keep the grid in the work folder, and tell about it.

    Raises DemReadError, FrameError, SampleError.
    """
    path = sample_path(arguments["sample"]) if "sample" in arguments else Path(arguments["path"])
    options = dict(arguments["options"])
    if "nodata" in options:
        options["nodata"] = float(options["nodata"])
    grid = read_dem(path, max_cells=context.settings.max_dem_cells, **options)
    save_grid(grid, context.work)
    make_durable(context.work)
    return summary_of(grid)


def draw_hillshade(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Draw a DEM that was read into the work folder; raises NotFoundError when it was just deleted."""
    from service.drawing.overlay import write_hillshade  # heavy, and reading does without

    grid = context.grid(arguments["dem_id"])
    context.work.mkdir(parents=True)
    write_hillshade(grid, context.work / context.folder.hillshade(arguments["dem_id"]).name)
    make_durable(context.work)
    return {}


def write_dem_level(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Write a DEM's heights at a level into the work folder; raises NotFoundError when it was just deleted."""
    grid, level = context.grid(arguments["dem_id"]), int(arguments["level"])
    context.work.mkdir(parents=True)
    write_level(grid, level, context.work / context.folder.level(arguments["dem_id"], level).name)
    make_durable(context.work)
    return {}


def summary_of(grid: ElevationGrid) -> dict[str, Any]:
    """What the store keeps of a DEM, ready for JSON."""
    known = grid.unknown_posts < grid.heights_m.size
    ground = dem_summary(grid)
    # the resource has the name that the file came under
    del ground["name"]
    return {
        **ground,
        **place_of(grid),
        "driver": grid.provenance.driver,
        "cells": grid.heights_m.size,
        "lowest_m": float(np.nanmin(grid.heights_m)) if known else None,
        "highest_m": float(np.nanmax(grid.heights_m)) if known else None,
        "warnings": list(grid.provenance.warnings),
    }
