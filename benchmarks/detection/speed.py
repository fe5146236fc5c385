"""How long one epoch takes in Python: a running session, with anchors occluded."""

from __future__ import annotations

import gc
import math
import time

import numpy as np
import numpy.typing as npt

from benchmarks.report import Row, Table, duration
from detection import Detector, DetectorSettings, OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor

__all__ = ["detector_speed"]

Floats = npt.NDArray[np.float64]

# (anchors, occluded); of eight the 99th percentile is judged, of more the worst
CASES = ((8, 0), (8, 1), (8, 2), (16, 0), (16, 4), (16, 8))
# Ranges of which nobody would be right: the search runs out.
WORST = ("at random", "all too long", "of two places", "all too long, anchors level")
WORST_ANCHORS = (16, 28, 32)
RANGE_SIGMA_M, TARGET_S = 0.1, 1e-3
WORST_TARGETS_S = {16: 5e-3, 28: 25e-3, 32: 25e-3}


def detector_speed(epochs: int = 2000) -> Table:
    """Time per epoch with odometry and noise, and with ranges that make the search as long as it may be."""
    rows = []
    for count, occluded in CASES:
        wall_s, own_s = _times_s(count, occluded, "", epochs)
        target, met = "p99 ≤ 1 ms", bool(np.quantile(own_s, 0.99) <= TARGET_S)
        if count > 8:
            target, met = _worst(count, own_s)
        rows.append(_row(str(count), str(occluded), wall_s, own_s, target, met))
    for count in WORST_ANCHORS:
        for lies in WORST:
            wall_s, own_s = _times_s(count, 0, lies, max(epochs // 10, 50))
            rows.append(_row(str(count), f"ranges {lies}", wall_s, own_s, *_worst(count, own_s)))
    columns = ("anchors", "occluded", "median", "p99", "worst", "p99 by the clock on the wall")
    note = (
        f"{epochs} epochs of a session in 3D, 10 a second, with odometry, after 50 that warm up; processor "
        "time of `Detector.process`, by which targets are judged; by the wall clock other programs count too."
    )
    return Table("Detector: time per epoch", columns, rows, note)


def _worst(count: int, own_s: Floats) -> tuple[str, bool]:
    target_s = WORST_TARGETS_S[count]
    return f"worst ≤ {1e3 * target_s:.0f} ms", bool(own_s.max() <= target_s)


def _row(anchors: str, occluded: str, wall_s: Floats, own_s: Floats, target: str, met: bool) -> Row:
    shown = (np.median(own_s), np.quantile(own_s, 0.99), own_s.max(), np.quantile(wall_s, 0.99))
    return Row((anchors, occluded, *(duration(float(one)) for one in shown)), target, met)


def _times_s(count: int, occluded: int, lies: str, epochs: int) -> tuple[Floats, Floats]:
    """(wall time, processor time) of every epoch."""
    rng = np.random.default_rng(count + occluded)
    places_m = np.column_stack([rng.uniform(-300.0, 300.0, (count, 2)), rng.uniform(30.0, 160.0, count)])
    if lies.endswith("level"):
        places_m[:, 2] = 80.0 + rng.normal(size=count)
    anchors = [RangingAnchor(f"D{i + 1}", *map(float, place)) for i, place in enumerate(places_m)]
    detector = Detector(anchors, DetectorSettings(range_sigma_m=RANGE_SIGMA_M))
    warm_up, wall_s, own_s = 50, [], []
    gc.collect()
    gc.disable()
    try:
        for number in range(epochs + warm_up):
            epoch = _epoch(number, places_m, occluded, lies, rng)
            begin_s, own_begin_s = time.perf_counter(), time.thread_time()
            detector.process(epoch)
            own_s.append(time.thread_time() - own_begin_s)
            wall_s.append(time.perf_counter() - begin_s)
            if number % 200 == 0:
                gc.collect()
    finally:
        gc.enable()
    return np.array(wall_s[warm_up:]), np.array(own_s[warm_up:])


def _epoch(number: int, places_m: Floats, occluded: int, lies: str, rng: np.random.Generator) -> RangeEpoch:
    """A circle of 60 m at 1.2 m/s; which anchors are occluded changes every ten seconds."""
    angle = 0.002 * number
    rover_m = np.array([60.0 * math.cos(angle), 60.0 * math.sin(angle), 2.0])
    ranges_m = np.linalg.norm(places_m - rover_m, axis=1) + RANGE_SIGMA_M * rng.normal(size=len(places_m))
    hidden = np.random.default_rng(number // 100).permutation(len(places_m))[:occluded]
    ranges_m[hidden] += rng.uniform(1.0, 20.0, occluded)
    if lies == "at random":
        ranges_m = rng.uniform(50.0, 600.0, len(places_m))
    elif lies.startswith("all too long"):
        ranges_m += rng.uniform(1.0, 20.0, len(places_m))
    elif lies == "of two places":
        elsewhere_m = rover_m + rng.uniform(-100.0, 100.0, 3)
        ranges_m[::2] = np.linalg.norm(places_m[::2] - elsewhere_m, axis=1)
    measured = tuple(RangeMeasurement(f"D{i + 1}", float(r)) for i, r in enumerate(ranges_m))
    return RangeEpoch(0.1 * number, measured, OdometryIncrement(0.1, (0.12, 0.0), (0.12, 0.0, 0.0)))
