"""What stands on the ground, on maps and in profiles: roofs grey, trees green."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.legend import Legend
from matplotlib.patches import Patch

from terrain import ElevationGrid, height_at
from visibility.sight.roofs import roofs_over

__all__ = ["ROOF_COLOUR", "TREE_COLOUR", "draw_cover", "draw_cover_along"]

Reals = npt.NDArray[np.float64]

ROOF_COLOUR, ROOF_EDGE_COLOUR, TREE_COLOUR = "#8c8c94", "#33333a", "#1e8a3c"
TREE_ALPHA = 0.42
MOST_PIXELS = 1400
LEAST_M = 0.1  # a lower crown is no tree on a picture


def draw_cover(axes: Axes, grid: ElevationGrid, extent_km: tuple[float, float, float, float]) -> None:
    """Over a map in kilometres: where trees stand, and roofs with their edges; told in a corner.

    extent_km: (west, east, south, north) of the picture.
    """
    told = []
    if grid.trees is not None:
        step = max(-(-max(grid.shape) // MOST_PIXELS), 1)
        tall = np.nan_to_num(grid.trees.top_m[step // 2 :: step, step // 2 :: step]) > LEAST_M
        if tall.any():
            pixels = np.zeros((*tall.shape, 4))
            pixels[tall] = (*_rgb(TREE_COLOUR), TREE_ALPHA)
            axes.imshow(pixels, extent=extent_km, interpolation="nearest", aspect="auto", zorder=1.5)
            told.append(Patch(facecolor=TREE_COLOUR, alpha=TREE_ALPHA, label="trees"))
    if grid.standing is not None:
        faces_km, edges_km = grid.standing.faces_m[..., :2] / 1000.0, grid.standing.edges_m[..., :2] / 1000.0
        axes.add_collection(PolyCollection(list(faces_km), facecolor=ROOF_COLOUR, edgecolor="none", zorder=1.6))
        axes.add_collection(LineCollection(list(edges_km), colors=ROOF_EDGE_COLOUR, linewidths=0.5, zorder=1.7))
        told.append(Patch(facecolor=ROOF_COLOUR, edgecolor=ROOF_EDGE_COLOUR, label="buildings"))
    if told:
        words = [str(one.get_label()) for one in told]
        corner = Legend(axes, told, words, loc="lower right", fontsize=8.5, framealpha=0.85, handlelength=1.2)
        corner.set_zorder(9)
        axes.add_artist(corner)


def draw_cover_along(axes: Axes, x: Reals, grid: ElevationGrid, places_m: tuple[Reals, Reals], ground_m: Reals) -> None:
    """Over a profile: crowns and roofs above the ground; x: (n,) of places east, north (n,), ground_m: (n,) below."""
    east_m, north_m = places_m
    if grid.trees is not None:
        bare = replace(grid, standing=None, trees=None)
        top_m, base_m = (
            np.nan_to_num(np.asarray(height_at(replace(bare, heights_m=of), east_m, north_m), np.float64))
            for of in (grid.trees.top_m, grid.trees.base_m)
        )
        there = top_m > LEAST_M
        if there.any():
            axes.fill_between(
                *(x, ground_m + base_m, ground_m + top_m), where=there, color=TREE_COLOUR, alpha=TREE_ALPHA, lw=0,
                label="trees",
            )  # fmt: skip
    roof_m = roofs_over(grid, east_m, north_m)
    built = np.isfinite(roof_m)
    if built.any():
        axes.fill_between(x, ground_m, roof_m, where=built, color=ROOF_COLOUR, lw=0, label="buildings")


def _rgb(colour: str) -> tuple[float, float, float]:
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue
