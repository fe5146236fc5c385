"""Drives through the shadow of real ground: a session that looks at a map beside the same session without one."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from multiprocessing import get_context
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import scipy.ndimage

import terrain
import visibility
from benchmarks.report import Row, Table, duration
from benchmarks.terrains import real_grid
from dem_samples import load_sample
from detection import Detector, DetectorSettings, EpochResult, RangeEpoch, RangingAnchor
from detection.simulation import RangingNoise, SimulatedDrive, draw_epochs, drive_along
from planning.watching import GroundErrors, MapDetector

__all__ = ["Ground", "loop_speed", "map_loop", "on_all_cores"]

Floats = npt.NDArray[np.float64]
Task = TypeVar("Task")
Done = TypeVar("Done")

SEED = 7_015  # drives, anchors and settings were shaped on seed 15; on this one nothing was
WITHOUT, WITH, WRONG = "without", "right map", "wrong map"
PIECE, FEW_TASKS = 20, 6  # drives of a task; fewer tasks are done where they are
WRONG_M, WRONG_CELLS = 5.0, 10.0  # sigma of the wrong map's heights, over how many cells it is alike
NOTE = f"""\
Straight drives at random among eight anchors around them, an epoch a second, ranging noise 0.1 m, wheel odometry. Who
is hidden, and how much longer the way over the ground is, comes from the ground under each line; a range is *bad* where
it is too long by more than `harmful_m`. Every session hears the same epochs. *Right map*: the ground itself, believed
to 2 m (Gale: 0.3 m). *Wrong map*: told the same, but its heights are off by {WRONG_M:g} m (one sigma, alike over
{WRONG_CELLS:g} cells) and all of it lies one cell too far east and south. *Missed*: of the bad ranges, by the flag, and
with the score cut so that as many ranges in sight are flagged as the session without a map flags. Position: 95th
percentile of the error in space over the epochs with a bad range."""


@dataclass(frozen=True, slots=True, eq=False)
class Ground:
    """Ground, anchors on a ring around where a rover drives, what counts as bad, how far its map is believed."""

    name: str
    grid: terrain.ElevationGrid
    ring_m: float
    above_ground_m: float
    length_m: float
    speed_m_per_s: float
    harmful_m: float
    errors: GroundErrors
    antenna_m: float = 1.5

    @property
    def settings(self) -> DetectorSettings:
        """What every session is told."""
        return DetectorSettings(max_speed_m_per_s=4.0, harmful_m=self.harmful_m)


@dataclass(frozen=True, slots=True, eq=False)
class Told:
    """What a session made of drives, drives one after the other: flags and scores of the ranges, errors of places."""

    bad: npt.NDArray[np.bool_]
    clear: npt.NDArray[np.bool_]
    called: npt.NDArray[np.bool_]
    scores: Floats
    errors_m: Floats
    times_s: Floats


def grounds() -> list[Ground]:
    """The three grounds, as far as their DEMs are at hand."""
    usual = GroundErrors(dem_sigma_m=2.0)
    found = [Ground("Jacksboro", load_sample("jacksboro"), 2500.0, 120.0, 400.0, 2.0, 0.5, usual)]
    mountains = real_grid("bigtujunga.tif")
    if mountains is not None:
        found.append(Ground("Big Tujunga", mountains, 2000.0, 300.0, 400.0, 2.0, 0.5, usual))
    crater = real_grid("mmgis_gale_missionDEM.tif")
    if crater is not None:
        near = GroundErrors(dem_sigma_m=0.3, correlation_m=10.0)
        found.append(Ground("Gale", crater, 120.0, 4.0, 80.0, 0.5, 0.3, near))
    return found


def wrong_map(grid: terrain.ElevationGrid, generator: np.random.Generator) -> terrain.ElevationGrid:
    """The grid with smooth errors, all of it one cell too far east and south."""
    rough = scipy.ndimage.gaussian_filter(generator.standard_normal(grid.shape), WRONG_CELLS, mode="wrap")
    heights_m = grid.heights_m + (WRONG_M / rough.std() * rough).astype(np.float32)
    return replace(
        grid,
        heights_m=heights_m,
        origin_east_m=grid.origin_east_m + grid.cell_east_m,
        origin_north_m=grid.origin_north_m - grid.cell_north_m,
    )


def drive_of(ground: Ground, generator: np.random.Generator) -> SimulatedDrive:
    """A straight drive at a random place, eight anchors around it at random turns, all over known ground."""
    grid = ground.grid
    west_m, south_m, east_m, north_m = grid.bounds_m
    while True:
        middle_m = generator.uniform(
            [west_m + ground.ring_m, south_m + ground.ring_m], [east_m - ground.ring_m, north_m - ground.ring_m]
        )
        turns = generator.uniform(0.0, 2.0 * math.pi) + 2.0 * math.pi * np.arange(8) / 8
        around_m = middle_m + ground.ring_m * np.column_stack([np.sin(turns), np.cos(turns)])
        up_m = ground.above_ground_m * generator.uniform(0.5, 2.0, size=8)
        heights_m = terrain.height_at(grid, around_m[:, 0], around_m[:, 1]) + up_m
        way = generator.uniform(0.0, 2.0 * math.pi)
        half_m = 0.5 * ground.length_m * np.array([math.sin(way), math.cos(way)])
        anchors = [
            RangingAnchor(f"A{n + 1}", at_m[0], at_m[1], up)
            for n, (at_m, up) in enumerate(zip(around_m.tolist(), np.nan_to_num(heights_m).tolist(), strict=True))
        ]
        level = drive_along(anchors, [middle_m - half_m, middle_m + half_m], ground.speed_m_per_s)
        rover_m = terrain.height_at(grid, *level.places_m.T) + ground.antenna_m
        if np.isfinite(heights_m).all() and np.isfinite(rover_m).all():
            return _hidden(
                ground, level, np.column_stack([level.places_m, rover_m]), np.column_stack([around_m, heights_m])
            )


def _hidden(ground: Ground, level: SimulatedDrive, places_m: Floats, anchors_m: Floats) -> SimulatedDrive:
    count, k = len(places_m), len(anchors_m)
    lines = visibility.lines_of_sight(
        ground.grid, np.repeat(places_m, k, axis=0), np.tile(anchors_m, (count, 1)), excess_path=True
    )
    assert lines.excess_path_m is not None  # it was asked for
    excess_m = np.nan_to_num(lines.excess_path_m, nan=np.nan, posinf=np.nan).reshape(count, k)
    return replace(level, places_m=places_m, excess_m=excess_m)


def session(
    ground: Ground, drive: SimulatedDrive, epochs: Sequence[RangeEpoch], grid: terrain.ElevationGrid | None
) -> tuple[list[EpochResult], list[float]]:
    """(answers, CPU seconds of each) of a session over these epochs; grid: the map it looks at, None = none."""
    watched = (
        None if grid is None else MapDetector(grid, drive.anchors, ground.settings, ground.antenna_m, ground.errors)
    )
    blind = Detector(drive.anchors, ground.settings)
    results, times_s = [], []
    for epoch in epochs:
        begin_s = time.process_time()
        results.append(blind.process(epoch) if watched is None else watched.process(epoch).result)
        times_s.append(time.process_time() - begin_s)
    return results, times_s


def _told(
    drives: Sequence[SimulatedDrive], answers: Sequence[tuple[list[EpochResult], list[float]]], harmful_m: float
) -> Told:
    bad, clear, called, scores, errors_m, times_s = [], [], [], [], [], []
    for drive, (results, each_s) in zip(drives, answers, strict=True):
        times_s += each_s
        columns = {anchor.id: number for number, anchor in enumerate(drive.anchors)}
        for n, result in enumerate(results):
            excess_m = drive.excess_m[n]
            for verdict in result.verdicts:
                over_m = excess_m[columns[verdict.anchor_id]]
                bad.append(over_m > harmful_m)
                clear.append(over_m == 0.0)
                called.append(verdict.off)
                scores.append(verdict.score)
            if np.nanmax(excess_m) > harmful_m:
                place_m = None if result.position is None else result.position.position_m
                errors_m.append(math.inf if place_m is None else float(np.linalg.norm(place_m - drive.places_m[n])))
    return Told(*map(np.array, (bad, clear, called, scores, errors_m, times_s)))


def sessions(ground: Ground, count: int, seed: int = SEED) -> dict[str, Told]:
    """What the three sessions make of so many drives."""
    generator = np.random.default_rng(seed)
    drives = [drive_of(ground, generator) for _ in range(count)]
    epochs = [draw_epochs(drive, RangingNoise(), generator) for drive in drives]
    maps = {WITHOUT: None, WITH: ground.grid, WRONG: wrong_map(ground.grid, generator)}
    pieces = [slice(start, start + PIECE) for start in range(0, count, PIECE)]
    tasks = [(ground, grid, drives[of], epochs[of]) for grid in maps.values() for of in pieces]
    done = iter(on_all_cores(_answers, tasks))
    return {name: _told(drives, [one for _ in pieces for one in next(done)], ground.harmful_m) for name in maps}


def on_all_cores(work: Callable[[Task], Done], tasks: Sequence[Task]) -> list[Done]:
    """What becomes of each task, in order; of a few here, of many in processes of their own, one a core."""
    if len(tasks) < FEW_TASKS:
        return [work(task) for task in tasks]
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        return list(pool.map(work, tasks))


def _answers(
    task: tuple[Ground, terrain.ElevationGrid | None, Sequence[SimulatedDrive], Sequence[Sequence[RangeEpoch]]],
) -> list[tuple[list[EpochResult], list[float]]]:
    ground, grid, drives, epochs = task
    return [session(ground, drive, each, grid) for drive, each in zip(drives, epochs, strict=True)]


def missed_at(told: Told, false_alarms: float) -> float:
    """Share of the bad ranges below the score that so many ranges in sight exceed."""
    cut = np.quantile(told.scores[told.clear], 1.0 - false_alarms)
    return float((told.scores[told.bad] <= cut).mean())


def map_loop(drives: int = 200) -> Table:
    """Missed and false alarms with a map beside without, and positions in the shadow."""
    rows = []
    for ground in grounds():
        told = sessions(ground, drives)
        blind = told[WITHOUT]
        if not (blind.bad.any() and blind.clear.any()):
            rows.append(Row((ground.name, "no drive had a bad range", f"{len(blind.bad):,}", *[""] * 6)))
            continue
        false_alarms = float(blind.called[blind.clear].mean())
        p95_m = {name: float(np.percentile(one.errors_m, 95.0, method="higher")) for name, one in told.items()}
        missed = {name: missed_at(one, false_alarms) for name, one in told.items()}
        for name, one in told.items():
            cells = (
                ground.name, name, f"{len(one.bad):,}", f"{one.bad.mean():.1%}",
                f"{1.0 - one.called[one.bad].mean():.1%}", f"{one.called[one.clear].mean():.2%}",
                f"{missed[name]:.1%}", f"{np.median(one.errors_m):.2f} m", f"{p95_m[name]:.2f} m",
            )  # fmt: skip
            if name == WITHOUT:
                rows.append(Row(cells))
                continue
            most, ratio = (0.5, 0.7) if name == WITH else (1.0, 1.0)
            met = missed[name] <= most * missed[WITHOUT] and p95_m[name] <= ratio * p95_m[WITHOUT]
            rows.append(Row(cells, f"missed ≤ {most:g} ×, p95 ≤ {ratio:g} ×", met))
    columns = ("ground", "session", "ranges", "bad", "missed", "false alarms", "missed at equal false alarms",
               "position", "position p95")  # fmt: skip
    return Table(f"Sessions that look at a map ({drives} drives a ground)", columns, rows, NOTE)


def loop_speed(drives: int = 6) -> Table:
    """CPU time of an epoch of eight anchors, with the map and without."""
    rows = []
    for ground in grounds():
        told = sessions(ground, drives)
        for name in (WITHOUT, WITH):
            median_s, p99_s = np.percentile(told[name].times_s, [50.0, 99.0]).tolist()
            cells = (ground.name, name, str(len(told[name].times_s)), duration(median_s), duration(p99_s))
            rows.append(Row(cells, "p99 ≤ 2 ms", p99_s <= 2e-3) if name == WITH else Row(cells))
    return Table("Time of an epoch with a map, 8 anchors", ("ground", "session", "epochs", "median", "p99"), rows)
