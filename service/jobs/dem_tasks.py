"""What worker processes do with DEMs: read them from files, make them from the ground library, and draw them."""

from __future__ import annotations

import hashlib
import re
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, TypedDict

import numpy as np
from pydantic import JsonValue

from dem_samples import sample_path
from service.errors import NotFoundError, RequestError
from service.ground.coverage import STORE, coverage_of, fingerprint, library_in, name_of, posts_about
from service.ground.levels import place_of, write_level
from service.ground.remote.blocks import BlockStore
from service.ground.remote.windows import fetch_area, source_named
from service.ground.request import GroundIn
from service.jobs.folder import DataFolder, make_durable
from service.jobs.kept_files import load_grid, save_grid
from service.jobs.marker import is_owned
from service.parts.map_facts import ground_of
from service.products import Product, Work
from service.settings import Settings
from terrain import (
    DemUnsupportedError,
    ElevationGrid,
    GroundChangedError,
    MosaicPlan,
    Tile,
    open_dem,
    plan_mosaic,
    read_dem,
    read_mosaic,
    read_tile,
)
from terrain.tiles.tile import as_indexed

from .channel import BodyArguments, DemArguments, GroundArguments, LevelArguments, ReadDemArguments, body_in, read_body

__all__ = [
    "ReadTilesArguments",
    "Task",
    "TaskContext",
    "draw_hillshade",
    "plan_ground",
    "read_ground",
    "read_tiles",
    "read_uploaded_dem",
    "tell_coverage",
    "write_dem_level",
]

# of ground that is made while its request waits: a second or two
AT_ONCE_POSTS = 4_000_000
SHARE_OF_FETCHING = 0.8
DEM_ID = re.compile(r"[0-9a-f]{32}")
OF_A_RASTER = ("name", "rows", "cols", "cell_east_m", "cell_north_m")


@dataclass(frozen=True, slots=True)
class TaskContext:
    """Limits, where things lie, the task's own work folder (not made yet), and whom to tell the finished share.

    stop: whether somebody wants the best so far instead of all; a task that knows no such thing does not ask.
    salt: of the tenant that the task is for.
    """

    settings: Settings
    products: Mapping[str, Product]
    folder: DataFolder
    work: Path
    progress: Callable[[float], None]
    stop: Callable[[], bool]
    salt: str = ""

    def grid(self, dem_id: str) -> ElevationGrid:
        """The tenant's DEM of that id; raises NotFoundError, DataFolderError."""
        # the id may come straight from a request: it must not lead out of the folder
        if not DEM_ID.fullmatch(dem_id) or not is_owned(self.folder.dem(dem_id), self.salt):
            self.folder.check_usable()  # where the whole folder is gone, that is what to tell
            raise NotFoundError("DEM", dem_id)
        try:
            return _grid(self.folder.dem(dem_id))
        except FileNotFoundError as error:
            self.folder.check_usable()
            raise NotFoundError("DEM", dem_id) from error


# each task knows the arguments that it takes; see ``channel``
Task = Callable[[TaskContext, Any], Mapping[str, object]]


@lru_cache(maxsize=2)
def _grid(folder: Path) -> ElevationGrid:
    return load_grid(folder)


def read_uploaded_dem(context: TaskContext, arguments: ReadDemArguments) -> Mapping[str, object]:
    """Read the file at ``path``, or the bundled DEM ``sample``, keep the grid in the work folder, and tell about it.

    Raises DemReadError, FrameError, SampleError.
    """
    path = sample_path(arguments["sample"]) if "sample" in arguments else Path(arguments["path"])
    options = arguments["options"]
    grid = read_dem(
        path,
        nodata=float(options["nodata"]) if "nodata" in options else None,
        crs=options.get("crs"),
        height_unit=options.get("height_unit"),
        band=options.get("band"),
        cell_m=options.get("cell_m"),
        resolution_m=options.get("resolution_m"),
        vertical_datum=options.get("vertical_datum"),
        max_cells=context.settings.max_dem_cells,
    )
    save_grid(grid, context.work)
    make_durable(context.work)
    return _summary(grid)


class ReadTilesArguments(TypedDict):
    """Files that are tiles of one DEM, by their paths."""

    paths: Sequence[str]


def read_tiles(context: TaskContext, arguments: ReadTilesArguments) -> Mapping[str, object]:
    """Join the files at ``paths`` to one grid, keep it in the work folder, and tell about it.

    Raises DemReadError, FrameError, VerticalDatumError.
    """
    tiles = [read_tile(path) for path in arguments["paths"]]
    bodies = sorted({tile.body for tile in tiles})
    if len(bodies) > 1:
        raise DemUnsupportedError(f"The files are of several bodies ({', '.join(bodies)}), so they are no one ground.")
    limit = context.settings.max_dem_cells
    grid = read_mosaic(tiles, body=bodies[0], max_cells=limit, progress=context.progress)
    save_grid(grid, context.work)
    make_durable(context.work)
    return {**_summary(grid), "name": grid.provenance.source}


def draw_hillshade(context: TaskContext, arguments: DemArguments) -> Mapping[str, object]:
    """Draw a DEM that was read into the work folder; raises NotFoundError when it was just deleted."""
    from service.drawing.class_map import write_hillshade  # heavy, and reading does without

    grid = context.grid(arguments["dem_id"])
    context.work.mkdir(parents=True)
    write_hillshade(grid, context.work / context.folder.hillshade(arguments["dem_id"]).name)
    make_durable(context.work)
    return {}


def write_dem_level(context: TaskContext, arguments: LevelArguments) -> Mapping[str, object]:
    """Write a DEM's heights at a level into the work folder; raises NotFoundError when it was just deleted."""
    grid, level = context.grid(arguments["dem_id"]), arguments["level"]
    context.work.mkdir(parents=True)
    write_level(grid, level, context.work / context.folder.level(arguments["dem_id"], level).name)
    make_durable(context.work)
    return {}


def _summary(grid: ElevationGrid) -> dict[str, JsonValue]:
    known, finer = grid.unknown_posts < grid.heights_m.size, grid.provenance.overview_of
    return {
        # the resource has the name that the file came under
        **ground_of(grid).model_dump(mode="json", exclude={"name", "cover"}),
        **place_of(grid),
        "driver": grid.provenance.driver,
        "cells": grid.heights_m.size,
        "lowest_m": float(np.nanmin(grid.heights_m)) if known else None,
        "highest_m": float(np.nanmax(grid.heights_m)) if known else None,
        "warnings": list(grid.provenance.warnings),
        **({} if finer is None else {"overview_of": {name: getattr(finer, name) for name in OF_A_RASTER}}),
    }


def plan_ground(context: TaskContext, arguments: BodyArguments) -> GroundArguments:
    """Read and check a request for ground: its fields, and the id of the DEM that it means as the library stands.

    Raises NotJsonError, NotValidError, AreaError, FrameError, NoGroundError.
    """
    asked = read_body(GroundIn, body_in(arguments), context.settings)
    if asked.area is not None:
        asked.area_asked()
    state = _state(context, asked)
    takes_long = asked.tile is None  # how soon a source answers nobody knows
    if asked.source is None and asked.tile is None:
        # what is beyond the limit is refused before any height is read
        about = posts_about(_plan(context, asked), asked.cell_m)
        takes_long = AT_ONCE_POSTS < about <= context.settings.max_dem_cells
    fields = asked.model_dump(mode="json", exclude_none=True, exclude_unset=True)
    return {"dem_id": _id_of(asked, state), "asked": fields, "takes_long": takes_long}


def read_ground(context: TaskContext, arguments: GroundArguments) -> Mapping[str, object]:
    """Make the grid that was planned, keep it in the work folder, and tell about it.

    Raises GroundChangedError where the library is not what it was, DemReadError, FrameError.
    """
    asked = GroundIn.model_validate(arguments["asked"])
    if _id_of(asked, _state(context, asked)) != arguments["dem_id"]:
        raise GroundChangedError("The ground library was changed while the DEM was asked for; ask again.")
    if asked.tile is not None:
        grid = _overview(context, asked)
    else:
        parts = context.folder.incoming / uuid.uuid4().hex
        try:
            grid = _read(context, asked, _tiles(context, asked, parts))
        finally:
            context.folder.remove(parts)
    save_grid(grid, context.work)
    make_durable(context.work)
    return {**_summary(grid), "name": grid.provenance.source}


def tell_coverage(context: TaskContext, arguments: Mapping[str, object]) -> Mapping[str, object]:
    """What the library covers, as GeoJSON. Raises DemReadError."""
    return coverage_of(library_in(context.folder.root), context.settings.ground_sources).model_dump(mode="json")


def _read(context: TaskContext, asked: GroundIn, tiles: Sequence[Tile]) -> ElevationGrid:
    return read_mosaic(
        tiles,
        asked.area_asked(),
        margin_m=asked.margin_m,
        target_crs=asked.crs,
        cell_m=asked.cell_m,
        resolution_m=asked.resolution_m,
        body=asked.body,
        max_cells=context.settings.max_dem_cells,
        progress=Work(context.progress).part(0.0 if asked.source is None else SHARE_OF_FETCHING, 1.0),
    )


def _state(context: TaskContext, asked: GroundIn) -> str:
    """What the DEM depends on besides the request: the tiles that it takes of the library, or how its source is named.

    Raises RequestError for a source that is not listed, NoGroundError.
    """
    if asked.source is not None:
        return source_named(asked.source, context.settings).model_dump_json()
    return fingerprint((_tile(context, asked),) if asked.tile is not None else _plan(context, asked).tiles)


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
        progress=Work(context.progress).part(0.0, SHARE_OF_FETCHING),
    )


def _plan(context: TaskContext, asked: GroundIn) -> MosaicPlan:
    library = library_in(context.folder.root)
    return plan_mosaic(
        library.tiles, asked.area_asked(), margin_m=asked.margin_m, resolution_m=asked.resolution_m, body=asked.body
    )


def _tile(context: TaskContext, asked: GroundIn) -> Tile:
    """The tile of that name. Raises NotFoundError, RequestError where several are called so."""
    found = [tile for tile in library_in(context.folder.root).tiles if name_of(tile) == asked.tile]
    if not found:
        raise NotFoundError("tile", str(asked.tile), "GET /ground lists those of the library")
    if len(found) > 1:
        raise RequestError(f"{len(found)} tiles of the library are called {asked.tile}; ask for an area instead.")
    return found[0]


def _overview(context: TaskContext, asked: GroundIn) -> ElevationGrid:
    """All of a tile, as coarse as is made at once or as is asked for. Raises DemReadError, GroundChangedError."""
    tile = _tile(context, asked)
    posts = AT_ONCE_POSTS if asked.resolution_m is None else context.settings.max_dem_cells
    most = min(posts, context.settings.max_dem_cells)
    with as_indexed(tile):
        return open_dem(tile.path).overview(max_cells=most, resolution_m=asked.resolution_m)


def _id_of(asked: GroundIn, state: str) -> str:
    words = f"ground\0{asked.model_dump_json()}\0{state}"
    return hashlib.sha256(words.encode("utf-8", "surrogatepass")).hexdigest()[:32]
