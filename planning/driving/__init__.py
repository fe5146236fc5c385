"""Drives over a map: a log navigated with what the map knows, and protection levels foretold from it."""

from .drives import DriveOverMap, navigate_over_map
from .frames import MapFrame, map_frame
from .protection import ForetoldProtection, protection_over_map

__all__ = ["DriveOverMap", "ForetoldProtection", "MapFrame", "map_frame", "navigate_over_map", "protection_over_map"]
