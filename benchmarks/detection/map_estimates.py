"""The filter of a session through the shadow of real ground: with verdicts and heights of a map, and without one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import terrain
from benchmarks.detection.map_loop import SEED, WITH, WITHOUT, WRONG, Ground, drive_of, grounds, on_all_cores, wrong_map
from benchmarks.report import Row, Table
from detection import Detector, EpochResult, RangeEpoch
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs
from navigation import ConstantVelocityEstimator, RoverEstimate
from planning.watching import MapDetector

__all__ = ["map_estimates"]

NOTE = """\
Drives, maps and noise like those above. Position: of the session's filter at constant velocity, error in space over the
epochs with a bad range. In the bubble: share of them that are no further off than the radius that is told (three
sigmas)."""


_Task = tuple[Ground, SimulatedDrive, Sequence[RangeEpoch], terrain.ElevationGrid | None]


@dataclass(slots=True)
class _Found:
    """Of every epoch with a bad range: error of the filter, of the detector, whether the bubble holds it; grows."""

    filter_m: list[float]
    detector_m: list[float]
    held: list[bool]


def _note(found: _Found, truth_m: npt.NDArray[np.float64], estimate: RoverEstimate | None, result: EpochResult) -> None:
    place_m = None if result.position is None else result.position.position_m
    found.detector_m.append(math.inf if place_m is None else float(np.linalg.norm(place_m - truth_m)))
    off_m = math.inf if estimate is None else float(np.linalg.norm(estimate.position_m - truth_m))
    found.filter_m.append(off_m)
    found.held.append(estimate is not None and off_m <= estimate.bubble_m)


def _together(parts: Sequence[_Found]) -> _Found:
    return _Found(
        [one for part in parts for one in part.filter_m],
        [one for part in parts for one in part.detector_m],
        [one for part in parts for one in part.held],
    )


def _session(task: _Task) -> _Found:
    ground, driven, epochs, grid = task
    found = _Found([], [], [])
    estimator = ConstantVelocityEstimator(driven.anchors, ground.settings)
    blind = Detector(driven.anchors, ground.settings)
    mapped = None
    if grid is not None:
        about = (grid, driven.anchors, ground.settings, ground.antenna_m, ground.errors)
        mapped = MapDetector(*about, estimator=estimator)
    for n, epoch in enumerate(epochs):
        if mapped is not None:
            watched = mapped.process(epoch)
            result, estimate = watched.result, watched.estimate
        else:
            result = blind.process(epoch)
            estimate = estimator.step(epoch, result, blind.motion)
        if np.nanmax(driven.excess_m[n]) > ground.harmful_m:
            _note(found, driven.places_m[n], estimate, result)
    return found


def _is_met(p95_m: float, most_m: float) -> bool:
    """A filter that has not begun is nowhere: that is no better than nowhere."""
    return math.isfinite(p95_m) and p95_m <= most_m


def map_estimates(drives: int = 70) -> Table:
    """Positions of the filter in the shadow with a map beside without, by ground."""
    rows = []
    for ground in grounds():
        generator = np.random.default_rng(SEED)
        tasks: dict[str, list[_Task]] = {WITHOUT: [], WITH: [], WRONG: []}
        for _ in range(drives):
            driven = drive_of(ground, generator)
            epochs = draw_epochs(driven, RangingNoise(), generator)
            maps = {WITHOUT: None, WITH: ground.grid, WRONG: wrong_map(ground.grid, generator)}
            for name, grid in maps.items():
                tasks[name].append((ground, driven, epochs, grid))
        done = iter(on_all_cores(_session, [task for of_name in tasks.values() for task in of_name]))
        found = {name: _together([next(done) for _ in of_name]) for name, of_name in tasks.items()}
        if not found[WITHOUT].filter_m:
            rows.append(Row((ground.name, "no drive had a bad range", "0", "", "", "", "")))
            continue
        p95_m = {name: float(np.percentile(one.filter_m, 95.0, method="higher")) for name, one in found.items()}
        for name, one in found.items():
            cells = (
                ground.name, name, str(len(one.filter_m)), f"{np.median(one.filter_m):.2f} m", f"{p95_m[name]:.2f} m",
                f"{np.percentile(one.detector_m, 95.0, method='higher'):.2f} m", f"{np.mean(one.held):.1%}",
            )  # fmt: skip
            if name == WITHOUT:
                rows.append(Row(cells))
                continue
            most = 0.7 if name == WITH else 1.0
            rows.append(Row(cells, f"p95 <= {most:g} ×", _is_met(p95_m[name], most * p95_m[WITHOUT])))
    columns = ("ground", "session", "epochs", "position", "position p95", "the detector's p95", "in the bubble")
    return Table(f"The filter of a session that looks at a map ({drives} drives a ground)", columns, rows, NOTE)
