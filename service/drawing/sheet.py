"""The sheet that every map is drawn on: shaded relief, kilometres round it, title above, legend in the margin."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from service.drawing.cover import draw_cover
from service.drawing.furniture import ANCHOR_COLOUR, INK, draw_anchors, draw_scale_and_north
from service.parts.map_facts import crs_label, grid_north_deg
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor

__all__ = [
    "Sampling",
    "anchor_handle",
    "ground_figure",
    "hatching",
    "lit_ground",
    "margin_legend",
    "mean_heights",
    "pick",
    "rgb",
    "save_png",
    "shaded_relief",
    "sources_words",
]

# A picture needs no more pixels than these along its longer side, and hatching needs at least the smaller number.
MOST_PIXELS = 1400
FEWEST_PIXELS = 700
SUN_AZIMUTH_RAD = math.radians(315.0)
SUN_ELEVATION_RAD = math.radians(45.0)
# Relief is exaggerated until the typical slope looks like this one: plains stay readable, mountains do not clip.
TYPICAL_SLOPE = 0.45
# Names come from outside: a dollar sign in one is a dollar sign, never the beginning of a formula.
rcParams["text.parse_math"] = False
DPI = 110
LONGER_SIDE_IN = 9.0
SHORTEST_SIDE_IN = 3.6
LEGEND_IN, LEFT_IN, BOTTOM_IN, TOP_IN = 2.15, 1.0, 0.65, 0.8
# Part of a colour that relief may darken.
RELIEF_STRENGTH = 0.62
HATCH_PERIOD_PX, HATCH_WIDTH_PX = 12, 3


@dataclass(frozen=True, slots=True)
class Sampling:
    """How a grid becomes picture cells: every ``step``-th post, drawn ``repeat`` pixels wide."""

    step: int
    repeat: int

    @classmethod
    def of(cls, shape: tuple[int, int]) -> Sampling:
        """What brings the longer side near the drawing size."""
        longest = max(shape)
        step = math.ceil(longest / MOST_PIXELS)
        return cls(step, max(1, round(FEWEST_PIXELS / max(1, longest // step))))


def pick(array: npt.NDArray[Any], sampling: Sampling) -> npt.NDArray[Any]:
    """Classes of every step-th post, repeated to picture pixels; classes are never averaged."""
    middle = sampling.step // 2
    picked = array[middle :: sampling.step, middle :: sampling.step] if sampling.step > 1 else array
    return repeated(picked, sampling.repeat)


def repeated(array: npt.NDArray[Any], repeat: int) -> npt.NDArray[Any]:
    """Each cell as a square of ``repeat`` pixels."""
    return array if repeat == 1 else array.repeat(repeat, axis=0).repeat(repeat, axis=1)


def mean_heights(heights_m: npt.NDArray[np.float32], step: int) -> npt.NDArray[np.float32]:
    """Mean height of each step × step block that ``pick`` takes a post from; NaN where the block has a NaN post."""
    if step == 1:
        return heights_m
    rows, cols = (len(range(step // 2, n, step)) for n in heights_m.shape)
    padded = np.pad(
        heights_m,
        ((0, max(0, rows * step - heights_m.shape[0])), (0, max(0, cols * step - heights_m.shape[1]))),
        mode="edge",
    )[: rows * step, : cols * step]
    means: npt.NDArray[np.float32] = padded.reshape(rows, step, cols, step).mean(axis=(1, 3), dtype=np.float32)
    return means


def shaded_relief(
    heights_m: npt.NDArray[np.float32], cell_east_m: float, cell_north_m: float
) -> npt.NDArray[np.float32]:
    """Brightness 0..1 of ground lit from the north-west; flat and unknown ground have that of a plain.

    heights_m: (rows, cols), NaN = unknown.
    """
    flat = np.float32(math.sin(SUN_ELEVATION_RAD))
    if min(heights_m.shape) < 2:
        return np.full(heights_m.shape, flat, np.float32)
    down_south, down_east = np.gradient(heights_m, cell_north_m, cell_east_m)
    steepness = np.hypot(down_south, down_east)
    known = steepness[np.isfinite(steepness)]
    typical = float(np.percentile(known, 80)) if known.size else 0.0
    exaggeration = TYPICAL_SLOPE / typical if typical > 0.0 else 1.0
    slope_east, slope_north = down_east * exaggeration, -down_south * exaggeration
    light_east = math.sin(SUN_AZIMUTH_RAD) * math.cos(SUN_ELEVATION_RAD)
    light_north = math.cos(SUN_AZIMUTH_RAD) * math.cos(SUN_ELEVATION_RAD)
    facing = (flat - slope_east * light_east - slope_north * light_north) / np.sqrt(
        1.0 + slope_east * slope_east + slope_north * slope_north
    )
    return np.where(np.isnan(facing), flat, np.clip(facing, 0.0, 1.0)).astype(np.float32)


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
    draw_cover(axes, grid, (west, east, south, north))
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
    """The legend, in the margin on the right, which is made as wide as it needs."""
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
    figure = axes.get_figure(root=True)
    assert figure is not None, "axes of a sheet are on one"
    needed_in = legend.get_window_extent().width / figure.dpi
    if needed_in > LEGEND_IN:
        _widen(figure, needed_in - LEGEND_IN)


def _widen(figure: Figure, more_in: float) -> None:
    """Room on the right; all that is drawn stays where it is and as large as it is."""
    width_in, height_in = figure.get_size_inches()
    left = width_in / (width_in + more_in)
    figure.set_size_inches(width_in + more_in, height_in)
    for axes in figure.axes:
        box = axes.get_position()
        axes.set_position((box.x0 * left, box.y0, box.width * left, box.height))
    for text in figure.texts:
        text.set_x(text.get_position()[0] * left)


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
