"""Drives as their logs have them: settings, where one begins, and the track that fits what was measured."""

from .driving import DriveTrack, navigate_drive
from .logs import SOURCES, DriveLog, Fixes, Foreseen, Ranges, Readings, Speeds
from .riding import InertialEstimator
from .satellites import Satellites
from .settings import DriveSettings

__all__ = [
    "SOURCES",
    "DriveLog",
    "DriveSettings",
    "DriveTrack",
    "Fixes",
    "Foreseen",
    "InertialEstimator",
    "Ranges",
    "Readings",
    "Satellites",
    "Speeds",
    "navigate_drive",
]
