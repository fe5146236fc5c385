"""Rehearsal of the detector: drives with known occlusions, noise of a given size, and how well the detector did."""

from .drives import SimulatedDrive, drive_along
from .metrics import (
    DriveOutcome,
    Estimate,
    Metrics,
    judge_by_epoch,
    judge_drive,
    locate_without_detector,
    metrics_of,
    response_times_s,
)
from .noise import Occlusion, RangingNoise, draw_epochs, occluded_by, random_occlusions

__all__ = [
    "DriveOutcome",
    "Estimate",
    "Metrics",
    "Occlusion",
    "RangingNoise",
    "SimulatedDrive",
    "draw_epochs",
    "drive_along",
    "judge_by_epoch",
    "judge_drive",
    "locate_without_detector",
    "metrics_of",
    "occluded_by",
    "random_occlusions",
    "response_times_s",
]
