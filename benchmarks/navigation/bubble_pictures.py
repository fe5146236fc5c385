"""Figures 11 to 13 of De Vivo et al. on the ground at hand: ``-m benchmarks.navigation.bubble_pictures FOLDER``."""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

import navigation
from benchmarks.navigation.bubble_case import Case
from benchmarks.navigation.bubble_filters import EPSILON, Tracks
from benchmarks.navigation.bubbles import SEED, flown
from benchmarks.navigation.urban_canyon import Canyon, canyon, drive, within

__all__ = ["draw"]

AXES = ("east", "north", "up")
COLOURS = ("#2c5f9e", "#c2452d", "#5d7a3c")
SHOWN_FLIGHTS = 5


def draw(folder: Path) -> list[Path]:
    """Both figures as PNG, from a few flights."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for kind in ("satellites", "drones"):
        case, (proposed, weak, _) = flown(kind, count=SHOWN_FLIGHTS)
        for name, figure in (
            ("errors", _errors(case, weak, proposed, kind)),
            ("bubbles", _bubbles(case, weak, proposed, kind)),
        ):
            written.append(folder / f"bubble-{kind}-{name}.png")
            figure.savefig(written[-1], dpi=100)
    written.append(folder / "bubble-streets.png")
    _streets(canyon()).savefig(written[-1], dpi=100)
    return written


def _streets(case: Canyon) -> matplotlib.figure.Figure:
    """One drive round the block seen from above, its error against its bubble, and how many satellites are in sight."""
    drives = drive(case, "geometry", 1, SEED)
    figure = matplotlib.figure.Figure(figsize=(12.0, 5.6), layout="constrained")
    places: dict[str, Axes] = figure.subplot_mosaic([["map", "error"], ["map", "count"]], height_ratios=[2.0, 1.0])
    grid, middle = case.grid, case.points_m[:, :2].mean(axis=0)
    west_m, south_m, east_m, north_m = grid.bounds_m
    edges = (west_m - middle[0], east_m - middle[0], south_m - middle[1], north_m - middle[1])
    places["map"].imshow(grid.heights_m, extent=edges, cmap="Greys", vmin=0.0, vmax=60.0)
    fixed, estimate_m = drives.has_fix[0], case.points_m + drives.error_m[0] - [*middle, 0.0]
    places["map"].plot(*(case.points_m[:, :2] - middle).T, color="#2c5f9e", lw=2.0, label="truth")
    places["map"].plot(*estimate_m[:, :2].T, color="#c2452d", lw=1.0, label="estimate")
    places["map"].plot(*estimate_m[fixed, :2].T, ".", color="#5d7a3c", ms=4.0, label="estimate with a fix")
    places["map"].set(xlabel="east, m", ylabel="north, m", title="A block and buildings of 30 m (grey)")
    places["map"].legend(loc="lower left", framealpha=0.9)
    radius_m = navigation.radius_of_confidence(drives.covariance_m2[0], within(2.0))
    places["error"].plot(radius_m, color="black", lw=1.2, label="sphere of 95.4 %")
    places["error"].plot(drives.distance_m[0], color="#c2452d", lw=1.0, label="total error")
    places["error"].set(yscale="log", ylabel="metres")
    places["error"].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2)
    places["count"].plot(case.in_sight.sum(axis=1), color="#2c5f9e", lw=1.0)
    places["count"].axhline(4.0, color="black", lw=0.7)
    places["count"].set(xlabel="time, s", ylabel="in sight")
    for name in ("error", "count"):
        places[name].grid(alpha=0.25)
        places[name].margins(x=0.0)
    return figure


def _errors(case: Case, weak: Tracks, proposed: Tracks, kind: str) -> matplotlib.figure.Figure:
    """Error of each coordinate of one flight within its 3-sigma band (figure 11)."""
    figure = matplotlib.figure.Figure(figsize=(11.0, 6.4), layout="constrained")
    panels = figure.subplots(2, 1, sharex=True)
    for axes, track, name in zip(panels, (weak, proposed), ("weak", "proposed"), strict=True):
        for axis, colour in enumerate(COLOURS):
            sigma_m = np.sqrt(track.covariance_m2[0, :, axis, axis])
            axes.fill_between(case.times_s, -3.0 * sigma_m, 3.0 * sigma_m, color=colour, alpha=0.18, lw=0.0)
            axes.plot(case.times_s, track.error_m[0, :, axis], color=colour, lw=1.0, label=AXES[axis])
        radius_m = navigation.bubble_radius_m(track.covariance_m2[0], EPSILON)
        for sign in (-1.0, 1.0):
            label = "3·√(trace P)" if sign > 0.0 else None
            axes.plot(case.times_s, sign * radius_m, color="black", lw=0.9, label=label)
        axes.set_yscale("symlog", linthresh=10.0)
        axes.set_ylabel("error, m")
        axes.set_title(f"{name} solution, ranges to {kind}", loc="left", fontsize=11)
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
    figure.axes[0].legend(loc="upper right", ncols=4, framealpha=0.9)
    figure.axes[-1].set_xlabel("time, s")
    return figure


def _bubbles(case: Case, weak: Tracks, proposed: Tracks, kind: str) -> matplotlib.figure.Figure:
    """Radius against total error of one flight (figure 12), and how much more the weak solution errs (figure 13)."""
    figure = matplotlib.figure.Figure(figsize=(11.0, 8.6), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True)
    for axes, track, name in zip(panels[:2], (proposed, weak), ("proposed", "weak"), strict=True):
        axes.plot(case.times_s, track.radius_m[0], color="black", lw=1.2, label="bubble radius 3·√(trace P)")
        axes.plot(case.times_s, track.distance_m[0], color="#c2452d", lw=1.0, label="total error")
        axes.set_yscale("log")
        axes.set_ylabel("metres")
        inside = 100.0 * np.mean(track.distance_m[0] <= track.radius_m[0])
        title = f"{name}: the bubble holds the truth {inside:.0f} % of the time, ranges to {kind}"
        axes.set_title(title, loc="left", fontsize=11)
        axes.legend(loc="lower right", framealpha=0.9)
    worse_m = weak.distance_m[0] - proposed.distance_m[0]
    panels[2].plot(case.times_s, worse_m, color="#2c5f9e", lw=1.0)
    panels[2].axhline(0.0, color="black", lw=0.7)
    panels[2].set_yscale("symlog", linthresh=1.0)
    panels[2].set_ylabel("weak less proposed, m")
    smaller = 100.0 * np.mean(worse_m > 0.0)
    panels[2].set_title(f"the proposed error is smaller {smaller:.0f} % of the time", loc="left", fontsize=11)
    panels[2].set_xlabel("time, s")
    for axes in panels:
        axes.grid(alpha=0.25)
        axes.margins(x=0.0)
    return figure


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for path in draw(parser.parse_args().folder):
        print(path)
