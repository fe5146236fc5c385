"""Verdicts over time: a lane per anchor, and under them what a planner may make of each epoch."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from detection import PlanningStatus, Sight
from service.drawing.furniture import INK
from service.drawing.sheet import DPI, save_png
from service.live.replay import Replay
from service.parts.sentences import counted

__all__ = ["draw_verdicts", "write_verdict_picture"]

# told apart without colour too: by shape and by height in the lane
MARKS = {
    Sight.CLEAR: ("#2b7bba", "|", 7.0, 0.0),
    Sight.UNKNOWN: ("#8c8c8c", ".", 4.0, -0.18),
    Sight.OCCLUDED: ("#d1410c", "v", 5.5, 0.2),
    Sight.TOO_SHORT: ("#7a3e9d", "^", 5.5, 0.2),
}
STATUS_COLOURS = {
    PlanningStatus.CHECKED: "#2b7bba",
    PlanningStatus.DEGRADED: "#f0a202",
    PlanningStatus.UNCHECKED: "#8c8c8c",
    PlanningStatus.NO_POSITION: "#1a1a1a",
}
WIDTH_IN, LANE_IN, HEAD_IN, FOOT_IN = 11.0, 0.42, 0.95, 0.6
# More lanes than these would not be read.
MOST_LANES = 32


def draw_verdicts(replayed: Replay, title: str) -> Figure:
    """A figure of the whole log."""
    ids = [anchor.id for anchor in replayed.anchors][:MOST_LANES]
    height_in = HEAD_IN + FOOT_IN + LANE_IN * (len(ids) + 1)
    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.1, FOOT_IN / height_in, 0.72, LANE_IN * (len(ids) + 1) / height_in))
    lanes = {anchor_id: len(ids) - number for number, anchor_id in enumerate(ids)}
    for sight, (colour, marker, size, raised) in MARKS.items():
        places = [
            (result.time_s, lanes[verdict.anchor_id] + raised)
            for result in replayed.results
            for verdict in result.verdicts
            if verdict.sight is sight and verdict.anchor_id in lanes
        ]
        if places:
            axes.plot(*np.array(places).T, marker=marker, ms=size, color=colour, ls="none", mew=1.0)
    _draw_status(axes, replayed)
    axes.set_yticks([0, *lanes.values()], ["position", *(_short(anchor_id) for anchor_id in lanes)])
    axes.set_ylim(-0.5, len(ids) + 0.5)
    axes.set_xlabel("time, s")
    axes.margins(x=0.01)
    axes.grid(axis="x", color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    axes.axhline(0.5, color=INK, lw=0.8)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.text(0.1, 1 - 0.2 / height_in, title, fontsize=14, fontweight="bold", va="top", color=INK)
    figure.text(0.1, 1 - 0.5 / height_in, _subtitle(replayed), fontsize=10, va="top", color=INK)
    _legend(axes)
    return figure


def write_verdict_picture(replayed: Replay, title: str, path: Path) -> None:
    """The same as PNG."""
    save_png(draw_verdicts(replayed, title), path)


def _draw_status(axes: Axes, replayed: Replay) -> None:
    for status, colour in STATUS_COLOURS.items():
        times_s = [r.time_s for r in replayed.results if r.rejection is None and r.planning is status]
        if times_s:
            axes.plot(times_s, np.zeros(len(times_s)), marker="|", ms=11, mew=1.4, color=colour, ls="none")


def _legend(axes: Axes) -> None:
    handles = [Line2D([], [], color="none")]
    labels = ["anchors"]
    for sight, (colour, marker, size, _) in MARKS.items():
        handles.append(Line2D([], [], marker=marker, ms=size + 1, color=colour, ls="none"))
        labels.append(str(sight))
    handles.append(Line2D([], [], color="none"))
    labels.append("position")
    for status, colour in STATUS_COLOURS.items():
        handles.append(Line2D([], [], marker="|", ms=11, mew=2.5, color=colour, ls="none"))
        labels.append(str(status))
    legend = axes.legend(handles, labels, loc="upper left", bbox_to_anchor=(1.01, 1.02), frameon=False, fontsize=9.5)
    for text in legend.get_texts():
        if text.get_text() in ("anchors", "position"):
            text.set_fontweight("bold")


def _subtitle(replayed: Replay) -> str:
    used = sum(result.rejection is None for result in replayed.results)
    verdicts = [verdict for result in replayed.results for verdict in result.verdicts]
    occluded, short = (sum(v.sight is sight for v in verdicts) for sight in (Sight.OCCLUDED, Sight.TOO_SHORT))
    left_out = len(replayed.anchors) - MOST_LANES
    more = f"; {counted(left_out, 'more anchor')} not drawn" if left_out > 0 else ""
    too_short = f", {short:,} too short" if short else ""
    epochs, ranges = counted(used, "epoch"), counted(len(verdicts), "range")
    return f"{epochs}, {ranges}, {occluded:,} of them occluded{too_short}{more}"


def _short(anchor_id: str) -> str:
    return anchor_id if len(anchor_id) <= 12 else f"{anchor_id[:11]}…"
