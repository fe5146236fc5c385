"""DEMs made from the ground library: which one a request means, and reading it."""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from service.ground.coverage import coverage_of, fingerprint
from service.ground.folder import STORE, library_in
from service.ground.remote.area import fetch_area, source_named
from service.ground.remote.blocks import BlockStore
from service.ground.request import GroundIn
from service.jobs.dem_files import save_grid
from service.jobs.folder import make_durable
from terrain import ElevationGrid, GroundChangedError, MosaicPlan, Tile, plan_mosaic, read_mosaic

from .bodies import body_in, read_body
from .context import TaskContext
from .dems import summary_of

__all__ = ["plan_ground", "read_ground", "tell_coverage"]


def plan_ground(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Read and check a request for ground: its fields, and the id of the DEM that it means as the library stands.

    Raises NotJsonError, NotValidError, AreaError, FrameError, NoGroundError.
    """
    asked = read_body(GroundIn, body_in(arguments), context.settings)
    asked.area_asked()
    state = _state(context, asked)
    return {"dem_id": _id_of(asked, state), "asked": asked.model_dump(mode="json", exclude_none=True)}


def read_ground(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """Make the grid that was planned, keep it in the work folder, and tell about it.

    Raises GroundChangedError where the library is not what it was, DemReadError, FrameError.
    """
    asked = GroundIn.model_validate(arguments["asked"])
    if _id_of(asked, _state(context, asked)) != arguments["dem_id"]:
        raise GroundChangedError("The ground library was changed while the DEM was asked for; ask again.")
    parts = context.folder.incoming / uuid.uuid4().hex
    try:
        grid = _read(context, asked, _tiles(context, asked, parts))
    finally:
        context.folder.remove(parts)
    save_grid(grid, context.work)
    make_durable(context.work)
    return {**summary_of(grid), "name": grid.provenance.source}


def tell_coverage(context: TaskContext, arguments: Mapping[str, Any]) -> Mapping[str, Any]:
    """What the library covers, as GeoJSON. Raises DemReadError."""
    return coverage_of(library_in(context.folder.root), context.settings.ground_sources).model_dump(mode="json")


def _read(context: TaskContext, asked: GroundIn, tiles: Sequence[Tile]) -> ElevationGrid:
    return read_mosaic(
        tiles,
        asked.area_asked(),
        margin_m=asked.margin_m,
        target_crs=asked.crs,
        cell_m=asked.cell_m,
        body=asked.body,
        max_cells=context.settings.max_dem_cells,
        progress=context.progress,
    )


def _state(context: TaskContext, asked: GroundIn) -> str:
    """What the DEM depends on besides the request: the tiles that it takes of the library, or how its source is named.

    Raises RequestError for a source that is not listed, NoGroundError.
    """
    if asked.source is not None:
        return source_named(asked.source, context.settings).model_dump_json()
    return fingerprint(_plan(context, asked))


def _tiles(context: TaskContext, asked: GroundIn, parts: Path) -> Sequence[Tile]:
    """The tiles to read; those of a source are fetched into ``parts``. Raises GroundSourceError, NoGroundError."""
    if asked.source is None:
        return _plan(context, asked).tiles
    settings = context.settings
    return fetch_area(
        source_named(asked.source, settings),
        asked.area_asked(),
        asked.margin_m,
        BlockStore(context.folder.root / STORE, settings.max_ground_store_bytes),
        parts,
        max_cells=settings.max_dem_cells,
        progress=context.progress,
    )


def _plan(context: TaskContext, asked: GroundIn) -> MosaicPlan:
    library = library_in(context.folder.root)
    return plan_mosaic(library.tiles, asked.area_asked(), margin_m=asked.margin_m, body=asked.body)


def _id_of(asked: GroundIn, state: str) -> str:
    words = f"ground\0{asked.model_dump_json()}\0{state}"
    return hashlib.sha256(words.encode("utf-8", "surrogatepass")).hexdigest()[:32]
