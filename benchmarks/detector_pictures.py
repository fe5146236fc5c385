"""Pictures of the detector on real ranges: ``python -m benchmarks.detector_pictures --out docs/images/detection``."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from .detector_proof import ASKED, BAD_M, TOLERANCE_M
from .detector_replays import Replay, geometric_step, plain_fit, pooled, session
from .measured_ranges import RangeLog, starloc, starloc_sequences
from .paper import write_png
from .ranking import curve

__all__ = ["draw_curves", "draw_positions", "main"]

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
    logs = [log for sequence in starloc_sequences() for log in starloc(sequence)]
    alone = [geometric_step(log, TOLERANCE_M, BAD_M) for log in logs]
    fused = [session(log, ASKED, BAD_M) for log in logs]
    write_png(draw_curves({"geometric step": pooled(alone), "detector": pooled(fused)}), out / "caught-starloc.png")
    ways = {"least squares": plain_fit(logs[0], BAD_M), "geometric step": alone[0], "detector": fused[0]}
    write_png(draw_positions(ways, logs[0]), out / "positions-starloc.png")


if __name__ == "__main__":
    main()
