"""Previews: what anchors see, or what positioning by them is worth, over a whole DEM as bare numbers, kept nowhere."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from service.errors import RequestError
from service.ground.levels import at_level
from service.parts.altitude_datums import in_dem_datum
from service.parts.cover import notes_on_cover
from service.parts.doubts import doubted_anchors
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import resolve_anchor
from service.parts.unused import notes_on_unused
from terrain import ElevationGrid
from visibility import Anchor, Curvature, MinimumVisibleAltitude, dop_map, position_error_map
from visibility.sight import ALL_ROUND, SurfaceCache
from visibility.sight.anchors import hide_beyond_reach

from .request import PreviewIn, PreviewTold

__all__ = ["MOST_NUMBERS", "write_preview"]

Floats = npt.NDArray[np.float32]
Unknown = Literal["unknown", "open", "blocked"]
MOST_NUMBERS = 32_000_000
# where the numbers begin in the answer is a multiple of this
ALIGNED_BYTES = 8


def write_preview(grid: ElevationGrid, asked: PreviewIn, path: Path) -> None:
    """Write a line of JSON (PreviewTold), filled up with blanks, and float32, little-endian: array by array.

    Raises RequestError, AnchorError, FrameError, VisibilityInputError, VerticalDatumError.
    """
    asked, notes = in_dem_datum(grid, asked)
    posts = -(-grid.rows // 2**asked.level) * -(-grid.cols // 2**asked.level)
    if posts * len(asked.anchors) > MOST_NUMBERS:
        raise RequestError(
            f"A preview of {len(asked.anchors)} anchors over {posts:,} posts takes {posts * len(asked.anchors):,} "
            f"numbers, more than {MOST_NUMBERS:,}; ask for a higher level or fewer anchors."
        )
    if 2**asked.level > max(grid.shape):
        raise RequestError(f"Level {asked.level} is coarser than the whole DEM; its levels are listed at /levels.")
    ground = _at_level(grid, asked.level)
    anchors, passed_over = doubted_anchors(grid, [resolve_anchor(grid, one) for one in asked.anchors], asked.doubts)
    lines = _surfaces(ground, asked.mode, curvature_of(asked), asked.unknown).surfaces(anchors)
    shown = _shown(lines, asked)
    told = PreviewTold(
        names=[anchor.id for anchor in anchors] if asked.show in ("sight", "needed_height") else [asked.show],
        rows=ground.rows,
        cols=ground.cols,
        mode=lines.mode,
        error_statement=lines.error_statement,
        curvature=lines.curvature.sentence(),
        warnings=[*notes, *notes_on_unused(grid, asked), *notes_on_cover(ground), *passed_over, *lines.warnings],
    )
    line = told.model_dump_json().encode()
    with path.open("wb") as file:
        file.write(line + b" " * (-(len(line) + 1) % ALIGNED_BYTES) + b"\n")
        for array in shown:
            file.write(np.ascontiguousarray(array, "<f4").tobytes())


def _shown(lines: MinimumVisibleAltitude, asked: PreviewIn) -> list[Floats]:
    above_m = asked.receiver_above_ground_m
    if asked.show == "dop":
        return [dop_map(lines, above_m, asked.kind, measure=asked.measure, on_surface=asked.on_surface).dop]
    if asked.show == "position_error":
        return [position_error_map(lines, above_m, asked.kind, on_surface=asked.on_surface).position_sigma_m]
    altitudes = [_in_reach(lines, number, above_m) for number in range(len(lines.anchors))]
    return altitudes if asked.show == "sight" else [altitude_m - lines.grid.heights_m for altitude_m in altitudes]


def _in_reach(lines: MinimumVisibleAltitude, number: int, above_m: float) -> Floats:
    """(rows, cols): the lowest altitude in an anchor's sight; +inf where a receiver so high is beyond its antenna."""
    anchor = lines.anchors[number]
    altitude_m: Floats = lines.altitude_m[number]
    if not isinstance(anchor, Anchor) or anchor.limits == ALL_ROUND:
        return altitude_m
    reached = np.ones(altitude_m.shape, np.uint8)
    hide_beyond_reach(lines.grid, anchor, lines.curvature, lines.grid.heights_m, np.float32(above_m), reached)
    return np.where(reached == 0, np.float32(np.inf), altitude_m)


@lru_cache(maxsize=2)
def _at_level(grid: ElevationGrid, level: int) -> ElevationGrid:
    return at_level(grid, level)


@lru_cache(maxsize=2)
def _surfaces(
    grid: ElevationGrid, mode: Literal["fast", "exact"], curvature: Curvature | None, unknown: Unknown
) -> SurfaceCache:
    """What was seen last over a ground: of the anchors asked for next only those that moved are calculated."""
    return SurfaceCache(grid, mode, curvature, unknown=unknown)
