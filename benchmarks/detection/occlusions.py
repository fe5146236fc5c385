"""Simulate occlusions and measure the detector: ``-m benchmarks.detection.occlusions --out FOLDER``.

Writes the pictures and prints the tables of docs/detection-simulation.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from benchmarks.detection.occlusion_pictures import draw_caught, draw_drive, draw_places, draw_response
from benchmarks.detection.occlusion_scenarios import (
    HARMFUL_M,
    SCENARIOS,
    VALID_M,
    Scenario,
    drives_of,
    judged,
    plain_rms_m,
    run,
)
from benchmarks.detection.occlusion_terrain import ground_drives, jacksboro
from benchmarks.visibility.paper import write_png
from detection import RangeEpoch
from detection.simulation import (
    DriveOutcome,
    Estimate,
    Metrics,
    RangingNoise,
    draw_epochs,
    judge_drive,
    metrics_of,
    response_times_s,
)

__all__ = ["main", "over_terrain", "scenarios"]

SEED = 1
WITH_MAP = "a session with a coarse map"
COLUMNS = (
    "scenario", "way of judging", "bad ranges caught", "false alarms", "unknown", "onsets noticed", "median response",
    "position there", f"within {VALID_M:g} m", "RMS error", "without detector",
)  # fmt: skip
# Of one scenario the excess goes down to what nobody can see, so that one sees where it begins to be seen.
FADING = Scenario("8 anchors, 1 hidden, any excess", excess_m=(0.05, 10.0), small_ones_too=True)
EDGES_M = np.geomspace(0.05, 10.0, 15)


Rows = list[tuple[str, ...]]


def scenarios(drives: int) -> Rows:
    """Every scenario by every way of judging."""
    rows: Rows = []
    for number, scenario in enumerate(SCENARIOS):
        found = run(scenario, drives, SEED + number)
        rows += _rows(scenario.name, found.judged, found.plain_rms_m)
    return rows


def over_terrain(drives: int, folder: Path | None) -> tuple[Rows, str]:
    """Drives over the bundled DEM, and how much of their ranges is hidden; pictures into the folder."""
    generator = np.random.default_rng(SEED)
    place = jacksboro()
    settings = replace(Scenario("").settings, max_speed_m_per_s=4.0)
    driven = ground_drives(place, drives, 800.0, generator)
    drawn = [(drive, draw_epochs(drive, RangingNoise(), generator)) for drive in driven]
    blind = [(replace(drive, p_sight=None), tuple(map(_without_map, epochs))) for drive, epochs in drawn]
    told: dict[str, list[DriveOutcome]] = judged(blind, settings)
    told[WITH_MAP] = [judge_drive(drive, epochs, settings) for drive, epochs in drawn]
    if folder is not None:
        shown = int(np.argmax([_changes(drive.excess_m > HARMFUL_M) for drive in driven]))
        write_png(draw_places(place, driven, shown), folder / "places.png")
        write_png(draw_drive(told[WITH_MAP][shown], f"One drive, {WITH_MAP}"), folder / "drive.png")
        waits_s = {
            name: [wait_s for outcome in outcomes for wait_s in response_times_s(outcome, HARMFUL_M)]
            for name, outcomes in told.items()
        }
        write_png(draw_response(waits_s, every_s=1.0), folder / "response.png")
    metrics = {name: metrics_of(outcomes, HARMFUL_M, VALID_M, generator) for name, outcomes in told.items()}
    rows = _rows("Jacksboro, 8 drones", metrics, plain_rms_m(drawn))
    hidden = np.concatenate([drive.excess_m for drive in driven]) > 0.0
    bad = np.concatenate([drive.excess_m for drive in driven]) > HARMFUL_M
    return rows, f"Hidden: {hidden.mean():.0%} of the ranges, bad: {bad.mean():.0%}."


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.detection.occlusions", description=__doc__)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the pictures; none without")
    parser.add_argument("--drives", type=int, default=12, help="simulated drives per scenario (default 12)")
    arguments = parser.parse_args()
    if arguments.drives < 1:
        parser.error("--drives must be at least 1.")
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        drawn = drives_of(FADING, 4 * arguments.drives, np.random.default_rng(SEED))
        write_png(draw_caught(judged(drawn, FADING.settings), EDGES_M), arguments.out / "caught.png")
    print(_markdown(scenarios(arguments.drives)))
    rows, sentence = over_terrain(2 * arguments.drives, arguments.out)
    print(_markdown(rows), sentence, sep="\n")
    return 0


def _markdown(rows: Rows) -> str:
    lines = [COLUMNS, ("---",) * len(COLUMNS), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines) + "\n"


def _rows(name: str, told: Mapping[str, Metrics], plain_m: float) -> Rows:
    return [(name, way, *_cells(metrics), f"{plain_m:.2f} m") for way, metrics in told.items()]


def _cells(metrics: Metrics) -> Iterator[str]:
    yield from (
        _share(rate) for rate in (metrics.true_positives, metrics.false_positives, metrics.unknown, metrics.noticed)
    )
    yield _with_interval(metrics.response_s, "{:.0f}", " s")
    yield from (_share(rate) for rate in (metrics.availability, metrics.valid))
    yield _with_interval(metrics.position_rms_m, "{:.2f}", " m")


def _share(rate: Estimate) -> str:
    percent = Estimate(100.0 * rate.value, 100.0 * rate.low, 100.0 * rate.high, rate.count)
    return _with_interval(percent, "{:.1f}", " %")


def _with_interval(estimate: Estimate, form: str, unit: str) -> str:
    if estimate.count == 0:
        return "–"
    numbers = (estimate.value, estimate.low, estimate.high)
    value, low, high = (form.format(number).replace("100.0", "100") for number in numbers)
    return f"{value}{unit}" if low == value == high else f"{value}{unit} ({low}–{high})"


def _without_map(epoch: RangeEpoch) -> RangeEpoch:
    return replace(epoch, ranges=tuple(replace(measured, p_sight=None) for measured in epoch.ranges))


def _changes(bad: npt.NDArray[np.bool_]) -> int:
    """How often ranges become bad or good again."""
    return int((bad[1:] != bad[:-1]).sum())


if __name__ == "__main__":
    sys.exit(main())
