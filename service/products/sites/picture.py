"""The map of sites as a picture: how much of the target ground each post sees."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from service.drawing import class_map
from service.drawing.class_map import UNDECIDED, MapClass, class_legend, class_pixels, class_shares
from service.drawing.sheet import ground_figure
from service.parts.map_facts import dem_name
from visibility import Anchor

from .calculate import FinishedSiteMap

__all__ = ["draw_sites", "write_legend", "write_overlay"]

# of the most that any post sees: the best tenth of it is what a planner looks for
EDGES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0)
COLOURS = ("#3b1c4a", "#4a4a8c", "#2f7f8e", "#3fae76", "#a5d24a", "#fde725")
TITLE = "Target ground seen from each post"


def draw_sites(finished: FinishedSiteMap) -> Figure:
    """The map as a figure with one Axes in kilometres of the grid's frame."""
    parameters, grid = finished.parameters, finished.grid
    numbers, classes = _classes(finished)
    reach = "" if parameters.max_range_m is None else f", within {parameters.max_range_m:g} m"
    sites = [Anchor(site.id, site.east_m, site.north_m, site.altitude_m) for site in finished.answer.sites]
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, numbers, classes),
        sites,
        f"Sites: {dem_name(grid)}",
        f"sites {parameters.site_above_ground_m:g} m, receivers {parameters.receiver_above_ground_m:g} m above "
        f"ground{reach}",
    )
    class_legend(axes, grid, numbers, classes, TITLE, marked="site")
    return figure


def write_overlay(finished: FinishedSiteMap, path: Path) -> None:
    """The share in the colours of its classes, darkened by relief."""
    class_map.write_pixels(finished.grid, class_pixels(finished.grid, *_classes(finished)), path)


def write_legend(finished: FinishedSiteMap, path: Path) -> None:
    """Its classes, least first."""
    class_map.write_legend(TITLE, class_shares(finished.grid, *_classes(finished)), path)


def _classes(finished: FinishedSiteMap) -> tuple[npt.NDArray[np.uint8], list[MapClass]]:
    """The class number of each post, and classes up to the most that one sees."""
    most = max(float(np.nanmax(finished.seen, initial=0.0)), 1e-6)
    edges = [most * edge for edge in EDGES]
    labels = [f"{100.0 * low:.3g}–{100.0 * high:.3g} %" for low, high in pairwise(edges)]
    classes = [MapClass(label, colour) for label, colour in zip(labels, COLOURS, strict=True)]
    numbers = np.digitize(finished.seen, np.array(edges[1:-1], np.float32)).astype(np.uint8)
    numbers[np.isnan(finished.seen)] = UNDECIDED
    return numbers, classes
