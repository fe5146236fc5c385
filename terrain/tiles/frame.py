"""Where the posts of a mosaic lie: its metric CRS, its lattice, and the windows of the layers that it takes."""

from __future__ import annotations

import math

import numpy as np
import pyproj

from ..areas import Box, Outline, area_in
from ..crs.parts import same_map, split_shift, with_shift
from ..errors import AreaError, NoGroundError
from ..files.placing import axes_in_metres, better_crs
from ..files.raw import PostWindow
from ..files.warping import Frame, Posts, border_positions, cell_sizes
from ..units import degrees_per_unit
from .layer import Layer
from .plan import MosaicPlan

__all__ = ["bounds_wanted", "frame_of", "target_of", "window_for"]

# posts read beyond a window that is warped, so that its border lies within triangles
AROUND = 2
SLACK = 1e-6


def target_of(plan: MosaicPlan, layer: Layer) -> pyproj.CRS:
    """The metric CRS for the ground that a plan wants of its finest layer: its own where that measures truly."""
    crs, shift = split_shift(layer.crs)
    posts = _ground_of(plan, layer, crs)
    if crs.is_projected:
        posts = axes_in_metres(posts, True, [], [])
    better = None if layer.from_grid else better_crs(layer.name, posts, [])
    return with_shift(better or posts.crs, shift)


def frame_of(plan: MosaicPlan, layer: Layer, target: pyproj.CRS, cell_m: float | None) -> Frame:
    """The lattice of a mosaic in ``target``: the finest layer's own where it has that CRS, else on whole cells.

    cell_m: metres between posts, in place of those of the finest layer.
    """
    crs, _ = split_shift(layer.crs)
    own = same_map(crs, target) and cell_m is None
    if own:
        east_m, north_m, phase_east_m, phase_north_m = layer.step_x, layer.step_y, layer.x0, layer.y0
    else:
        east_m, north_m = (cell_m, cell_m) if cell_m else cell_sizes(_ground_of(plan, layer, crs), target)
        phase_east_m = phase_north_m = 0.0
    bounds = bounds_wanted(plan.area, target)
    if bounds is not None and cell_m is not None and cell_m > max(bounds[2] - bounds[0], bounds[3] - bounds[1]):
        raise AreaError(
            f"Cells of {cell_m:g} m are larger than the area, which with its margin is {bounds[2] - bounds[0]:,.0f} m "
            f"by {bounds[3] - bounds[1]:,.0f} m; give a smaller cell_m."
        )
    inward = -1.0 if bounds is None else 1.0  # all tiles: no post beyond them; an area: the posts that enclose it
    west, south, east, north = bounds or _bounds_of_tiles(plan, target)
    first_col = _low((west - phase_east_m) / east_m, inward)
    last_col = -_low((phase_east_m - east) / east_m, inward)
    top = _low((phase_north_m - north) / north_m, inward)
    bottom = -_low((south - phase_north_m) / north_m, inward)
    return Frame(
        bottom - top + 1, last_col - first_col + 1,
        phase_east_m + first_col * east_m, phase_north_m - top * north_m, east_m, north_m,
    )  # fmt: skip


def window_for(layer: Layer, bounds: tuple[float, float, float, float] | None, target: pyproj.CRS) -> PostWindow:
    """The posts of a layer for (west, south, east, north) in ``target``; None takes all. Raises NoGroundError."""
    if bounds is None:
        return PostWindow(0, layer.rows - 1, 0, layer.cols - 1)
    warped = not same_map(split_shift(layer.crs)[0], target)
    west, south, east, north = area_in(Box(*bounds, frame=target.to_wkt()), layer.crs).bounds
    if layer.crs.is_geographic:
        turn = 360.0 / degrees_per_unit(layer.crs)
        middle = layer.x0 + (layer.cols - 1) / 2.0 * layer.step_x
        turns = round((middle - (west + east) / 2.0) / turn) * turn
        west, east = west + turns, east + turns
    window = layer.window_around((west, south, east, north), AROUND if warped else 0)
    if window is None:
        raise NoGroundError(f"The area touches only the outer border of {layer.name}, where no post lies.")
    return window


def bounds_wanted(area: Outline | None, target: pyproj.CRS) -> tuple[float, float, float, float] | None:
    """(west, south, east, north) of an area in ``target``."""
    if area is None:
        return None
    west, south, east, north = area_in(area, target).bounds
    return float(west), float(south), float(east), float(north)


def _low(position: float, outward: float) -> int:
    """The last whole number up to a position, or where ``outward`` < 0 the first from it on; rounding aside."""
    return math.floor(position + SLACK) if outward > 0.0 else math.ceil(position - SLACK)


def _ground_of(plan: MosaicPlan, layer: Layer, crs: pyproj.CRS) -> Posts:
    """Posts without heights where the plan wants ground, in the layer's CRS."""
    x0, y0, rows, cols = layer.x0, layer.y0, layer.rows, layer.cols
    if plan.area is not None:
        west, south, east, north = area_in(plan.area, layer.crs).bounds
        rows = max(round((north - south) / layer.step_y), 1) + 1
        cols = max(round((east - west) / layer.step_x), 1) + 1
        x0, y0 = west, north
    return Posts(np.broadcast_to(np.float32(0.0), (rows, cols)), x0, y0, layer.step_x, layer.step_y, crs)


def _bounds_of_tiles(plan: MosaicPlan, target: pyproj.CRS) -> tuple[float, float, float, float]:
    east, north = [], []
    for planned in plan.layers:
        layer = planned.layer
        whole = Posts(
            np.broadcast_to(np.float32(0.0), (layer.rows, layer.cols)),
            layer.x0, layer.y0, layer.step_x, layer.step_y, layer.crs,
        )  # fmt: skip
        onward = pyproj.Transformer.from_crs(layer.crs, target, always_xy=True)
        at_east, at_north = onward.transform(*border_positions(whole))
        east.append(at_east)
        north.append(at_north)
    all_east, all_north = np.concatenate(east), np.concatenate(north)
    return float(all_east.min()), float(all_north.min()), float(all_east.max()), float(all_north.max())
