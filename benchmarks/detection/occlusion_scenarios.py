"""Made-up occlusions for the detector: known patterns, noise, the fewest anchors; what it makes of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from detection import DetectorSettings, RangeEpoch, RangingAnchor
from detection.simulation import (
    DriveOutcome,
    Metrics,
    RangingNoise,
    SimulatedDrive,
    draw_epochs,
    drive_along,
    judge_by_epoch,
    judge_drive,
    locate_without_detector,
    metrics_of,
    occluded_by,
    random_occlusions,
)

__all__ = [
    "BY_EPOCH",
    "HARMFUL_M",
    "SCENARIOS",
    "SESSION",
    "VALID_M",
    "Found",
    "Scenario",
    "drives_of",
    "judged",
    "plain_rms_m",
    "ring",
    "run",
]

# A range is bad where it is too long by more than this, as in the published logs; a position is valid within that.
HARMFUL_M, VALID_M = 0.5, 1.0
SPEED_M_PER_S = 1.5
LASTING_S, CLEAR_S = 15.0, 15.0

USUAL = RangingNoise()

Judge = Callable[[SimulatedDrive, Sequence[RangeEpoch], DetectorSettings], DriveOutcome]
BY_EPOCH, SESSION = "one epoch by itself", "a session"
JUDGES: dict[str, Judge] = {BY_EPOCH: judge_by_epoch, SESSION: judge_drive}


@dataclass(frozen=True, slots=True)
class Scenario:
    """Drones on a ring, so many of them hidden at a time, and how good the ranges are.

    excess_m: drawn evenly between these, or with ``small_ones_too`` evenly in their logarithm.
    """

    name: str
    anchors: int = 8
    hidden: int = 1
    dimension: int = 3
    noise: RangingNoise = USUAL
    told_sigma_m: float | None = None
    excess_m: tuple[float, float] = (1.0, 8.0)
    small_ones_too: bool = False

    @property
    def settings(self) -> DetectorSettings:
        """What the detector is told: the noise, and what counts as a bad range."""
        sigma_m = self.noise.range_sigma_m if self.told_sigma_m is None else self.told_sigma_m
        return DetectorSettings(
            dimension=2 if self.dimension == 2 else 3,
            range_sigma_m=sigma_m,
            wheel_sigma_m=self.noise.wheel_sigma_m or 0.02,
            max_speed_m_per_s=3.0,
            harmful_m=HARMFUL_M,
        )


SCENARIOS = (
    Scenario("8 anchors, 1 hidden"),
    Scenario("8 anchors, 2 hidden", hidden=2),
    Scenario("8 anchors, 3 hidden", hidden=3),
    Scenario("8 anchors, 4 hidden", hidden=4),
    Scenario("6 anchors, 1 hidden", anchors=6),
    Scenario("5 anchors, 1 hidden", anchors=5),
    Scenario("4 anchors, 1 hidden", anchors=4),
    Scenario("2D, 5 anchors, 1 hidden", anchors=5, dimension=2),
    Scenario("2D, 4 anchors, 1 hidden", anchors=4, dimension=2),
    Scenario("2D, 3 anchors, 1 hidden", anchors=3, dimension=2),
    Scenario("8 anchors, 1 hidden, no odometry", noise=RangingNoise(wheel_sigma_m=None)),
    Scenario("8 anchors, 1 hidden, sigma 0.03 m", noise=RangingNoise(0.03)),
    Scenario("8 anchors, 1 hidden, sigma 0.3 m", noise=RangingNoise(0.3)),
    Scenario("8 anchors, 1 hidden, sigma 0.2 m, told 0.1 m", noise=RangingNoise(0.2), told_sigma_m=0.1),
    Scenario("8 anchors, 1 hidden, 30 % of ranges lost", noise=RangingNoise(lost_share=0.3)),
)


@dataclass(frozen=True, slots=True)
class Found:
    """What came of a scenario. plain_rms_m: of least squares over all ranges, without a detector."""

    scenario: Scenario
    judged: dict[str, Metrics]
    plain_rms_m: float


def ring(count: int, radius_m: float = 400.0) -> list[RangingAnchor]:
    """Drones on a ring at heights between 60 and 200 m, high ones beside low ones."""
    turns = [2.0 * math.pi * number / count for number in range(count)]
    heights_m = [60.0 + 140.0 * (number * 3 % count) / max(count - 1, 1) for number in range(count)]
    return [
        RangingAnchor(f"D{number + 1}", radius_m * math.sin(turn), radius_m * math.cos(turn), height_m)
        for number, (turn, height_m) in enumerate(zip(turns, heights_m, strict=True))
    ]


def drives_of(
    scenario: Scenario, count: int, generator: np.random.Generator
) -> list[tuple[SimulatedDrive, tuple[RangeEpoch, ...]]]:
    """Drives of about three minutes within the ring, each with its own way, occlusions and noise."""
    anchors = ring(scenario.anchors)
    if scenario.dimension == 2:
        anchors = [replace(anchor, altitude_m=0.0) for anchor in anchors]
    drives = []
    for _ in range(count):
        middle_m = generator.uniform(-120.0, 120.0, size=2)
        corners_m = [middle_m + generator.uniform(-60.0, 60.0, size=2) for _ in range(6)]
        ways_m = [[*corner.tolist(), 2.0][: scenario.dimension] for corner in corners_m]
        drive = drive_along(anchors, ways_m, SPEED_M_PER_S)
        least_m, most_m = scenario.excess_m
        span = (math.log(least_m), math.log(most_m)) if scenario.small_ones_too else (least_m, most_m)
        drawn = random_occlusions(drive, scenario.hidden, LASTING_S, CLEAR_S, span, generator)
        if scenario.small_ones_too:
            drawn = [replace(occlusion, excess_m=math.exp(occlusion.excess_m)) for occlusion in drawn]
        hidden = occluded_by(drive, drawn)
        drives.append((hidden, draw_epochs(hidden, scenario.noise, generator)))
    return drives


def judged(
    drives: Sequence[tuple[SimulatedDrive, tuple[RangeEpoch, ...]]], settings: DetectorSettings
) -> dict[str, list[DriveOutcome]]:
    """What each way of judging makes of the same epochs."""
    return {name: [judge(drive, epochs, settings) for drive, epochs in drives] for name, judge in JUDGES.items()}


def run(scenario: Scenario, drives: int, seed: int) -> Found:
    """The measures of a scenario; the same seed gives the same ones."""
    generator = np.random.default_rng(seed)
    drawn = drives_of(scenario, drives, generator)
    outcomes = judged(drawn, scenario.settings)
    return Found(
        scenario,
        {name: metrics_of(told, HARMFUL_M, VALID_M, generator) for name, told in outcomes.items()},
        plain_rms_m(drawn),
    )


def plain_rms_m(drives: Sequence[tuple[SimulatedDrive, tuple[RangeEpoch, ...]]]) -> float:
    """Root mean square error of positions from all ranges as if none were occluded."""
    errors_m = [
        np.linalg.norm(locate_without_detector(drive, epochs) - drive.places_m, axis=1) for drive, epochs in drives
    ]
    return float(np.sqrt(np.nanmean(np.concatenate(errors_m) ** 2)))
