"""One grid out of many tiles: of any format, CRS and resolution, finest first, with what was done told."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyproj

from ..areas import Area, area_window
from ..files.placing import place
from ..files.raw import RawDem
from ..files.reading import grid_of, horizontal_target
from ..grid import ElevationGrid, Provenance
from ..limits import DEFAULT_MAX_CELLS, check_declared_size
from .blending import blend
from .frame import bounds_wanted, target_of, window_for
from .layer import Layer, Part, read_layer
from .levelling import one_datum
from .plan import MosaicPlan, plan_mosaic
from .telling import check_datums, plan_told, source_of, with_sentences
from .tile import Tile, read_tile

__all__ = ["read_mosaic"]

SHARE_OF_READING = 0.9


def read_mosaic(
    tiles: Sequence[Tile | str | os.PathLike[str]],
    area: Area | None = None,
    *,
    margin_m: float = 0.0,
    target_crs: Any = None,
    cell_m: float | None = None,
    resolution_m: float | None = None,
    body: str = "Earth",
    max_cells: int = DEFAULT_MAX_CELLS,
    progress: Callable[[float], None] | None = None,
) -> ElevationGrid:
    """The ground of an area, or of all tiles, as one grid in one metric CRS.

    Tiles on one lattice are one DEM that was cut: their heights are taken post for post, posts that two share once.
    Other resolutions and CRSs fill what finer ones leave unknown, on their own triangulated surface; between two that
    do not touch, one cell is bridged. ``provenance`` tells what came from where, voids that were filled, and tiles that
    contradict one another.

    tiles: headers, or paths of files that ``read_dem`` reads and that tell their CRS. margin_m: ground around the area
    that is read too, since it hides. target_crs: metric CRS of the grid; without it the finest tiles' own where that
    measures truly, else a local one. cell_m: metres between posts; without it the finest tiles'. resolution_m: of tiles
    with overviews the coarsest level is read whose cells are no coarser, which is told. body: whose ground.
    Heights count from what the finest tile that names a vertical datum says; those of tiles that name another are
    brought there.
    Raises DemReadError (NoGroundError, GroundChangedError, DemTooLargeError before any height is read), FrameError,
    VerticalDatumError (no model tells how far two datums are apart).
    """
    headers = [tile if isinstance(tile, Tile) else read_tile(os.fspath(tile)) for tile in tiles]
    plan = plan_mosaic(headers, area, margin_m=margin_m, resolution_m=resolution_m, body=body)
    target = None if target_crs is None else horizontal_target(target_crs)
    told = progress or (lambda share: None)

    def heard(share: float) -> None:  # what is read has to be put together
        told(SHARE_OF_READING * share)

    if len(plan.layers) == 1 and cell_m is None:
        return _of_one_layer(plan, plan.layers[0].layer, target, max_cells, heard)
    return blend(plan, target, cell_m, max_cells, heard)


def _of_one_layer(
    plan: MosaicPlan,
    layer: Layer,
    target: pyproj.CRS | None,
    max_cells: int,
    progress: Callable[[float], None],
) -> ElevationGrid:
    """Put together as the undivided file would be, then read as that would be."""
    source = source_of(plan)
    if target is None and plan.area is not None:
        target = target_of(plan, layer)
    window = window_for(layer, None if target is None else bounds_wanted(plan.area, target), target or layer.crs)
    check_declared_size(source, *window.shape, max_cells=max_cells, bytes_per_value=4, file_bytes=None)
    wanted = one_datum(layer.tiles)
    part = read_layer(layer, window, max_cells=max_cells, datum=wanted, progress=progress)
    datum, warnings = check_datums([part], wanted)
    uncovered = int(np.count_nonzero(~part.covered)), part.covered.size
    placed = place(
        source, _raw_of(part, layer), part.posts.heights_m,
        crs=None, target_crs=target, height_unit_known=True, max_cells=max_cells,
    )  # fmt: skip
    grid = grid_of(placed, datum, Provenance(source=source, driver="mosaic"))
    if plan.area is not None:
        grid = grid.window(*area_window(grid, plan.area))
    conversions, of_tiles = plan_told(plan, [part], wanted)
    return with_sentences(grid, conversions, [*of_tiles, *warnings], placed=placed, uncovered=uncovered)


def _raw_of(part: Part, layer: Layer) -> RawDem:
    posts = part.posts
    return RawDem(
        posts.heights_m, None, posts.x0, posts.y0, posts.step_x, posts.step_y, posts.crs,
        driver="mosaic", height_unit="m", from_grid=layer.from_grid,
    )  # fmt: skip
