"""Placements as pictures: who is in sight and how good positioning is, before and after."""

from __future__ import annotations

from typing import Literal

import matplotlib
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from service.drawing.class_map import (
    NONE_COLOUR,
    RAMP,
    RAMP_FROM,
    RAMP_TO,
    UNDECIDED,
    MapClass,
    class_legend,
    class_pixels,
)
from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, ground_figure
from service.parts.map_facts import dem_name
from service.parts.sentences import counted
from service.products.dop.picture import dilution_classes

from .answer import FinishedPlacement
from .question import goal_of

__all__ = ["draw_placement"]

MOST_CLASSES = 8


def draw_placement(finished: FinishedPlacement, what: Literal["count", "dop"], *, after: bool) -> Figure:
    """Counts or dilutions as a figure with one Axes in kilometres of the grid's frame."""
    classes, numbers, title = (_counts if what == "count" else _dilutions)(finished, after)
    numbers = np.where(np.isnan(finished.grid.heights_m), UNDECIDED, numbers).astype(np.uint8)
    answer = finished.answer
    anchors = (*finished.anchors, *(finished.chosen if after else ()))
    value = answer.number("value" if after else "before")
    told = f"{value:.2f} m" if answer.value_share is None else f"{value:.1%}"
    moment = (
        f"{counted(len(anchors), 'anchor')}, {len(answer.placed)} of them placed"
        if after
        else f"before: {counted(len(anchors), 'anchor')}"
    )
    figure, axes = ground_figure(
        finished.grid,
        class_pixels(finished.grid, numbers, classes),
        anchors,
        f"{title}: {dem_name(finished.grid)}",
        f"{moment}; {answer.goal}: {told}",
    )
    more = _target_outline(axes, finished)
    class_legend(axes, finished.grid, numbers, classes, title, more)
    return figure


def _counts(finished: FinishedPlacement, after: bool) -> tuple[list[MapClass], npt.NDArray[np.uint8], str]:
    """None, one class per count, and one of as many as are needed or more."""
    count = finished.count_after if after else finished.count_before
    needed = goal_of(finished.parameters.goal, finished.parameters.reach).needed_with_spare
    full = min(max(needed, 1), MOST_CLASSES)
    ramp = matplotlib.colormaps[RAMP](np.linspace(RAMP_FROM, RAMP_TO, full))
    labels = [*(str(number) for number in range(1, full)), f"{full} or more"]
    classes = [MapClass("0", NONE_COLOUR), *(MapClass(label, to_hex(c)) for label, c in zip(labels, ramp, strict=True))]
    return classes, np.minimum(count, full).astype(np.uint8), f"Anchors {finished.parameters.in_words}"


def _dilutions(finished: FinishedPlacement, after: bool) -> tuple[list[MapClass], npt.NDArray[np.uint8], str]:
    dop = finished.dop_after if after else finished.dop_before
    goal = finished.parameters.goal
    return *dilution_classes(dop, goal.dop_limit), goal.measure.upper()


def _target_outline(axes: Axes, finished: FinishedPlacement) -> list[tuple[str, Line2D]]:
    """The border of the targets, where they are not all of the ground."""
    grid = finished.grid
    known = ~np.isnan(grid.heights_m)
    if bool((finished.is_target[known] == 1).all()) or min(grid.shape) < 2:
        return []
    step = Sampling.of(grid.shape).step
    rows, cols = np.arange(0, grid.rows, step), np.arange(0, grid.cols, step)
    # a path a post wide must not be stepped over
    reached = np.maximum.reduceat(np.maximum.reduceat(finished.is_target, rows, axis=0), cols, axis=1)
    east_km = (grid.origin_east_m + cols * grid.cell_east_m) / 1000.0
    north_km = (grid.origin_north_m - rows * grid.cell_north_m) / 1000.0
    axes.contour(east_km, north_km, reached, levels=[0.5], colors=[INK], linewidths=1.1, zorder=6)
    return [("to be served", Line2D([], [], color=INK, lw=1.1))]
