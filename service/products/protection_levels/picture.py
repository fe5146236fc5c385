"""Protection levels as pictures: maps by classes of metres, and levels along a path."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from service.drawing import class_map
from service.drawing.class_map import UNDECIDED, MapClass, class_legend, class_pixels, class_shares
from service.drawing.furniture import INK
from service.drawing.sheet import ground_figure
from service.parts.map_facts import dem_name

from .calculate import PATH_COLUMNS, FinishedProtection

__all__ = ["draw_levels", "draw_profile", "write_legend", "write_overlay"]

EDGES_M = (0.0, 2.0, 5.0, 10.0, 20.0, 50.0)
COLOURS = ("#1a7a4c", "#5fae5b", "#b6d65a", "#f4cf4a", "#ef9640", "#cf5034")
NO_PROMISE = "#5a3a4a"
TITLES = {False: "Horizontal protection level", True: "Vertical protection level"}
TOO_TALL = 6.0
HORIZONTAL_COLOUR, VERTICAL_COLOUR, COUNT_COLOUR = "#2c5f9e", "#c2452d", "#5d7a3c"


def draw_levels(finished: FinishedProtection, vertical: bool = False) -> Figure:
    """The map of one level, with the path where there is one."""
    numbers, classes = _classes(finished, vertical)
    grid, answer = finished.grid, finished.answer
    share = "nothing known" if answer.within_alert_share is None else f"{100.0 * answer.within_alert_share:.0f} %"
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"{TITLES[vertical]}: {dem_name(grid)}",
        f"missed with {finished.parameters.missed:g}, {finished.parameters.most_faults} wrong ranges at most; within "
        f"the alert limits {share}",
    )
    if len(finished.path_numbers):
        axes.plot(*(finished.path_numbers[:, 1:3] / 1000.0).T, color=INK, lw=1.4, zorder=6, scalex=False, scaley=False)
    class_legend(axes, grid, numbers, classes, TITLES[vertical])
    return figure


def draw_profile(finished: FinishedProtection) -> Figure:
    """Levels along the path with their alert limits, and how many anchors are expected."""
    figure = Figure(figsize=(10.0, 5.2), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    levels, count = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": [3.0, 1.2]})
    columns = {name: finished.path_numbers[:, place] for place, name in enumerate(PATH_COLUMNS)}
    way_m, parameters = columns["distance_m"], finished.parameters
    for name, colour, alert_m in (
        ("horizontal", HORIZONTAL_COLOUR, parameters.horizontal_alert_m),
        ("vertical", VERTICAL_COLOUR, parameters.vertical_alert_m),
    ):
        level = columns[f"{name}_m"]
        levels.plot(way_m, np.where(np.isfinite(level), level, np.nan), color=colour, lw=1.6, label=name)
        levels.axhline(alert_m, color=colour, lw=0.8, ls="--")
    nothing = ~np.isfinite(columns["horizontal_m"])
    levels.fill_between(
        way_m, 0.0, 1.0, where=nothing, transform=levels.get_xaxis_transform(), step="mid", color=NO_PROMISE,
        alpha=0.25, lw=0.0, label="nothing promised" if nothing.any() else None,
    )  # fmt: skip
    levels.set_ylabel("protection level, m")
    # what is far beyond the limits would press them flat
    most_m = TOO_TALL * max(parameters.horizontal_alert_m, parameters.vertical_alert_m)
    levels.set_ylim(0.0, min(levels.get_ylim()[1], most_m))
    levels.legend(loc="best", framealpha=0.9)
    levels.set_title(f"Protection levels: {dem_name(finished.grid)}\nalert limits dashed", loc="left", fontsize=11)
    count.step(way_m, columns["anchors_expected"], where="mid", color=COUNT_COLOUR, lw=1.4)
    count.set_ylabel("anchors\nexpected")
    count.set_ylim(-0.3, len(finished.anchors) + 0.3)
    count.set_xlabel("way, m")
    for axis in (levels, count):
        axis.grid(alpha=0.25)
        axis.margins(x=0.0)
    return figure


def write_overlay(finished: FinishedProtection, path: Path) -> None:
    """The horizontal level in the colours of its classes, darkened by relief."""
    class_map.write_pixels(finished.grid, class_pixels(finished.grid, *_classes(finished)), path)


def write_legend(finished: FinishedProtection, path: Path) -> None:
    """Its classes, least first."""
    class_map.write_legend(TITLES[False], class_shares(finished.grid, *_classes(finished)), path)


def _classes(finished: FinishedProtection, vertical: bool = False) -> tuple[npt.NDArray[np.uint8], list[MapClass]]:
    level = finished.vertical if vertical else finished.horizontal
    labels = [f"{low:g}–{high:g} m" for low, high in pairwise(EDGES_M)] + [f"over {EDGES_M[-1]:g} m"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    numbers = np.digitize(level, np.array(EDGES_M[1:], np.float32)).astype(np.uint8)
    numbers[np.isinf(level)] = len(classes)
    numbers[np.isnan(level)] = UNDECIDED
    return numbers, [*classes, MapClass("nothing promised", NO_PROMISE)]
