"""Layers of several resolutions or CRSs on one grid: the finest that knows a post gives it, coarser ones fill."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pyproj

from .. import kernels
from ..crs.parts import same_map, split_shift
from ..datums.references import VerticalDatum
from ..errors import NoGroundError
from ..files.placing import Placed
from ..files.reading import grid_of
from ..files.warping import Frame, Posts, sample
from ..grid import ElevationGrid, Provenance
from ..limits import check_declared_size
from ..units import degrees_per_unit
from .frame import frame_of, target_of, window_for
from .layer import CONTRADICTION_M, Layer, Part, read_layer
from .levelling import one_datum
from .plan import MosaicPlan
from .telling import Overlap, check_datums, overlaps_told, plan_told, source_of, with_sentences

__all__ = ["blend"]


def blend(
    plan: MosaicPlan,
    target: pyproj.CRS | None,
    cell_m: float | None,
    max_cells: int,
    progress: Callable[[float], None],
) -> ElevationGrid:
    """The grid of a plan with several layers, or of one with other cells than its own. Raises DemReadError,
    VerticalDatumError.
    """
    finest, source = plan.layers[0].layer, source_of(plan)
    if target is None:
        target = target_of(plan, finest)
    frame = frame_of(plan, finest, target, cell_m)
    check_declared_size(source, frame.rows, frame.cols, max_cells=max_cells, bytes_per_value=4, file_bytes=None)
    wanted = one_datum(plan.tiles)
    layers, parts = _read(plan, frame, target, max_cells, wanted, progress)
    datum, warnings = check_datums(parts, wanted)
    bridged = [_bridged(number, parts) for number in range(len(parts))]
    heights_m = np.full((frame.rows, frame.cols), np.nan, np.float32)
    covered, overlaps, filled = np.zeros(heights_m.shape, np.bool_), list[Overlap](), list[str]()
    for layer, part, posts in zip(layers, parts, bridged, strict=True):
        over, in_voids = _add(layer, posts, part, heights_m, covered, target, frame)
        overlaps.append(over)
        if in_voids:
            filled.append(f"{in_voids:,} posts that are void in finer tiles were filled from {layer.name}.")
    placed = Placed(heights_m, frame.cell_east_m, frame.cell_north_m, frame.west_m, frame.top_m, target, (), ())
    grid = grid_of(placed, datum, Provenance(source=source, driver="mosaic"))
    conversions, of_tiles = plan_told(plan, parts, wanted)
    of_overlaps, contradictions = overlaps_told(overlaps, grid)
    warped = _warps_told(layers, target, frame)
    return with_sentences(
        grid,
        [*conversions, *warped, *filled, *of_overlaps],
        [*contradictions, *of_tiles, *warnings],
        uncovered=(int(np.count_nonzero(np.isnan(grid.heights_m) & ~covered)), heights_m.size),
    )


def _read(
    plan: MosaicPlan,
    frame: Frame,
    target: pyproj.CRS,
    max_cells: int,
    datum: VerticalDatum | None,
    progress: Callable[[float], None],
) -> tuple[list[Layer], list[Part]]:
    """The layers that have posts in the frame, and those posts."""
    bounds = (
        frame.west_m,
        frame.top_m - (frame.rows - 1) * frame.cell_north_m,
        frame.west_m + (frame.cols - 1) * frame.cell_east_m,
        frame.top_m,
    )
    layers, parts = list[Layer](), list[Part]()
    for number, planned in enumerate(plan.layers):
        layer = planned.layer
        try:
            window = window_for(layer, bounds, target)
        except NoGroundError:  # it touches the area with the outer half of its border cells alone
            continue
        check_declared_size(layer.name, *window.shape, max_cells=max_cells, bytes_per_value=4, file_bytes=None)
        parts.append(read_layer(layer, window, max_cells=max_cells, datum=datum))
        layers.append(layer)
        progress((number + 1) / len(plan.layers))
    if not parts:
        raise NoGroundError("The area touches only the outer border of tiles, where no post lies.")
    return layers, parts


def _bridged(number: int, parts: Sequence[Part]) -> Posts:
    """A layer's posts with one more beyond each border, which other layers give: no gap where two do not touch."""
    own = parts[number]
    heights_m = np.pad(own.posts.heights_m, 1, constant_values=np.nan)
    covered = np.pad(own.covered, 1)
    posts = replace(
        own.posts,
        heights_m=heights_m,
        x0=own.posts.x0 - own.posts.step_x,
        y0=own.posts.y0 + own.posts.step_y,
    )
    row, col = np.nonzero(_beside(covered) & ~covered)
    x = np.asarray(posts.x0 + col * posts.step_x, np.float64)
    y = np.asarray(posts.y0 - row * posts.step_y, np.float64)
    for other in (part.posts for at, part in enumerate(parts) if at != number):
        missing = np.isnan(heights_m[row, col])
        if not missing.any():
            break
        heights_m[row[missing], col[missing]] = _heights_at(other, posts.crs, x[missing], y[missing])
    return posts


def _beside(covered: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """The posts that are covered or have a neighbour, also across a corner, that is."""
    across = covered.copy()
    across[:, 1:] |= covered[:, :-1]
    across[:, :-1] |= covered[:, 1:]
    around = across.copy()
    around[1:] |= across[:-1]
    around[:-1] |= across[1:]
    return around


def _heights_at(
    posts: Posts, crs: pyproj.CRS, x: npt.NDArray[np.float64], y: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Heights (n,) of a layer's surface at places in another CRS; NaN where it has none."""
    there_x, there_y = pyproj.Transformer.from_crs(crs, posts.crs, always_xy=True).transform(x, y)
    if posts.crs.is_geographic:
        turn = 360.0 / degrees_per_unit(posts.crs)
        there_x = there_x + turn * np.round((posts.middle[0] - there_x) / turn)
    heights_m = np.empty(len(x))
    rows, cols = (posts.y0 - there_y) / posts.step_y, (there_x - posts.x0) / posts.step_x
    kernels.surface_heights(posts.heights_m, rows, cols, heights_m)
    return heights_m


def _add(
    layer: Layer,
    posts: Posts,
    part: Part,
    heights_m: npt.NDArray[np.float32],
    covered: npt.NDArray[np.bool_],
    target: pyproj.CRS,
    frame: Frame,
) -> tuple[Overlap, int]:
    """Fill what is unknown yet from a layer; (how it agrees with what is known, posts filled where finer are void)."""
    there_m = sample(posts, target, frame).heights_m
    known, gives = ~np.isnan(heights_m), ~np.isnan(there_m)
    apart_m = np.abs(there_m - heights_m)[known & gives]
    wrong = known & gives & (np.abs(there_m - heights_m) > CONTRADICTION_M)
    first = np.argwhere(wrong)[0] if wrong.any() else (None, None)
    over = Overlap(
        layer.name,
        apart_m.size,
        float(np.median(apart_m)) if apart_m.size else 0.0,
        float(apart_m.max()) if apart_m.size else 0.0,
        int(np.count_nonzero(wrong)),
        None if first[0] is None else int(first[0]),
        None if first[1] is None else int(first[1]),
    )
    new = gives & ~known
    in_voids = int(np.count_nonzero(new & covered))
    heights_m[new] = there_m[new]
    within = np.pad(np.where(part.covered, np.float32(0.0), np.float32(np.nan)), 1, constant_values=np.nan)
    covered |= ~np.isnan(sample(replace(posts, heights_m=within), target, frame).heights_m)
    return over, in_voids


def _warps_told(layers: Sequence[Layer], target: pyproj.CRS, frame: Frame) -> list[str]:
    return [
        f"{layer.name} was sampled from {layer.crs.name} (cells of {layer.step_x:.6g} × {layer.step_y:.6g}) at the "
        f"posts of {target.name} (cells of {frame.cell_east_m:.6g} m east × {frame.cell_north_m:.6g} m north), linear "
        "on its triangles."
        for layer in layers
        if not same_map(split_shift(layer.crs)[0], target) or (layer.step_x, layer.step_y) != frame[-2:]
    ]
