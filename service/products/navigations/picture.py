"""A navigated drive as pictures: the way on the map, errors and biases over time, innovations."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from navigation import Verdict
from navigation.drives import SOURCES
from service.drawing.furniture import INK
from service.drawing.sheet import Sampling, anchor_handle, ground_figure, lit_ground, margin_legend
from service.parts.map_facts import dem_name
from terrain import ElevationGrid

from .calculate import FinishedNavigation

__all__ = ["draw_errors", "draw_innovations", "draw_track"]

GROUND_RGB, UNKNOWN_RGB = (226, 221, 208), (140, 140, 140)
EAST, NORTH, UP = "#2c5f9e", "#c2452d", "#5d7a3c"
FIX_COLOUR, TRACK_COLOUR = "#e0a100", "#2c5f9e"
# of the ground beside the way, as a share of its longer side, and at least so many cells
BESIDE, LEAST_CELLS = 0.25, 12
MOST_CIRCLES, MOST_DOTS = 40, 4000
LENGTHS = ("range", "position", "ground", "pseudorange", "phase")


def draw_track(finished: FinishedNavigation) -> Figure:
    """The way over the shaded ground around it, bubbles at their true size, fixes and anchors."""
    places = finished.drive.place_m[finished.rows]
    grid = _around(finished.grid, places)
    light, unknown = lit_ground(grid, Sampling.of(grid.shape))
    pixels = (np.array(GROUND_RGB)[None, None, :] * light[..., None]).astype(np.uint8)
    pixels[unknown] = UNKNOWN_RGB
    figure, axes = ground_figure(grid, pixels, finished.anchors, f"Drive: {dem_name(grid)}", _subtitle(finished))
    handles, labels = [Line2D([], [], color=TRACK_COLOUR, lw=2.5)], ["way"]
    if len(finished.fixes_m):
        at_km = finished.fixes_m[:, :2] / 1000.0
        axes.plot(*at_km.T, ".", ms=3.0, color=FIX_COLOUR, zorder=4, scalex=False, scaley=False)
        handles.append(Line2D([], [], color=FIX_COLOUR, marker=".", lw=0.0))
        labels.append("fixes")
    turn = np.linspace(0.0, 2.0 * np.pi, 48)
    radius_m = finished.drive.track.radius_m[finished.rows]
    for point in np.unique(np.linspace(0, len(places) - 1, MOST_CIRCLES).astype(int)):
        circle = places[point, :2, None] + radius_m[point] * np.stack([np.cos(turn), np.sin(turn)])
        axes.plot(*(circle / 1000.0), color=INK, lw=0.5, alpha=0.5, zorder=5, scalex=False, scaley=False)
    axes.plot(*(places[:, :2] / 1000.0).T, color="white", lw=3.5, zorder=5, scalex=False, scaley=False)
    axes.plot(*(places[:, :2] / 1000.0).T, color=TRACK_COLOUR, lw=1.6, zorder=6, scalex=False, scaley=False)
    handles.append(Line2D([], [], color=INK, lw=0.5))
    labels.append(f"bubble of {finished.answer.epsilon:g} sigma")
    if finished.anchors:
        handles.append(anchor_handle())
        labels.append("anchor")
    margin_legend(axes, handles, labels, "Drive")
    return figure


def draw_errors(finished: FinishedNavigation) -> Figure:
    """Sigmas of place, velocity and attitude, and the biases found with their sigmas, over time."""
    figure = Figure(figsize=(10.0, 10.0), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(5, 1, sharex=True)
    track, rows = finished.drive.track, finished.rows
    time_s, filtered, step = track.times_s[rows], track.filtered, track.reading[rows]
    for place, (name, factor) in enumerate((("place, m", 1.0), ("velocity, m/s", 1.0), ("attitude, °", 57.29578))):
        for axis, (label, colour) in enumerate((("east", EAST), ("north", NORTH), ("up", UP))):
            axes[place].plot(time_s, factor * track.sigmas[rows, 3 * place + axis], color=colour, lw=1.3, label=label)
        axes[place].set_ylabel(f"sigma of\n{name}")
        axes[place].set_ylim(bottom=0.0)
    axes[2].legend(title="about", loc="upper right", ncols=3, fontsize=8)
    axes[0].legend(loc="upper right", ncols=3, fontsize=8)
    of_bias = ((filtered.force_bias_m_per_s2, 1000.0, 9), (np.degrees(filtered.rate_bias_rad_per_s), 1.0, 12))
    for place, ((values, factor, state), name) in enumerate(
        zip(of_bias, ("force bias,\nmm/s²", "rate bias,\n°/s"), strict=True)
    ):
        for axis, (label, colour) in enumerate((("forward", EAST), ("left", NORTH), ("up", UP))):
            found = factor * values[step, axis]
            sigma = filtered.sigmas[step, state + axis] * (factor if place == 0 else 57.29578)
            axes[3 + place].plot(time_s, found, color=colour, lw=1.3, label=label)
            axes[3 + place].fill_between(time_s, found - sigma, found + sigma, color=colour, alpha=0.15, lw=0.0)
        axes[3 + place].set_ylabel(name)
    axes[3].legend(loc="upper right", ncols=3, fontsize=8)
    _finish(axes, f"Errors and biases: {dem_name(finished.grid)}\n{_subtitle(finished)}")
    return figure


def draw_innovations(finished: FinishedNavigation) -> Figure:
    """Measured less foretold over time for each kind of measurement, and three sigmas of it."""
    track = finished.drive.track
    kinds = [number for number in range(len(SOURCES)) if (track.measurements.source == number).any()]
    figure = Figure(figsize=(10.0, 1.2 + 2.0 * len(kinds)), facecolor="white", layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    used = {one.source: f"{one.used:,} of {one.measurements:,} used" for one in finished.answer.sources}
    for axis, kind in zip(axes, kinds, strict=True):
        axis.set_title(used[SOURCES[kind]], loc="right", fontsize=8)
        mine = np.flatnonzero((track.measurements.source == kind) & np.isfinite(track.filtered.innovation))
        mine = mine[:: max(len(mine) // MOST_DOTS, 1)]
        time_s, sigma = track.measurements.times_s[mine], np.sqrt(track.filtered.innovation_variance[mine])
        innovation, gated = track.filtered.innovation[mine], track.filtered.verdict[mine] == Verdict.GATED
        axis.plot(time_s, 3.0 * sigma, ".", color=INK, ms=1.0, alpha=0.5)
        axis.plot(time_s, -3.0 * sigma, ".", color=INK, ms=1.0, alpha=0.5)
        axis.plot(time_s[~gated], innovation[~gated], ".", color=EAST, ms=2.5, label="used")
        if gated.any():
            axis.plot(time_s[gated], innovation[gated], "x", color=NORTH, ms=4.0, label="not believed")
            axis.legend(loc="upper right", fontsize=8)
        reach = 8.0 * float(np.median(sigma)) if len(sigma) else 1.0
        low, high = axis.get_ylim()
        axis.set_ylim(max(low, -reach), min(high, reach))
        axis.set_ylabel(f"{SOURCES[kind]},\n{'m' if SOURCES[kind] in LENGTHS else 'm/s'}")
    _finish(axes, f"Innovations: {dem_name(finished.grid)}\nmeasured less foretold, with three sigmas")
    return figure


def _finish(axes: npt.NDArray[np.object_], title: str) -> None:
    one: Axes
    for one in axes:
        one.grid(alpha=0.25)
        one.margins(x=0.0)
    axes[0].set_title(title, loc="left", fontsize=11)
    axes[-1].set_xlabel("time, s")


def _around(grid: ElevationGrid, places: npt.NDArray[np.float64]) -> ElevationGrid:
    """The part of the ground around a way; all of it where the way leaves it."""
    (west, south), (east, north) = places[:, :2].min(axis=0), places[:, :2].max(axis=0)
    beside = BESIDE * max(east - west, north - south) + LEAST_CELLS * max(grid.cell_east_m, grid.cell_north_m)
    top, left = grid.post_at(float(west - beside), float(north + beside))
    bottom, right = grid.post_at(float(east + beside), float(south - beside))
    rows = int(np.clip(np.floor(top), 0, grid.rows - 1)), int(np.clip(np.ceil(bottom), 0, grid.rows - 1))
    cols = int(np.clip(np.floor(left), 0, grid.cols - 1)), int(np.clip(np.ceil(right), 0, grid.cols - 1))
    if rows[1] - rows[0] < 2 or cols[1] - cols[0] < 2:
        return grid
    return grid.window(rows[0], rows[1], cols[0], cols[1])


def _subtitle(finished: FinishedNavigation) -> str:
    answer = finished.answer
    told = "smoothed" if answer.smoothed else "filtered"
    radius = answer.radius_quantiles_m
    return (
        f"{answer.way_m:,.0f} m in {answer.to_s - answer.from_s:,.0f} s, {told}; radius of the bubble "
        f"{radius['p05']:.2g} to {radius['p95']:.2g} m"
    )
