"""A repositioning as a picture: the path with what holds along it, and who flies where."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from service.drawing.class_map import MapClass, class_pixels
from service.drawing.furniture import INK
from service.drawing.sheet import anchor_handle, ground_figure, margin_legend
from service.parts.map_facts import dem_name
from visibility import Anchor

from .calculate import FinishedRepositioning

__all__ = ["draw_repositioning"]

GROUND = MapClass("ground", "#d8d2c4")
# (good before, good after): words and colour
STATES = {
    (1, 1): ("stays good", "#2c5f9e"),
    (0, 1): ("restored", "#2e9e4f"),
    (0, 0): ("not restored", "#d9480f"),
    (1, 0): ("given up", "#8a2f8f"),
}
MOVED = "#b3005e"


def draw_repositioning(finished: FinishedRepositioning) -> Figure:
    """The figure, with one Axes in kilometres of the grid's frame."""
    grid, answer = finished.grid, finished.answer
    after = tuple(Anchor(a.id, a.east_m, a.north_m, a.altitude_m) for a in answer.anchors)
    moves = len(answer.moves)
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, np.zeros(grid.shape, np.uint8), [GROUND]),
        after,
        f"Repositioning: {dem_name(grid)}",
        f"{moves} move{'' if moves == 1 else 's'}; {answer.goal}: {answer.before_share:.1%} of the path before, "
        f"{answer.after_share:.1%} after",
    )
    handles = _path(axes, finished) + _moves(axes, finished)
    handles.append(("anchor", anchor_handle()))
    margin_legend(axes, [handle for _, handle in handles], [label for label, _ in handles], "Along the path")
    return figure


def _path(axes: Axes, finished: FinishedRepositioning) -> list[tuple[str, Line2D]]:
    """The path in the colours of its states, and their share of its points."""
    east_km, north_km = finished.point_m[:, 0] / 1000.0, finished.point_m[:, 1] / 1000.0
    axes.plot(east_km, north_km, color="white", lw=7.0, solid_capstyle="round", zorder=6)
    handles = []
    for (before, after), (label, colour) in STATES.items():
        which = (finished.good[:, 0] == before) & (finished.good[:, 1] == after)
        if which.any():
            axes.plot(
                np.where(which, east_km, np.nan), np.where(which, north_km, np.nan),
                color=colour, lw=4.0, solid_capstyle="butt", marker=".", ms=4.0, zorder=7,
            )  # fmt: skip
            handles.append((f"{label:<12} {100.0 * which.mean():5.1f} %", Line2D([], [], color=colour, lw=4.0)))
    return handles


def _moves(axes: Axes, finished: FinishedRepositioning) -> list[tuple[str, Line2D]]:
    """An arrow per move, from a hollow triangle."""
    if not finished.answer.moves:
        return []
    for move in finished.answer.moves:
        start, end = (np.array([at.east_m, at.north_m]) / 1000.0 for at in (move.from_, move.to))
        axes.plot(*start, marker="^", ms=9, mfc="white", mec=INK, mew=1.2, ls="none", zorder=8)
        arrow = {"arrowstyle": "-|>", "color": MOVED, "lw": 1.8, "shrinkA": 5, "shrinkB": 6}
        axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow, zorder=9)
    stood = Line2D([], [], marker="^", ms=9, mfc="white", mec=INK, mew=1.2, ls="none")
    return [("stood here before", stood), ("move", Line2D([], [], color=MOVED, lw=1.8))]
