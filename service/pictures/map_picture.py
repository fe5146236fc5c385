"""The quick look: count of visible anchors over shaded relief."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from service.map_facts import dem_name
from service.visibility_map import VisibilityMap

from .classes import NO_GROUND_COLOUR, UNKNOWN_COLOUR, CountClass, count_classes, lookup_table
from .furniture import INK
from .relief import Sampling, pick
from .sheet import anchor_handle, ground_figure, hatching, lit_ground, margin_legend, rgb, save_png

__all__ = ["draw_map", "write_map_picture"]


def write_map_picture(finished: VisibilityMap, path: Path) -> None:
    """Draw the map into a PNG."""
    save_png(draw_map(finished), path)


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
        _pixels(finished, classes),
        finished.anchors,
        f"Anchors in sight: {dem_name(finished.grid)}",
        f"{anchors}, {receiver}, mode {parameters.mode}",
    )
    _legend(axes, finished, classes)
    return figure


def _pixels(finished: VisibilityMap, classes: tuple[CountClass, ...]) -> npt.NDArray[np.uint8]:
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
    handles.append(anchor_handle())
    margin_legend(axes, handles, [*labels, "anchor"], "Anchors in sight,\nshare of known posts")
