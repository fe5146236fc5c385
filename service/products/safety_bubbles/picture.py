"""Safety bubbles as pictures: radius against clearance along the way, and the way on the map."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from navigation import BubbleVerdict
from service.drawing.cover import draw_cover_along
from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, anchor_handle, ground_figure, lit_ground, margin_legend
from service.parts.map_facts import dem_name
from service.products.safety_bubbles.calculate import FinishedBubbles
from terrain import height_at

__all__ = ["draw_bubble_map", "draw_bubble_profile"]

GROUND_RGB = (226, 221, 208)
UNKNOWN_RGB = (140, 140, 140)
RADIUS_COLOUR, CLEARANCE_COLOUR, COUNT_COLOUR = "#c2452d", "#2c5f9e", "#5d7a3c"
VERDICTS = {
    BubbleVerdict.OK: ("clear", "#2c5f9e"),
    BubbleVerdict.UNKNOWN: ("near unknown", "#e0a100"),
    BubbleVerdict.VIOLATED: ("violated", "#c2452d"),
}
GROUND_COLOUR = "#b9a98a"
GROUND_PLACES = 800  # at which the ground under the way is looked at, beside its points
# More bubbles than these would be a tube.
MOST_CIRCLES = 60
# Where the radius is so many times the clearance, a linear axis would press the clearance flat.
TOO_TALL = 5.0


def draw_bubble_profile(finished: FinishedBubbles) -> Figure:
    """Over the way: radius and clearance, violated stretches shaded; the bubble over ground, roofs and trees; how many
    anchors are in sight."""
    rows = 2 if finished.bubbles.visible is None else 3
    figure = Figure(figsize=(10.0, 3.8 + 1.6 * (rows - 1)), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(rows, 1, sharex=True, gridspec_kw={"height_ratios": [3.0, 1.8, 1.2][:rows]})
    way_m = finished.distance_m
    _shade(axes[0], way_m, finished.bubbles.check.verdict)
    axes[0].plot(way_m, finished.bubbles.around.distance_m, color=CLEARANCE_COLOUR, lw=1.6, label="clearance d")
    axes[0].plot(way_m, finished.bubbles.radius_m, color=RADIUS_COLOUR, lw=1.6, label="bubble radius r")
    axes[0].set_ylabel("metres")
    if finished.bubbles.radius_m.max() > TOO_TALL * max(float(finished.bubbles.around.distance_m.max()), 1.0):
        axes[0].set_yscale("symlog", linthresh=10.0)
        axes[0].yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes[0].set_ylabel("metres, logarithmic over 10")
    axes[0].set_ylim(bottom=min(0.0, float(finished.bubbles.around.distance_m.min())))
    axes[0].legend(loc="best", frameon=True, framealpha=0.9)
    axes[0].set_title(f"Safety bubble: {dem_name(finished.grid)}\n{_subtitle(finished)}", loc="left", fontsize=11)
    _draw_altitudes(axes[1], finished)
    if finished.bubbles.visible is not None:
        axes[2].step(way_m, finished.bubbles.visible.sum(axis=1), where="mid", color=COUNT_COLOUR, lw=1.4)
        axes[2].set_ylabel(f"anchors\n{finished.parameters.in_words}")
        axes[2].set_ylim(-0.3, finished.bubbles.visible.shape[1] + 0.3)
        axes[2].yaxis.get_major_locator().set_params(integer=True)
    axes[-1].set_xlabel("way, m")
    for axis in axes:
        axis.grid(alpha=0.25)
        axis.margins(x=0.0)
    return figure


def draw_bubble_map(finished: FinishedBubbles) -> Figure:
    """The way over the shaded ground, coloured by verdict, with bubbles at their true size and anchors."""
    grid = finished.grid
    light, unknown = lit_ground(grid, Sampling.of(grid.shape))
    pixels = (np.array(GROUND_RGB)[None, None, :] * light[..., None]).astype(np.uint8)
    pixels[unknown] = UNKNOWN_RGB
    figure, axes = ground_figure(
        grid, pixels, finished.anchors, f"Safety bubble: {dem_name(grid)}", _subtitle(finished)
    )
    east_km, north_km = finished.points_m[:, 0] / 1000.0, finished.points_m[:, 1] / 1000.0
    axes.plot(east_km, north_km, color="white", lw=4.0, zorder=5, solid_capstyle="round")
    axes.plot(east_km, north_km, color=INK, lw=0.6, zorder=5)
    turn = np.linspace(0.0, 2.0 * np.pi, 48)
    for point in np.unique(np.linspace(0, len(east_km) - 1, MOST_CIRCLES).astype(int)):
        colour = VERDICTS[BubbleVerdict(int(finished.bubbles.check.verdict[point]))][1]
        radius_km = finished.bubbles.radius_m[point] / 1000.0
        axes.plot(
            east_km[point] + radius_km * np.cos(turn),
            north_km[point] + radius_km * np.sin(turn),
            color=colour,
            lw=0.8,
            alpha=0.8,
            zorder=6,
            scalex=False,
            scaley=False,
        )
    handles, labels = [], []
    for verdict, (label, colour) in VERDICTS.items():
        here = finished.bubbles.check.verdict == verdict
        if here.any():
            axes.plot(east_km[here], north_km[here], ".", ms=3.5, color=colour, zorder=7)
            handles.append(Line2D([], [], color=colour, lw=3.0))
            labels.append(f"{label:<15}{100.0 * here.mean():3.0f} %")
    handles.append(anchor_handle())
    labels.append("anchor")
    margin_legend(axes, handles, labels, "Bubble")
    return figure


def _draw_altitudes(axes: Axes, finished: FinishedBubbles) -> None:
    """The way in its bubble, over the ground and what stands on it; a bubble that is larger than all that is cut."""
    grid, way_m = finished.grid, finished.distance_m
    at_m = np.union1d(way_m, np.linspace(0.0, way_m[-1], GROUND_PLACES))
    east_m, north_m, up_m = (np.interp(at_m, way_m, finished.points_m[:, axis]) for axis in range(3))
    ground_m = np.asarray(height_at(grid, east_m, north_m), np.float64)
    bottom_m = float(min(np.nanmin(ground_m, initial=np.inf), up_m.min()))
    room_m = 0.08 * (float(max(np.nanmax(ground_m, initial=-np.inf), up_m.max())) - bottom_m) + 1.0
    axes.fill_between(at_m, ground_m, bottom_m - room_m, color=GROUND_COLOUR, lw=0, label="ground")
    draw_cover_along(axes, at_m, grid, (east_m, north_m), ground_m)
    axes.plot(at_m, up_m, color=INK, lw=1.2, label="way")
    axes.set_ylim(bottom=bottom_m - room_m)
    low_m, high_m = axes.get_ylim()
    radius_m = np.interp(at_m, way_m, finished.bubbles.radius_m)
    axes.fill_between(at_m, up_m - radius_m, up_m + radius_m, color=RADIUS_COLOUR, alpha=0.25, lw=0, label="bubble")
    axes.set_ylim(low_m, high_m)
    axes.set_ylabel("altitude, m")
    axes.legend(loc="best", frameon=True, framealpha=0.9, ncols=5, fontsize=8.5)


def _subtitle(finished: FinishedBubbles) -> str:
    check, parameters = finished.bubbles.check, finished.parameters
    dem = f" + {parameters.dem_sigma_m:g} m of the DEM" if parameters.dem_sigma_m else ""
    violated = check.count(BubbleVerdict.VIOLATED)
    share = "nowhere violated" if violated == 0 else f"violated at {violated:,} of {len(check.verdict):,} points"
    return f"r = {parameters.epsilon:g}·√(trace P){dem}; {share}; radius {_span(finished.bubbles.radius_m)} m"


def _span(values: npt.NDArray[np.float64]) -> str:
    return f"{values.min():.1f} to {values.max():.1f}"


def _shade(axes: Axes, way_m: npt.NDArray[np.float64], verdict: npt.NDArray[np.uint8]) -> None:
    """Stretches that are violated or unknown, behind the curves."""
    for kind in (BubbleVerdict.VIOLATED, BubbleVerdict.UNKNOWN):
        axes.fill_between(
            way_m, 0.0, 1.0, where=verdict == kind, transform=axes.get_xaxis_transform(), step="mid",
            color=VERDICTS[kind][1], alpha=0.18, lw=0.0, label=VERDICTS[kind][0] if (verdict == kind).any() else None,
        )  # fmt: skip
