"""Pictures of the detector on real ranges: ``python -m benchmarks.detection.pictures --out docs/images/detection``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from benchmarks.detection.measured_ranges import RangeLog, starloc, starloc_sequences
from benchmarks.detection.proof import ASKED, BAD_M, TOLERANCE_M
from benchmarks.detection.ranking import curve
from benchmarks.detection.replays import Replay, geometric_step, plain_fit, pooled, session
from benchmarks.visibility.paper import write_png

__all__ = ["draw_curves", "draw_frames", "draw_positions", "main"]

INK, GRID, WRONG = "#222222", "#d8d8d8", "#efe6d2"
COLOURS = ("#8c8c8c", "#2b7bba", "#d1410c")


def draw_curves(told: Mapping[str, Replay]) -> Figure:
    """Bad ranges caught over false alarms (logarithmic), of every way of judging, with the operating point flagged."""
    figure = Figure(figsize=(8.6, 4.8), facecolor="white")
    axes = figure.add_axes((0.09, 0.12, 0.87, 0.80))
    for colour, (name, replay) in zip(COLOURS[1:], told.items(), strict=False):
        holds = replay.where_truth_holds()
        for part, line, words in ((replay, "-", "all ranges"), (holds, "--", "where the truth is possible")):
            false_alarms, caught = curve(part.score, part.bad)
            label = f"{name}, {words}: AUC {part.area:.3f}"
            axes.plot(np.maximum(false_alarms, 1e-4), caught, line, color=colour, lw=1.6, label=label)
        flagged = replay.flagged
        axes.plot(flagged[~replay.bad].mean(), flagged[replay.bad].mean(), "o", color=colour, ms=8, mec="white")
    axes.axvline(0.02, color=INK, lw=0.9, ls=":")
    axes.text(0.021, 0.55, "2 % false alarms", fontsize=9, color=INK)
    axes.set_xscale("log")
    axes.set_xlim(2e-4, 1.0)
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel("false alarms: share of the good ranges")
    axes.set_ylabel("share of the bad ranges caught")
    axes.grid(color=GRID, lw=0.6)
    axes.legend(loc="lower right", fontsize=9, frameon=True)
    axes.set_title("Ranges off by more than 0.5 m, STAR-loc; dots: what is flagged", fontsize=11, loc="left")
    return figure


def draw_frames() -> Figure:
    """The rover's own frame, in which wheels and accelerometer measure, and the heading of its motion, from above."""
    figure = Figure(figsize=(5.2, 4.4), facecolor="white")
    axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
    axes.set_xlim(-1.6, 2.0)
    axes.set_ylim(-0.9, 2.1)
    axes.set_aspect("equal")
    axes.set_axis_off()
    heading_rad = np.radians(50.0)
    ahead = np.array([np.sin(heading_rad), np.cos(heading_rad)])
    left = np.array([-ahead[1], ahead[0]])
    corners = [0.45 * a * ahead + 0.28 * b * left for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    axes.fill(*np.array(corners).T, facecolor="#f2f2f2", edgecolor=INK, lw=1.2)
    for a in (0.28, -0.28):
        for b in (0.32, -0.32):
            wheel = np.array([a * ahead + b * left - 0.13 * ahead, a * ahead + b * left + 0.13 * ahead])
            axes.plot(*wheel.T, color=INK, lw=5.0, solid_capstyle="butt")
    for tip, colour, words, at in (
        (1.45 * ahead, COLOURS[2], "x: forward\nwheel_m[0]", 1.55 * ahead),
        (1.15 * left, COLOURS[2], "y: left\nwheel_m[1]", 1.45 * left),
        (np.array([0.0, 1.7]), COLOURS[1], "north of the anchors' frame", np.array([0.0, 1.85])),
    ):
        axes.annotate("", (tip[0], tip[1]), (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.8})
        across = "left" if at[0] > 0.5 else "center"
        axes.text(at[0], at[1], words, color=colour, fontsize=10, ha=across, va="center")
    turn = np.linspace(0.0, heading_rad, 40)
    axes.plot(0.9 * np.sin(turn), 0.9 * np.cos(turn), color=COLOURS[1], lw=1.4)
    arrow = {"arrowstyle": "-|>", "color": COLOURS[1], "lw": 1.4}
    before = 0.9 * np.sin(turn[-4]), 0.9 * np.cos(turn[-4])
    axes.annotate("", (0.9 * ahead[0], 0.9 * ahead[1]), before, arrowprops=arrow)
    axes.text(0.48, 1.05, "heading_deg", color=COLOURS[1], fontsize=10, ha="left")
    axes.text(
        -1.5, -0.8, "heading_deg: where the motion led, clockwise from north;\ndriving backwards it is the tail's.",
        color=INK, fontsize=9,
    )  # fmt: skip
    return figure


def draw_positions(told: Mapping[str, Replay], log: RangeLog) -> Figure:
    """Distance of the position from the truth over time; stretches of impossible truth shaded."""
    figure = Figure(figsize=(8.6, 3.8), facecolor="white")
    axes = figure.add_axes((0.09, 0.15, 0.87, 0.74))
    for colour, (name, replay) in zip(COLOURS, told.items(), strict=True):
        axes.plot(replay.time_s, replay.off_m, color=colour, lw=1.1, label=f"{name}: {replay.rms_m:.2f} m RMS")
    times_s = np.array([epoch.time_s for epoch in log.epochs])
    axes.fill_between(times_s, 0.0, 3.0, where=log.truth_is_wrong, color=WRONG, lw=0, label="impossible truth")
    axes.set_ylim(0.0, 3.0)
    axes.set_xlim(times_s[0], times_s[-1])
    axes.set_xlabel("time, s")
    axes.set_ylabel("distance from the truth, m")
    axes.grid(color=GRID, lw=0.6)
    axes.legend(loc="upper right", fontsize=9, ncols=2, frameon=True)
    axes.set_title(f"Position of {log.name}", fontsize=11, loc="left")
    return figure


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    out: Path = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    write_png(draw_frames(), out / "frames.png")
    logs = [log for sequence in starloc_sequences() for log in starloc(sequence)]
    alone = [geometric_step(log, TOLERANCE_M, BAD_M) for log in logs]
    fused = [session(log, ASKED, BAD_M) for log in logs]
    write_png(draw_curves({"geometric step": pooled(alone), "detector": pooled(fused)}), out / "caught-starloc.png")
    ways = {"least squares": plain_fit(logs[0], BAD_M), "geometric step": alone[0], "detector": fused[0]}
    write_png(draw_positions(ways, logs[0]), out / "positions-starloc.png")


if __name__ == "__main__":
    main()
