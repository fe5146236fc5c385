"""The quick look: count of visible anchors over shaded relief."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from service.map_facts import crs_label, dem_name
from service.visibility_map import VisibilityMap

from .classes import NO_GROUND_COLOUR, UNKNOWN_COLOUR, CountClass, count_classes, lookup_table
from .furniture import ANCHOR_COLOUR, INK, draw_anchors, draw_scale_and_north
from .relief import Sampling, mean_heights, pick, repeated, shaded_relief

__all__ = ["draw_map", "write_map_picture"]

DPI = 110
LONGER_SIDE_IN = 9.0
SHORTEST_SIDE_IN = 3.6
LEGEND_IN, LEFT_IN, BOTTOM_IN, TOP_IN = 2.15, 1.0, 0.65, 0.8
# Part of a colour that relief may darken.
RELIEF_STRENGTH = 0.62
HATCH_PERIOD_PX, HATCH_WIDTH_PX = 12, 3


def write_map_picture(finished: VisibilityMap, path: Path) -> None:
    """Draw the map into a PNG."""
    figure = draw_map(finished)
    # the path's suffix is not asked: a temporary name may have any
    figure.savefig(path, format="png", dpi=DPI)


def draw_map(finished: VisibilityMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    grid = finished.grid
    west = (grid.origin_east_m - 0.5 * grid.cell_east_m) / 1000.0
    north = (grid.origin_north_m + 0.5 * grid.cell_north_m) / 1000.0
    east, south = west + grid.cols * grid.cell_east_m / 1000.0, north - grid.rows * grid.cell_north_m / 1000.0
    classes = count_classes(len(finished.anchors))
    width_in, height_in = _map_size_in(east - west, north - south)
    whole_in = width_in + LEFT_IN + LEGEND_IN, height_in + BOTTOM_IN + TOP_IN
    figure = Figure(figsize=whole_in, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes(
        (LEFT_IN / whole_in[0], BOTTOM_IN / whole_in[1], width_in / whole_in[0], height_in / whole_in[1])
    )
    axes.imshow(_pixels(finished, classes), extent=(west, east, south, north), interpolation="nearest", aspect="auto")
    axes.set_xlim(west, east)
    axes.set_ylim(south, north)
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.locator_params(nbins=7)
    axes.set_xlabel(f"east, km  ({crs_label(grid)})")
    axes.set_ylabel("north, km")
    draw_scale_and_north(axes, 1000.0 * (east - west), width_in, height_in)
    draw_anchors(axes, finished.anchors, (west, east, south, north))
    _title(figure, finished, LEFT_IN / whole_in[0], whole_in[1])
    _legend(axes, finished, classes)
    return figure


def _pixels(finished: VisibilityMap, classes: tuple[CountClass, ...]) -> npt.NDArray[np.uint8]:
    """(rows, cols, 3) picture: count colours darkened by relief, grey and hatched where unknown."""
    grid = finished.grid
    sampling = Sampling.of(grid.shape)
    count, unknown = pick(finished.count, sampling), pick(finished.unknown_count, sampling)
    heights_m = mean_heights(grid.heights_m, sampling.step)
    shade = shaded_relief(heights_m, grid.cell_east_m * sampling.step, grid.cell_north_m * sampling.step)
    light = (1.0 - RELIEF_STRENGTH) + RELIEF_STRENGTH * np.minimum(shade / 0.85, 1.0)
    colour = lookup_table(classes)[count] * repeated(light, sampling.repeat)[..., None]
    nothing_sure = (count == 0) & (unknown > 0)
    colour[nothing_sure] = _rgb(UNKNOWN_COLOUR)
    no_ground = repeated(np.isnan(heights_m), sampling.repeat)
    hatched = _hatching(count.shape) & (unknown > 0) & ~no_ground
    colour[hatched] *= 0.72
    colour[no_ground & nothing_sure] = _rgb(NO_GROUND_COLOUR)
    return np.asarray(np.rint(colour * 255.0), np.uint8)


def _hatching(shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    rows, cols = np.ogrid[: shape[0], : shape[1]]
    stripes: npt.NDArray[np.bool_] = (rows + cols) % HATCH_PERIOD_PX < HATCH_WIDTH_PX
    return stripes


def _title(figure: Figure, finished: VisibilityMap, left: float, height_in: float) -> None:
    parameters, n_anchors = finished.parameters, len(finished.anchors)
    receiver = (
        f"receiver {parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"receiver at altitude {parameters.receiver_altitude_m:g} m"
    )
    anchors = "1 anchor" if n_anchors == 1 else f"{n_anchors} anchors"
    figure.text(
        left, 1 - 0.2 / height_in, f"Anchors in sight: {dem_name(finished.grid)}", fontsize=14, fontweight="bold",
        va="top", color=INK,
    )  # fmt: skip
    figure.text(
        left, 1 - 0.5 / height_in, f"{anchors}, {receiver}, mode {parameters.mode}", fontsize=10, va="top", color=INK
    )


def _legend(axes: Axes, finished: VisibilityMap, classes: tuple[CountClass, ...]) -> None:
    """Classes with their share of the known posts, as the tables have it, in the margin on the right."""
    heights_m, undecided = finished.grid.heights_m, finished.undecided
    posts = np.bincount(finished.count[~np.isnan(heights_m)], minlength=len(finished.anchors) + 1)
    known_posts, n_undecided = int(posts.sum()), int(np.count_nonzero(undecided))
    posts[0] -= n_undecided
    rows: list[tuple[str, Patch, int | None]] = [
        (c.label, Patch(fc=c.rgb, ec=INK, lw=0.6), int(posts[c.first : c.last + 1].sum())) for c in reversed(classes)
    ]
    if n_undecided or bool(np.any((finished.count > 0) & (finished.unknown_count > 0))):
        rows.append(("unknown", Patch(fc=UNKNOWN_COLOUR, ec="#777777", lw=0.6, hatch="/////"), n_undecided))
    if bool(np.any(np.isnan(heights_m) & (finished.count == 0) & (finished.unknown_count > 0))):
        # no share: it is no part of the known posts
        rows.append(("no ground", Patch(fc=NO_GROUND_COLOUR, ec=INK, lw=0.6), None))
    widest = max(len(label) for label, _, n in rows if n is not None)
    handles: list[Artist] = [handle for _, handle, _ in rows]
    labels = [
        label if n is None else f"{label:<{widest}} {100 * n / max(known_posts, 1):5.1f} %" for label, _, n in rows
    ]
    handles.append(Line2D([], [], marker="^", ms=9, mfc=ANCHOR_COLOUR, mec=INK, mew=1.2, ls="none"))
    legend = axes.legend(
        handles,
        [*labels, "anchor"],
        title="Anchors in sight,\nshare of known posts",
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


def _rgb(colour: str) -> tuple[float, float, float]:
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue
