"""Rehearsal of the detector: drives with known occlusions, noise of a given size, and how well the detector did."""

from .drives import SimulatedDrive, drive_along
from .metrics import Estimate, Metrics, metrics_of, response_times_s
from .noise import RangingNoise, draw_epochs
from .occlusions import Occlusion, occluded_by, random_occlusions
from .outcomes import DriveOutcome, judge_by_epoch, judge_drive, locate_without_detector

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
