"""The quick look: count of visible anchors over shaded relief."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from service.drawing import class_map
from service.drawing.class_map import (
    NO_GROUND_COLOUR,
    UNKNOWN_COLOUR,
    ClassShare,
    CountClass,
    count_classes,
    lookup_table,
    share_legend,
)
from service.drawing.sheet import Sampling, ground_figure, hatching, lit_ground, pick, rgb
from service.parts.map_facts import dem_name
from service.products.visibility.calculate import VisibilityMap

__all__ = ["count_pixels", "count_shares", "draw_map", "write_legend", "write_overlay"]


def draw_map(finished: VisibilityMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, n_anchors = finished.parameters, len(finished.anchors)
    receiver = (
        f"receiver {parameters.receiver_above_ground_m:g} m above ground"
        if parameters.receiver_above_ground_m is not None
        else f"receiver at altitude {parameters.receiver_altitude_m:g} m"
    )
    anchors = "1 anchor" if n_anchors == 1 else f"{n_anchors} anchors"
    classes = count_classes(n_anchors)
    figure, axes = ground_figure(
        finished.grid,
        count_pixels(finished, classes),
        finished.anchors,
        f"{_what(finished)}: {dem_name(finished.grid)}",
        f"{anchors}, {receiver}, mode {parameters.mode}",
    )
    _legend(axes, finished, classes)
    return figure


def count_pixels(finished: VisibilityMap, classes: tuple[CountClass, ...]) -> npt.NDArray[np.uint8]:
    """(rows, cols, 3) picture: count colours darkened by relief, grey and hatched where unknown."""
    grid = finished.grid
    sampling = Sampling.of(grid.shape)
    count, unknown = pick(finished.count, sampling), pick(finished.unknown_count, sampling)
    light, no_ground = lit_ground(grid, sampling)
    colour = lookup_table(classes)[count] * light[..., None]
    nothing_sure = (count == 0) & (unknown > 0)
    colour[nothing_sure] = rgb(UNKNOWN_COLOUR)
    hatched = hatching(count.shape) & (unknown > 0) & ~no_ground
    colour[hatched] *= 0.72
    colour[no_ground & nothing_sure] = rgb(NO_GROUND_COLOUR)
    return np.asarray(np.rint(colour * 255.0), np.uint8)


def count_shares(finished: VisibilityMap, classes: tuple[CountClass, ...]) -> list[ClassShare]:
    """Classes, most anchors first, with their posts as the tables have them; what is unknown; what is no ground."""
    heights_m, undecided = finished.grid.heights_m, finished.undecided
    posts = np.bincount(finished.count[~np.isnan(heights_m)], minlength=len(finished.anchors) + 1)
    n_undecided = int(np.count_nonzero(undecided))
    posts[0] -= n_undecided
    rows = [ClassShare(c.label, c.colour, int(posts[c.first : c.last + 1].sum())) for c in reversed(classes)]
    if n_undecided or bool(np.any((finished.count > 0) & (finished.unknown_count > 0))):
        rows.append(ClassShare("unknown", UNKNOWN_COLOUR, n_undecided))
    if bool(np.any(np.isnan(heights_m) & (finished.count == 0) & (finished.unknown_count > 0))):
        rows.append(ClassShare("no ground", NO_GROUND_COLOUR, None))
    return rows


def _legend(axes: Axes, finished: VisibilityMap, classes: tuple[CountClass, ...]) -> None:
    """Classes with their share of the known posts, in the margin on the right."""
    share_legend(axes, count_shares(finished, classes), _what(finished))


def write_overlay(finished: VisibilityMap, path: Path) -> None:
    """The count of anchors in sight in the colours of its classes, darkened by relief."""
    class_map.write_pixels(finished.grid, count_pixels(finished, count_classes(len(finished.anchors))), path)


def write_legend(finished: VisibilityMap, path: Path) -> None:
    """Its classes, most anchors first."""
    class_map.write_legend(_what(finished), count_shares(finished, count_classes(len(finished.anchors))), path)


def _what(finished: VisibilityMap) -> str:
    return f"Anchors {finished.parameters.in_words}"
