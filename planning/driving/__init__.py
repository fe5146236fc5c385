"""Drives over a map: a log navigated with what the map knows."""

from .drives import DriveOverMap, navigate_over_map
from .frames import MapFrame, map_frame

__all__ = ["DriveOverMap", "MapFrame", "map_frame", "navigate_over_map"]
