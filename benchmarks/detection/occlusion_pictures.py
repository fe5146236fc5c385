"""Pictures of simulated occlusions: what is caught by excess, how soon, and one drive over real ground."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt
import scipy.stats
from matplotlib.axes import Axes
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

from benchmarks.detection.occlusion_scenarios import HARMFUL_M
from benchmarks.detection.occlusion_terrain import Place
from detection.simulation import DriveOutcome, SimulatedDrive

__all__ = ["draw_caught", "draw_drive", "draw_places", "draw_response"]

Floats = npt.NDArray[np.float64]

INK, HIDDEN = "#222222", "#d9d2c5"
COLOURS = ("#2b7bba", "#d1410c", "#3a8f5c", "#7a4fa3")
MARKERS = ("o", "s", "^", "D")
WORDS = {0: ("called clear", "#2b7bba", "|", 6.0, 0.0), 2: ("unknown", "#8c8c8c", ".", 4.0, -0.2),
         1: ("called occluded", "#d1410c", "v", 4.5, 0.22)}  # fmt: skip
SHOWN_EPOCHS = 15


def draw_caught(told: Mapping[str, Sequence[DriveOutcome]], edges_m: Floats) -> Figure:
    """Share of ranges called occluded over how much too long they are, with Wilson's 95 % intervals."""
    figure = Figure(figsize=(8.6, 4.6), facecolor="white")
    axes = figure.add_axes((0.09, 0.13, 0.87, 0.78))
    for number, (name, outcomes) in enumerate(told.items()):
        excess_m = np.concatenate([o.drive.excess_m[o.sight != 255] for o in outcomes])
        called = np.concatenate([o.sight[o.sight != 255] == 1 for o in outcomes])
        middles_m, shares, lows, highs = [], [], [], []
        for low_m, high_m in itertools.pairwise(edges_m.tolist()):
            inside = (excess_m > low_m) & (excess_m <= high_m)
            if inside.sum() < 10:
                continue
            part = int(called[inside].sum())
            low, high = scipy.stats.binomtest(part, int(inside.sum())).proportion_ci(method="wilson")
            middles_m.append(np.sqrt(low_m * high_m) * (1.0 + 0.015 * (number - 1)))
            shares.append(part / inside.sum())
            lows.append(shares[-1] - low)
            highs.append(high - shares[-1])
        axes.errorbar(
            middles_m, shares, yerr=[lows, highs], marker=MARKERS[number], ms=5, lw=1.4, capsize=2, label=name,
            color=COLOURS[number],
        )  # fmt: skip
    axes.axvline(HARMFUL_M, color=INK, lw=0.9, ls=":")
    axes.text(HARMFUL_M * 1.03, 0.03, "counts as bad from here on", fontsize=9, color=INK)
    axes.set_xscale("log")
    ticks_m = [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]
    axes.set_xticks(ticks_m, [f"{metres:g}" for metres in ticks_m])
    axes.minorticks_off()
    axes.set_xlim(edges_m[0], edges_m[-1])
    axes.set_ylim(-0.02, 1.03)
    axes.set_xlabel("how much too long the range is, m")
    axes.set_ylabel("share called occluded")
    _plain(axes)
    axes.legend(frameon=False, loc="upper left", fontsize=9.5)
    return figure


def draw_response(told: Mapping[str, Sequence[float | None]], every_s: float) -> Figure:
    """Share of the onsets that were called within so many seconds. None: not called before the occlusion ended."""
    figure = Figure(figsize=(8.6, 4.2), facecolor="white")
    axes = figure.add_axes((0.09, 0.14, 0.87, 0.78))
    at_s = every_s * np.arange(SHOWN_EPOCHS)
    for number, (name, waits_s) in enumerate(told.items()):
        known_s = np.array([wait_s for wait_s in waits_s if wait_s is not None])
        shares = [(known_s <= time_s + 1e-9).sum() / len(waits_s) for time_s in at_s]
        axes.step(at_s, shares, where="post", color=COLOURS[number], lw=1.8, label=f"{name} ({len(waits_s)} onsets)")
    axes.set_xlim(0.0, at_s[-1])
    axes.set_ylim(0.0, 1.03)
    axes.set_xlabel("seconds since the first occluded range (0: that range itself is called)")
    axes.set_ylabel("share of onsets noticed")
    _plain(axes)
    axes.legend(frameon=False, loc="lower right", fontsize=9.5)
    return figure


def draw_places(place: Place, drives: Sequence[SimulatedDrive], shown: int) -> Figure:
    """The ground with the drones, the rover's ways, and on them how many ranges are bad."""
    grid = place.ground
    rows, cols = grid.heights_m.shape
    west_m, north_m = grid.origin_east_m, grid.origin_north_m
    figure = Figure(figsize=(7.6, 6.6), facecolor="white")
    axes = figure.add_axes((0.13, 0.08, 0.73, 0.88))
    relief = LightSource(315.0, 45.0).hillshade(grid.heights_m, 1.5, grid.cell_east_m, grid.cell_north_m)
    extent = (west_m, west_m + (cols - 1) * grid.cell_east_m, north_m - (rows - 1) * grid.cell_north_m, north_m)
    axes.imshow(relief, extent=extent, cmap="gray", vmin=-0.6, vmax=1.1, interpolation="bilinear")
    points = None
    for number, drive in enumerate(drives):
        bad = (drive.excess_m > HARMFUL_M).sum(axis=1)
        east_m, on_north_m = drive.places_m[:, 0], drive.places_m[:, 1]
        points = axes.scatter(east_m, on_north_m, c=bad, cmap="YlOrRd", vmin=0, vmax=5, s=7, lw=0)
        if number == shown:
            end = (float(east_m[-1]), float(on_north_m[-1]))
            axes.annotate("drawn below", end, xytext=(6, 4), textcoords="offset points", fontsize=9)
    for anchor in place.anchors:
        axes.plot(anchor.east_m, anchor.north_m, "^", ms=9, color=COLOURS[0], mec="white")
        axes.annotate(anchor.id, (anchor.east_m, anchor.north_m), xytext=(6, 5), textcoords="offset points",
                      fontsize=9, fontweight="bold", color="white")  # fmt: skip
    reach_m = 3100.0
    axes.set_xlim(place.middle_m[0] - reach_m, place.middle_m[0] + reach_m)
    axes.set_ylim(place.middle_m[1] - reach_m, place.middle_m[1] + reach_m)
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    axes.ticklabel_format(useOffset=False, style="plain")
    if points is not None:
        bar = figure.colorbar(points, cax=figure.add_axes((0.89, 0.2, 0.025, 0.6)))
        bar.set_label(f"ranges more than {HARMFUL_M:g} m too long")
    return figure


def draw_drive(told: DriveOutcome, title: str) -> Figure:
    """A lane per drone: shaded where its range was bad, marked by what was said; the position's error below."""
    drive = told.drive
    count = len(drive.anchors)
    figure = Figure(figsize=(10.5, 0.5 * count + 2.6), facecolor="white")
    lanes = figure.add_axes((0.085, 0.33, 0.69, 0.60))
    below = figure.add_axes((0.085, 0.09, 0.69, 0.18), sharex=lanes)
    half_s = float(np.median(np.diff(drive.times_s))) / 2.0
    for k in range(count):
        lane = count - k
        bad, slight = drive.excess_m[:, k] > HARMFUL_M, (drive.excess_m[:, k] > 0.0)
        for hidden, height, colour in ((slight, 0.25, "#efeae0"), (bad, 0.42, HIDDEN)):
            lanes.fill_between(
                drive.times_s, lane - height, lane + height, where=hidden, color=colour, lw=0, step="mid"
            )
        for word, (_, colour, marker, size, raised) in WORDS.items():
            at_s = drive.times_s[told.sight[:, k] == word]
            lanes.plot(
                at_s, np.full(len(at_s), lane + raised), ls="none", marker=marker, ms=size, color=colour, mew=0.8
            )
    lanes.set_yticks([count - k for k in range(count)], [anchor.id for anchor in drive.anchors])
    lanes.set_ylim(0.4, count + 0.6)
    lanes.tick_params(labelbottom=False)
    lanes.set_title(title, loc="left", fontsize=11, fontweight="bold")
    lanes.set_xlim(drive.times_s[0] - half_s, drive.times_s[-1] + half_s)
    for word, (name, colour, marker, size, _) in WORDS.items():
        lanes.plot(
            [], [], ls="none", marker=marker, ms=size + 1.5, color=colour, label=name if word != 2 else "unknown"
        )
    lanes.fill_between([], [], color=HIDDEN, label=f"{HARMFUL_M:g} m too long or more")
    lanes.fill_between([], [], color="#efeae0", label="hidden, less too long")
    lanes.legend(frameon=False, loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=9)
    below.plot(drive.times_s, told.position_error_m, color=INK, lw=1.0)
    below.set_yscale("log")
    below.set_ylabel("position\nerror, m", fontsize=9)
    below.set_xlabel("time, s")
    _plain(lanes)
    _plain(below)
    return figure


def _plain(axes: Axes) -> None:
    axes.grid(color="#dddddd", lw=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
