"""The morphing map as a picture: from which height above ground positioning is good enough up to the ceiling."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from service.drawing.class_map import NONE_COLOUR, UNDECIDED, MapClass, class_legend, class_pixels
from service.drawing.sheet import ground_figure, save_png, sources_words
from service.parts.map_facts import dem_name
from visibility import ColumnState

from .calculate import FinishedMorphingMap

__all__ = ["draw_morphing_map", "morphing_classes", "round_edges", "write_morphing_picture"]

# Low is good: it leaves the most air to fly in.
COLOURS = ("#e9f3d5", "#b5dcc3", "#72b9c6", "#3f86b5", "#2c4f8e", "#27306b")
CLOSED_COLOUR, OUTSIDE_COLOUR = "#e3a45b", "#8b8378"
ROUND = (1.0, 2.0, 5.0, 10.0)


def write_morphing_picture(finished: FinishedMorphingMap, path: Path) -> None:
    """Draw the map into a PNG."""
    save_png(draw_morphing_map(finished), path)


def draw_morphing_map(finished: FinishedMorphingMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, grid = finished.parameters, finished.grid
    above_m = finished.above_ground_m
    classes, numbers = morphing_classes(above_m, finished.state, round_edges(above_m))
    few = "" if parameters.min_anchors is None else f", at least {parameters.min_anchors} anchors"
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        finished.anchors,
        f"Flyable from this height above ground: {dem_name(grid)}",
        f"{parameters.measure.upper()} of {parameters.kind} < {parameters.dop_limit:g}{few}, up to "
        f"{finished.ceiling_words()}; {sources_words(finished.anchors)}",
    )
    class_legend(axes, grid, numbers, classes, "Height above ground, m")
    return figure


def morphing_classes(
    above_m: npt.NDArray[np.float32], state: npt.NDArray[np.uint8], edges: list[float]
) -> tuple[list[MapClass], npt.NDArray[np.uint8]]:
    """Classes of heights above ground between the edges and of states without one, and the class of each post."""
    between = (f"{low:g}–{high:g}" for low, high in pairwise(edges))
    labels = ["ground up", f"< {edges[0]:g}", *between, f"> {edges[-1]:g}"]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    first_state = len(classes)
    classes += [
        MapClass("not at top", CLOSED_COLOUR),
        MapClass("nowhere", NONE_COLOUR),
        MapClass("no air", OUTSIDE_COLOUR),
    ]
    numbers = (1 + np.digitize(above_m, np.array(edges, np.float32))).astype(np.uint8)
    numbers[state == ColumnState.EVERYWHERE] = 0
    for number, kind in enumerate((ColumnState.CLOSED_AT_CEILING, ColumnState.NOWHERE, ColumnState.OUTSIDE)):
        numbers[state == kind] = first_state + number
    numbers[state == ColumnState.UNKNOWN] = UNDECIDED
    return classes, numbers


def round_edges(above_m: npt.NDArray[np.float32]) -> list[float]:
    """Four round heights, evenly spaced, that part the heights from the 2nd to the 95th percentile."""
    above_m = above_m[np.isfinite(above_m) & (above_m > 0.0)]
    low_m, high_m = np.quantile(above_m, (0.02, 0.95)).tolist() if above_m.size else (0.0, 100.0)
    steps = len(COLOURS) - 2
    least_m = max((high_m - low_m) / steps, 0.1)
    power = 10.0 ** np.floor(np.log10(least_m))
    step_m = float(next(m * power for m in ROUND if m * power >= least_m * (1.0 - 1e-9)))
    first_m = np.floor(low_m / step_m) * step_m
    return [float(first_m + number * step_m) for number in range(1, steps + 1)]
