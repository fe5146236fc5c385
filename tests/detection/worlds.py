"""Rovers, anchors and ranges that the tests of the detector share."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from detection import Detector, EpochResult, OdometryIncrement, RangeEpoch, RangeMeasurement, RangingAnchor

Floats = npt.NDArray[np.float64]

# eight drones around and above a valley, no three on a line, no four in a plane
DRONES_M = np.array(
    [
        (0, 0, 120), (400, 30, 60), (380, 420, 140), (-20, 390, 80), (240, 150, 160), (90, 250, 40), (300, 300, 90),
        (60, 90, 70),
    ],
    np.float64,
)  # fmt: skip
ROVER_M = np.array([150.0, 160.0, 2.0])
STEP_M = np.array([1.2, 0.5, 0.0])  # a second


def drones(count: int = 8) -> list[RangingAnchor]:
    return [RangingAnchor(f"D{i + 1}", *map(float, place)) for i, place in enumerate(DRONES_M[:count])]


def true_ranges(anchors_m: Floats, place_m: Floats) -> Floats:
    distances: Floats = np.linalg.norm(anchors_m - place_m, axis=1)
    return distances


def world(seed: int, count: int, dimension: int) -> tuple[Floats, Floats]:
    """(anchors, rover): anchors of a few hundred metres around, at least 40 m from one another, high and low."""
    rng = np.random.default_rng(seed)
    anchors: list[Floats] = []
    while len(anchors) < count:
        anchor = np.append(rng.uniform(-200.0, 200.0, 2), rng.uniform(20.0, 150.0))[:dimension]
        if all(np.linalg.norm(anchor[:2] - other[:2]) > 40.0 for other in anchors):
            anchors.append(anchor)
    return np.array(anchors), np.append(rng.uniform(-120.0, 120.0, 2), 1.0)[:dimension]


def heard(
    time_s: float, ranges_m: dict[str, float], odometry: OdometryIncrement | None = None, **p_sight: float
) -> RangeEpoch:
    measured = tuple(RangeMeasurement(name, r, p_sight=p_sight.get(name)) for name, r in ranges_m.items())
    return RangeEpoch(time_s, measured, odometry)


def named(
    anchors: list[RangingAnchor], place_m: Floats, too_long_m: dict[str, float] | None = None
) -> dict[str, float]:
    """True ranges by anchor id, some too long."""
    return {
        a.id: math.dist((a.east_m, a.north_m, a.altitude_m), place_m) + (too_long_m or {}).get(a.id, 0.0)
        for a in anchors
    }


def drive(
    detector: Detector,
    anchors: list[RangingAnchor],
    epochs: range,
    too_long_m: dict[str, float] | None = None,
    silent: tuple[str, ...] = (),
    noise: np.random.Generator | None = None,
    **p_sight: float,
) -> list[EpochResult]:
    """Answers for a rover that goes 1.3 m/s, ten epochs a second."""
    answers = []
    for number in epochs:
        ranges_m = named(anchors, ROVER_M + 0.1 * number * STEP_M, too_long_m)
        if noise is not None:
            ranges_m = {name: r + 0.1 * noise.normal() for name, r in ranges_m.items()}
        kept = {name: r for name, r in ranges_m.items() if name not in silent}
        answers.append(detector.process(heard(0.1 * number, kept, None, **p_sight)))
    return answers


def off_m(answer: EpochResult, number: int) -> float:
    assert answer.position is not None
    return float(np.linalg.norm(answer.position.position_m - (ROVER_M + 0.1 * number * STEP_M)))
