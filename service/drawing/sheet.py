"""The sheet that every map is drawn on: shaded ground, kilometres round it, title above, legend in the margin."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from service.drawing.furniture import ANCHOR_COLOUR, INK, draw_anchors, draw_scale_and_north
from service.drawing.sheet import Sampling, mean_heights, repeated, shaded_relief
from service.parts.map_facts import crs_label, grid_north_deg
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor

__all__ = [
    "anchor_handle",
    "ground_figure",
    "hatching",
    "lit_ground",
    "margin_legend",
    "rgb",
    "save_png",
    "sources_words",
]

# Names come from outside: a dollar sign in one is a dollar sign, never the beginning of a formula.
rcParams["text.parse_math"] = False

DPI = 110
LONGER_SIDE_IN = 9.0
SHORTEST_SIDE_IN = 3.6
LEGEND_IN, LEFT_IN, BOTTOM_IN, TOP_IN = 2.15, 1.0, 0.65, 0.8
# Part of a colour that relief may darken.
RELIEF_STRENGTH = 0.62
HATCH_PERIOD_PX, HATCH_WIDTH_PX = 12, 3


def save_png(figure: Figure, path: Path) -> None:
    """Write a figure; the path's suffix is not asked, because a temporary name may have any."""
    figure.savefig(path, format="png", dpi=DPI)


def ground_figure(
    grid: ElevationGrid,
    pixels: npt.NDArray[np.uint8],
    anchors: Sequence[Anchor | DistantAnchor],
    title: str,
    subtitle: str,
) -> tuple[Figure, Axes]:
    """A figure with one Axes in kilometres of the grid's frame, its picture, scale, north arrow and anchors."""
    west = (grid.origin_east_m - 0.5 * grid.cell_east_m) / 1000.0
    north = (grid.origin_north_m + 0.5 * grid.cell_north_m) / 1000.0
    east, south = west + grid.cols * grid.cell_east_m / 1000.0, north - grid.rows * grid.cell_north_m / 1000.0
    width_in, height_in = _map_size_in(east - west, north - south)
    whole_in = width_in + LEFT_IN + LEGEND_IN, height_in + BOTTOM_IN + TOP_IN
    figure = Figure(figsize=whole_in, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes(
        (LEFT_IN / whole_in[0], BOTTOM_IN / whole_in[1], width_in / whole_in[0], height_in / whole_in[1])
    )
    axes.imshow(pixels, extent=(west, east, south, north), interpolation="nearest", aspect="auto")
    axes.set_xlim(west, east)
    axes.set_ylim(south, north)
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.locator_params(nbins=7)
    axes.set_xlabel(f"east, km  ({crs_label(grid)})")
    axes.set_ylabel("north, km")
    draw_scale_and_north(axes, 1000.0 * (east - west), width_in, height_in, grid_north_deg(grid))
    draw_anchors(axes, tuple(a for a in anchors if isinstance(a, Anchor)), (west, east, south, north))
    left, top = LEFT_IN / whole_in[0], whole_in[1]
    figure.text(left, 1 - 0.2 / top, title, fontsize=14, fontweight="bold", va="top", color=INK)
    figure.text(left, 1 - 0.5 / top, subtitle, fontsize=10, va="top", color=INK)
    return figure, axes


def sources_words(anchors: Sequence[Anchor | DistantAnchor]) -> str:
    """How many anchors and satellites there are, in words."""
    satellites = sum(isinstance(anchor, DistantAnchor) for anchor in anchors)
    near = len(anchors) - satellites
    words = [
        f"{number} {one if number == 1 else many}"
        for number, one, many in ((near, "anchor", "anchors"), (satellites, "satellite", "satellites"))
        if number
    ]
    return " and ".join(words)


def lit_ground(grid: ElevationGrid, sampling: Sampling) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.bool_]]:
    """(brightness 0..1 that relief leaves of a colour, where no ground is known), both at picture size."""
    heights_m = mean_heights(grid.heights_m, sampling.step)
    shade = shaded_relief(heights_m, grid.cell_east_m * sampling.step, grid.cell_north_m * sampling.step)
    light = (1.0 - RELIEF_STRENGTH) + RELIEF_STRENGTH * np.minimum(shade / 0.85, 1.0)
    return repeated(light, sampling.repeat), repeated(np.isnan(heights_m), sampling.repeat)


def hatching(shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    """Diagonal stripes that mark what is unknown."""
    rows, cols = np.ogrid[: shape[0], : shape[1]]
    stripes: npt.NDArray[np.bool_] = (rows + cols) % HATCH_PERIOD_PX < HATCH_WIDTH_PX
    return stripes


def anchor_handle() -> Line2D:
    """An anchor as the legend shows it."""
    return Line2D([], [], marker="^", ms=9, mfc=ANCHOR_COLOUR, mec=INK, mew=1.2, ls="none")


def margin_legend(axes: Axes, handles: Sequence[Artist], labels: Sequence[str], title: str) -> None:
    """The legend, in the margin on the right."""
    legend = axes.legend(
        handles,
        labels,
        title=title,
        loc="upper left",
        bbox_to_anchor=(1.0, 1.0),
        borderaxespad=0.0,
        borderpad=0.6,
        frameon=False,
        alignment="left",
        labelspacing=0.55,
        handlelength=1.6,
        handleheight=1.2,
        prop={"family": "monospace", "size": 9.5},
    )
    legend.get_title().set_fontfamily("sans-serif")
    legend.get_title().set_fontweight("bold")


def _map_size_in(width: float, height: float) -> tuple[float, float]:
    """Inches of the map itself: its proportions, unless it is so thin that nothing could be read."""
    scale = LONGER_SIDE_IN / max(width, height)
    if width < height:
        scale *= 0.85
    return max(width * scale, SHORTEST_SIDE_IN), max(height * scale, SHORTEST_SIDE_IN)


def rgb(colour: str) -> tuple[float, float, float]:
    """A #rrggbb colour as shares of 1."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue
