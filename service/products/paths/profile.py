"""What a rover meets along its path: height and slope, anchors in sight, dilution, clearances, over the distance."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from service.drawing.cover import draw_cover_along
from service.drawing.furniture import INK
from service.drawing.sheet import DPI
from service.parts.map_facts import dem_name
from service.products.paths.answer import FinishedPath
from service.products.paths.picture import DARK_COLOUR, WAY_COLOUR

__all__ = ["draw_profile"]

WIDTH_IN, PANEL_IN, HEAD_IN, FOOT_IN = 11.0, 1.6, 0.75, 0.6
GROUND_COLOUR, SLOPE_COLOUR, COUNT_COLOUR, CLEAR_COLOUR = "#b9a98a", "#8a4b12", "#2b7bba", "#3a7d44"
LIMIT_COLOUR = "#c01818"
# larger dilutions are drawn at the top edge
HIGHEST_DOP = 20.0


def draw_profile(finished: FinishedPath) -> Figure:
    """Panels over the distance in kilometres: the ground, and what the anchors give where there are any."""
    panels: list[Callable[[Axes, FinishedPath], None]] = [_ground, _slopes]
    if finished.answer.ranged_to:
        panels += [_anchors, _margins, _dilution, _errors]
    panels.append(_clearances)
    height_in = HEAD_IN + FOOT_IN + PANEL_IN * len(panels)
    figure = Figure(figsize=(WIDTH_IN, height_in), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    axes = figure.subplots(
        len(panels),
        1,
        sharex=True,
        gridspec_kw={
            "left": 0.075,
            "right": 0.98,
            "top": 1 - HEAD_IN / height_in,
            "bottom": FOOT_IN / height_in,
            "hspace": 0.16,
        },
    )
    for panel, draw in zip(axes, panels, strict=True):
        draw(panel, finished)
        panel.grid(color="#e2e2e2", lw=0.6)
        panel.set_axisbelow(True)
        for side in ("top", "right"):
            panel.spines[side].set_visible(False)
    axes[-1].set_xlabel("distance along the ground, km")
    axes[0].set_xlim(0.0, max(_distance_km(finished)[-1], 1e-3))
    figure.align_ylabels(axes)
    figure.text(
        0.075, 1 - 0.2 / height_in, f"Along the path: {dem_name(finished.grid)}", fontsize=14, fontweight="bold",
        va="top", color=INK,
    )  # fmt: skip
    figure.text(0.075, 1 - 0.5 / height_in, finished.answer.sentence, fontsize=10, va="top", color=INK)
    return figure


def _distance_km(finished: FinishedPath) -> npt.NDArray[np.float64]:
    return finished.column("distance_m") / 1000.0


def _ground(axes: Axes, finished: FinishedPath) -> None:
    x, ground_m = _distance_km(finished), finished.column("altitude_m")
    grid = finished.grid
    places_m = finished.column("east_m"), finished.column("north_m")
    crowns_m = 0.0 if grid.trees is None else float(np.nanmax(grid.trees.top_m, initial=0.0))
    low_m, high_m = float(ground_m.min()), float(ground_m.max()) + crowns_m
    room_m = max(0.08 * (high_m - low_m), 1.0)
    axes.fill_between(x, ground_m, low_m - room_m, color=GROUND_COLOUR, lw=0)
    draw_cover_along(axes, x, grid, places_m, ground_m)
    axes.plot(x, ground_m, color=INK, lw=1.2)
    axes.set_ylim(low_m - room_m, high_m + room_m)
    axes.set_ylabel("altitude, m")


def _slopes(axes: Axes, finished: FinishedPath) -> None:
    x, rover = _distance_km(finished), finished.parameters.rover
    axes.plot(x, np.degrees(finished.column("slope_rad")), color=SLOPE_COLOUR, lw=1.0, label="slope")
    axes.plot(x, np.degrees(finished.column("pitch_rad")), color=INK, lw=0.7, label="pitch")
    _limit(axes, rover.max_slope_deg)
    axes.set_ylabel("slope, °")
    _legend(axes)


def _anchors(axes: Axes, finished: FinishedPath) -> None:
    x, count = _distance_km(finished), finished.column("anchor_count")
    needed = finished.answer.needed_in_sight
    axes.step(x, count, where="mid", color=COUNT_COLOUR, lw=1.3)
    axes.fill_between(
        x, 0, len(finished.answer.ranged_to), where=count < needed, color=DARK_COLOUR, alpha=0.16, lw=0, step="mid"
    )
    least = finished.parameters.limits.min_anchors
    if least:
        _limit(axes, least)
    axes.set_ylim(0, len(finished.answer.ranged_to) + 0.4)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel(finished.parameters.in_words)


def _margins(axes: Axes, finished: FinishedPath) -> None:
    x, margin_m = _distance_km(finished), finished.column("margin_m")
    shown_m = np.where(np.isfinite(margin_m), margin_m, np.nan)
    axes.plot(x, shown_m, color=CLEAR_COLOUR, lw=1.2)
    axes.fill_between(x, shown_m, 0.0, where=shown_m < 0.0, color=DARK_COLOUR, alpha=0.16, lw=0)
    axes.axhline(0.0, color=INK, lw=0.8)
    axes.set_ylabel("usable margin, m" if finished.parameters.usable else "sight margin, m")


def _dilution(axes: Axes, finished: FinishedPath) -> None:
    x, limits = _distance_km(finished), finished.parameters.limits
    dop = np.where(np.isnan(finished.column("dop")), np.inf, finished.column("dop"))
    axes.plot(x, np.minimum(dop, HIGHEST_DOP), color=WAY_COLOUR, lw=1.2)
    none = ~np.isfinite(dop)
    axes.fill_between(x, 0, HIGHEST_DOP, where=none, color=DARK_COLOUR, alpha=0.16, lw=0)
    top = HIGHEST_DOP if (dop > HIGHEST_DOP).any() else max(float(dop.max()), limits.dop_limit or 0.0) * 1.15
    if limits.dop_limit is not None:
        _limit(axes, limits.dop_limit)
    axes.set_ylim(0.0, max(top, 1.0))
    cut = f", up to {HIGHEST_DOP:g}" if (dop > HIGHEST_DOP).any() else ""
    axes.set_ylabel(limits.measure.upper() + cut)


def _errors(axes: Axes, finished: FinishedPath) -> None:
    axes.plot(_distance_km(finished), finished.column("position_sigma_m"), color=WAY_COLOUR, lw=1.2)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("predicted σ, m")


def _clearances(axes: Axes, finished: FinishedPath) -> None:
    x = _distance_km(finished)
    axes.plot(x, finished.column("clearance_m"), color=CLEAR_COLOUR, lw=1.2, label="to what may not be driven")
    radius_m = finished.column("bubble_radius_m")
    if np.isfinite(radius_m).any():
        axes.plot(x, radius_m, color=WAY_COLOUR, lw=1.2, label="radius of the safety bubble")
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("clearance, m")
    _legend(axes)


def _limit(axes: Axes, value: float) -> None:
    axes.axhline(value, color=LIMIT_COLOUR, lw=1.1, ls="--")


def _legend(axes: Axes) -> None:
    """Above the panel, where no curve runs."""
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, frameon=False, fontsize=8.5, borderaxespad=0.0)
