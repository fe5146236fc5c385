"""DEMs made from the ground library: which one a request means, and reading it."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from service.ground.coverage import coverage_of, fingerprint
from service.ground.folder import library_in
from service.ground.request import GroundIn
from service.jobs.dem_files import save_grid
from service.jobs.folder import make_durable
from terrain import GroundChangedError, MosaicPlan, plan_mosaic, read_mosaic

from .bodies import body_in, read_body
from .context import TaskContext
from .dems import summary_of

__all__ = ["plan_ground", "read_ground", "tell_coverage"]


def plan_ground(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read and check a request for ground: its fields, and the id of the DEM that it means as the library stands.

    Raises NotJsonError, NotValidError, AreaError, FrameError, NoGroundError.
    """
    asked = read_body(GroundIn, body_in(arguments), context.settings)
    plan = _plan(context, asked)
    return {"dem_id": _id_of(asked, plan), "asked": asked.model_dump(mode="json", exclude_none=True)}


def read_ground(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Make the grid that was planned, keep it in the work folder, and tell about it.

    Raises GroundChangedError where the library is not what it was, DemReadError, FrameError.
    """
    asked = GroundIn.model_validate(arguments["asked"])
    plan = _plan(context, asked)
    if _id_of(asked, plan) != arguments["dem_id"]:
        raise GroundChangedError("The ground library was changed while the DEM was asked for; ask again.")
    grid = read_mosaic(
        plan.tiles,
        asked.area_asked(),
        margin_m=asked.margin_m,
        target_crs=asked.crs,
        cell_m=asked.cell_m,
        body=asked.body,
        max_cells=context.settings.max_dem_cells,
        progress=context.progress,
    )
    save_grid(grid, context.work)
    make_durable(context.work)
    return {**summary_of(grid), "name": grid.provenance.source}


def tell_coverage(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the library covers, as GeoJSON. Raises DemReadError."""
    return coverage_of(library_in(context.folder.root))


def _plan(context: TaskContext, asked: GroundIn) -> MosaicPlan:
    library = library_in(context.folder.root)
    return plan_mosaic(library.tiles, asked.area_asked(), margin_m=asked.margin_m, body=asked.body)


def _id_of(asked: GroundIn, plan: MosaicPlan) -> str:
    words = f"ground\0{asked.model_dump_json()}\0{fingerprint(plan)}"
    return hashlib.sha256(words.encode("utf-8", "surrogatepass")).hexdigest()[:32]
