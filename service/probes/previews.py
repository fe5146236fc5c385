"""Previews: what anchors see, or what positioning by them is worth, over a whole DEM as bare numbers, kept nowhere."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from service.errors import RequestError
from service.estimates import signals_over
from service.ground.levels import at_level
from service.parts.altitude_datums import in_dem_datum
from service.parts.anchors import AnchorIn
from service.parts.cover import notes_on_cover
from service.parts.doubts import doubted_anchors
from service.parts.map_facts import curvature_of
from service.parts.shapes_in_grid import resolve_anchor
from service.parts.unused import notes_on_unused
from terrain import ElevationGrid, height_at
from visibility import Anchor, Curvature, MinimumVisibleAltitude, dop_map, position_error_map
from visibility.sight import ALL_ROUND, SurfaceCache, check_anchors
from visibility.sight.anchors import hide_beyond_reach
from visibility.sight.doubts import forget_where_doubted
from visibility.signal import margin_map, min_usable_altitude

from .request import PreviewIn, PreviewTold

__all__ = ["MOST_NUMBERS", "write_preview"]

Floats = npt.NDArray[np.float32]
Unknown = Literal["unknown", "open", "blocked"]
MOST_NUMBERS = 32_000_000
# of one anchor's signals, as they are estimated: somebody waits for them, and so do other probes
MOST_SIGNALS_S = 30.0
# of what is usable, besides those asked for last: the page asks anchor by anchor, and then for all of them
REMEMBERED = 16
# where the numbers begin in the answer is a multiple of this
ALIGNED_BYTES = 8
OF_LINKS = "every edge of the triangulated surface below each link; what P.526 leaves out is the radio's spread"


def write_preview(grid: ElevationGrid, asked: PreviewIn, path: Path) -> None:
    """Write a line of JSON (PreviewTold), filled up with blanks, and float32, little-endian: array by array.

    Raises RequestError, AnchorError, FrameError, VisibilityInputError, VerticalDatumError, SignalError.
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
    if asked.usable and signals_over(posts, 1, grid.trees is not None).amount > MOST_SIGNALS_S:
        raise RequestError(
            f"What is usable over {posts:,} posts takes too long for a preview; ask for a higher level, or a map."
        )
    ground = _at_level(grid, asked.level)
    placed, lifted = _on_level(grid, ground, asked.anchors)
    anchors, passed_over = doubted_anchors(grid, placed, asked.doubts)
    told, shown = _margins(ground, anchors, asked) if asked.show == "margin_db" else _shown(ground, anchors, asked)
    warnings = [*notes, *notes_on_unused(grid, asked), *notes_on_cover(ground), *lifted, *passed_over, *told.warnings]
    line = told.model_copy(update={"warnings": warnings}).model_dump_json().encode()
    with path.open("wb") as file:
        file.write(line + b" " * (-(len(line) + 1) % ALIGNED_BYTES) + b"\n")
        for array in shown:
            file.write(np.ascontiguousarray(array, "<f4").tobytes())


def _on_level(grid: ElevationGrid, ground: ElevationGrid, asked: list[AnchorIn]) -> tuple[list[Anchor], list[str]]:
    """(anchors in the grid's frame, a sentence on each that stands lower than the coarse ground at its place)."""
    anchors, told = list[Anchor](), list[str]()
    for one in asked:
        anchor = resolve_anchor(grid, one)
        own_m, coarse_m = (float(height_at(on, anchor.east_m, anchor.north_m)) for on in (grid, ground))
        if own_m <= anchor.altitude_m < coarse_m:
            up_m = coarse_m - own_m
            anchor = replace(anchor, altitude_m=anchor.altitude_m + up_m)
            told.append(f"{anchor.id} is looked at {up_m:.1f} m higher: so much higher is the coarse ground there.")
        anchors.append(anchor)
    return anchors, told


def _shown(ground: ElevationGrid, anchors: tuple[Anchor, ...], asked: PreviewIn) -> tuple[PreviewTold, list[Floats]]:
    cached = _usable_surfaces if asked.usable else _surfaces
    lines = cached(ground, asked.mode, curvature_of(asked), asked.unknown).surfaces(anchors)
    by_anchor = asked.show in ("sight", "needed_height")
    told = PreviewTold(
        names=[anchor.id for anchor in anchors] if by_anchor else [asked.show],
        rows=ground.rows,
        cols=ground.cols,
        mode=lines.mode,
        error_statement=lines.error_statement,
        curvature=lines.curvature.sentence(),
        warnings=[*lines.warnings],
    )
    return told, _numbers(lines, asked)


def _numbers(lines: MinimumVisibleAltitude, asked: PreviewIn) -> list[Floats]:
    above_m = asked.receiver_above_ground_m
    if asked.show == "dop":
        return [dop_map(lines, above_m, asked.kind, measure=asked.measure, on_surface=asked.on_surface).dop]
    if asked.show == "position_error":
        return [position_error_map(lines, above_m, asked.kind, on_surface=asked.on_surface).position_sigma_m]
    altitudes = [
        np.where(_reached(lines.grid, anchor, lines.curvature, above_m), altitude_m, np.float32(np.inf))
        if isinstance(anchor, Anchor) and anchor.limits != ALL_ROUND
        else altitude_m
        for anchor, altitude_m in zip(lines.anchors, lines.altitude_m, strict=True)
    ]
    return altitudes if asked.show == "sight" else [altitude_m - lines.grid.heights_m for altitude_m in altitudes]


def _margins(ground: ElevationGrid, anchors: tuple[Anchor, ...], asked: PreviewIn) -> tuple[PreviewTold, list[Floats]]:
    """By anchor what arrives beyond the receiver's need; -inf where nothing does, or its antenna does not reach."""
    curvature = Curvature.over(ground, curvature_of(asked))
    receiver_m = ground.heights_m + np.float32(asked.receiver_above_ground_m)
    warnings, found = dict.fromkeys(check_anchors(ground, anchors)), list[Floats]()
    for anchor in anchors:
        assert anchor.radio is not None, "the request has seen to it"
        margin_db, notes = margin_map(ground, anchor, anchor.radio, receiver_m, curvature, unknown=asked.unknown)
        reached = _reached(ground, anchor, curvature, asked.receiver_above_ground_m)
        margin_db = np.where(reached, margin_db, np.float32(-np.inf))
        forget_where_doubted(ground, anchor.doubts, margin_db)
        found.append(margin_db)
        warnings |= dict.fromkeys(notes)
    told = PreviewTold(
        names=[anchor.id for anchor in anchors],
        rows=ground.rows,
        cols=ground.cols,
        mode="exact",
        error_statement=OF_LINKS,
        curvature=curvature.sentence(),
        warnings=[*warnings],
    )
    return told, found


def _reached(ground: ElevationGrid, anchor: Anchor, curvature: Curvature, above_m: float) -> npt.NDArray[np.bool_]:
    """(rows, cols) whether a receiver so high over each post is within the reach of an antenna."""
    reached = np.ones(ground.shape, np.uint8)
    hide_beyond_reach(ground, anchor, curvature, ground.heights_m, np.float32(above_m), reached)
    return reached.astype(np.bool_)


@lru_cache(maxsize=2)
def _at_level(grid: ElevationGrid, level: int) -> ElevationGrid:
    return at_level(grid, level)


@lru_cache(maxsize=2)
def _surfaces(
    grid: ElevationGrid, mode: Literal["fast", "exact"], curvature: Curvature | None, unknown: Unknown
) -> SurfaceCache:
    """What was seen last over a ground: of the anchors asked for next only those that moved are calculated."""
    return SurfaceCache(grid, mode, curvature, unknown=unknown)


@lru_cache(maxsize=2)
def _usable_surfaces(
    grid: ElevationGrid, mode: Literal["fast", "exact"], curvature: Curvature | None, unknown: Unknown
) -> SurfaceCache:
    """The same of what was usable last."""
    return SurfaceCache(grid, mode, curvature, unknown=unknown, calculate=min_usable_altitude, remembers=REMEMBERED)
