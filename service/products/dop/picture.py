"""The DOP map as a picture: how good positioning is, and the line where it stops being good enough."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from service.drawing.class_map import (
    NONE_COLOUR,
    UNDECIDED,
    MapClass,
    class_legend,
    class_pixels,
    class_shares,
    write_legend,
    write_pixels,
)
from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, ground_figure, save_png, sources_words
from service.parts.map_facts import dem_name

from .calculate import FinishedDopMap
from .request import DopMapParameters

__all__ = ["dop_classes", "draw_dop_map", "write_dop_legend", "write_dop_overlay", "write_dop_picture"]

# Shares of the limit at which classes begin: cold colours are good enough, warm ones are not.
BOUNDS = (0.0, 0.5, 0.75, 1.0, 2.0)
COLOURS = ("#2c5f9e", "#4fa3c4", "#b5dcc3", "#f2c46d", "#e08a45")


def write_dop_picture(finished: FinishedDopMap, path: Path) -> None:
    """Draw the map into a PNG."""
    save_png(draw_dop_map(finished), path)


def write_dop_overlay(finished: FinishedDopMap, path: Path) -> None:
    """The dilution in the colours of its classes, darkened by relief."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    write_pixels(finished.grid, class_pixels(finished.grid, numbers, classes), path)


def write_dop_legend(finished: FinishedDopMap, path: Path) -> None:
    """Its classes, best first."""
    classes, numbers = dop_classes(finished.dop, finished.count, finished.parameters)
    write_legend(finished.parameters.measure.upper(), class_shares(finished.grid, numbers, classes), path)


def draw_dop_map(finished: FinishedDopMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, grid = finished.parameters, finished.grid
    classes, numbers = dop_classes(finished.dop, finished.count, parameters)
    bound = ", moving along the surface" if parameters.on_surface else ""
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"{parameters.measure.upper()} of {parameters.kind}: {dem_name(grid)}",
        f"{sources_words(finished.anchors)}, antenna {parameters.receiver_above_ground_m:g} m above ground{bound}, "
        f"mode {parameters.mode}",
    )
    _limit_line(axes, finished)
    line = (f"{parameters.measure.upper()} {parameters.dop_limit:g}", Line2D([], [], color=INK, lw=1.2))
    class_legend(axes, grid, numbers, classes, parameters.measure.upper(), [line])
    return figure


def dop_classes(
    dop: npt.NDArray[np.float32], count: npt.NDArray[np.uint16], parameters: DopMapParameters
) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes round the limit that is asked for, and the class number of each dilution."""
    edges = [parameters.dop_limit * bound for bound in BOUNDS]
    labels = [f"{low:.3g}–{high:.3g}" for low, high in pairwise(edges)]
    labels = [f"< {edges[1]:.3g}", *labels[1:], f"≥ {edges[-1]:.3g}"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    few = f", < {parameters.min_anchors}" if parameters.min_anchors else ""
    classes.append(MapClass(f"no fix{few}", NONE_COLOUR))
    numbers = np.digitize(dop, np.array(edges[1:], np.float32)).astype(np.uint8)
    numbers[np.isinf(dop) | (count < (parameters.min_anchors or 0))] = len(classes) - 1
    numbers[np.isnan(dop)] = UNDECIDED
    return classes, numbers


def _limit_line(axes: Axes, finished: FinishedDopMap) -> None:
    """The line of the limit between drawn posts, interpolated in 1/DOP, which is 0 where no fix is good enough."""
    grid = finished.grid
    step = Sampling.of(grid.shape).step
    rows, cols = np.arange(step // 2, grid.rows, step), np.arange(step // 2, grid.cols, step)
    if min(len(rows), len(cols)) < 2:
        return
    drawn = np.ix_(rows, cols)
    enough = finished.count[drawn] >= (finished.parameters.min_anchors or 0)
    goodness = np.ma.masked_invalid(np.where(enough, 1.0, 0.0) / finished.dop[drawn])
    level = 1.0 / finished.parameters.dop_limit
    if not (goodness.count() and goodness.min() < level < goodness.max()):
        return
    east_km = (grid.origin_east_m + cols * grid.cell_east_m) / 1000.0
    north_km = (grid.origin_north_m - rows * grid.cell_north_m) / 1000.0
    axes.contour(east_km, north_km, goodness, levels=[level], colors=[INK], linewidths=0.9, zorder=5)
