"""A planned flight: from above over the relief, and from the side between ground, morphing map and ceiling."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import Normal, Stroke

from planning.bubbles import way_m
from planning.words import time_words
from service.drawing.class_map import MapClass, class_pixels
from service.drawing.cover import draw_cover_along
from service.drawing.furniture import INK
from service.drawing.sheet import DPI, ground_figure, margin_legend
from service.parts.map_facts import dem_name
from service.products.flights.calculate import FinishedFlight

__all__ = ["draw_flight", "draw_flight_profile"]

GROUND = MapClass("ground", "#d8d2c4")
WAY_COLOUR, GROUND_COLOUR, FLOOR_COLOUR, CLEAR_COLOUR = "#e6007e", "#b9a98a", "#2b7bba", "#3a7d44"
LIMIT_COLOUR = "#c01818"
SIZE_IN = (11.0, 6.0)


def draw_flight(finished: FinishedFlight) -> Figure:
    """The figure, with one Axes in kilometres of the grid's frame."""
    grid, answer = finished.grid, finished.answer
    figure, axes = ground_figure(
        grid,
        class_pixels(grid, np.zeros(grid.shape, np.uint8), [GROUND]),
        (),
        f"Flight, {answer.status.replace('_', ' ')}: {dem_name(grid)}",
        _subtitle(finished),
    )
    handles: list[tuple[str, Line2D]] = []
    if finished.found:
        halo = [Stroke(linewidth=4.4, foreground="white"), Normal()]
        east_km, north_km = finished.corners_m[:, 0] / 1000.0, finished.corners_m[:, 1] / 1000.0
        axes.plot(east_km, north_km, color=WAY_COLOUR, lw=2.6, zorder=8, path_effects=halo)
        axes.plot(east_km[1:-1], north_km[1:-1], "o", color=WAY_COLOUR, ms=4, zorder=9)
        handles.append(("flight", Line2D([], [], color=WAY_COLOUR, lw=2.6)))
    for what, place, marker, size in (("start", answer.start, "o", 8), ("goal", answer.goal, "*", 15)):
        at_km = ([place.east_m / 1000.0], [place.north_m / 1000.0])
        (mark,) = axes.plot(*at_km, marker=marker, ms=size, mfc="white", mec=INK, mew=1.4, ls="none", zorder=11)
        handles.append((what, mark))
    margin_legend(axes, [handle for _, handle in handles], [label for label, _ in handles], "Flight")
    return figure


def draw_flight_profile(finished: FinishedFlight) -> Figure:
    """Two panels over the kilometres flown: altitudes, and the distance to the ground."""
    figure = Figure(figsize=SIZE_IN, dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    high, low = figure.subplots(2, 1, sharex=True, gridspec_kw={"height_ratios": (2, 1), "hspace": 0.16, "top": 0.86})
    x = finished.column("distance_m") / 1000.0
    up_m, ground_m = finished.column("altitude_m"), finished.column("ground_m")
    bottom_m = float(np.nanmin(ground_m)) - 0.06 * float(np.ptp([np.nanmin(ground_m), up_m.max()]) + 1.0)
    high.fill_between(x, ground_m, bottom_m, color=GROUND_COLOUR, lw=0, label="ground")
    draw_cover_along(high, x, finished.grid, _flown_over(finished), ground_m)
    floor_m, top_m = finished.column("floor_m"), finished.column("top_m")
    if np.isfinite(floor_m).any():
        high.fill_between(x, floor_m, ground_m, color=FLOOR_COLOUR, alpha=0.16, lw=0)
        high.plot(x, floor_m, color=FLOOR_COLOUR, lw=1.2, label="morphing map")
    if np.isfinite(top_m).any():
        high.plot(x, np.where(np.isfinite(top_m), top_m, np.nan), label="ceiling", color=LIMIT_COLOUR, lw=1.1, ls="--")
    high.plot(x, up_m, color=WAY_COLOUR, lw=2.0, label="flight")
    high.set_ylim(bottom=bottom_m)
    high.set_ylabel("altitude, m")
    low.plot(x, finished.column("clearance_m"), color=CLEAR_COLOUR, lw=1.3, label="to the ground")
    low.axhline(finished.parameters.bubble_m, label="bubble", color=LIMIT_COLOUR, lw=1.1, ls="--")
    low.set_ylim(bottom=0.0)
    low.set_ylabel("distance, m")
    low.set_xlabel("flown, km")
    for axes in (high, low):
        axes.grid(color="#e2e2e2", lw=0.6)
        axes.set_axisbelow(True)
        axes.set_xlim(0.0, x[-1])
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=6, frameon=False, fontsize=8.5)
    figure.text(0.125, 0.955, f"Along the flight: {dem_name(finished.grid)}", fontsize=14, fontweight="bold", color=INK)
    figure.text(0.125, 0.92, finished.answer.sentence, fontsize=10, color=INK)
    return figure


def _flown_over(finished: FinishedFlight) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """East and north, (n,) each, of the places along the flight."""
    along_m = way_m(finished.corners_m)
    at_m = finished.column("distance_m")
    return np.interp(at_m, along_m, finished.corners_m[:, 0]), np.interp(at_m, along_m, finished.corners_m[:, 1])


def _subtitle(finished: FinishedFlight) -> str:
    totals = finished.answer.totals
    if totals is None:
        return finished.answer.sentence[:150]
    words = [
        f"{totals.length_m / 1000.0:.2f} km",
        f"{totals.climb_m:.0f} m up",
        time_words(totals.time_s),
        f"{totals.clearance_m:.0f} m and more from the ground",
    ]
    if totals.margin_m is not None:
        words.append(f"{totals.margin_m:.0f} m and more above the morphing map")
    return ", ".join(words)
