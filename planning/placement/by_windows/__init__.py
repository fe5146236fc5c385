"""Placements over ground larger than memory: sight, targets and search by windows of the posts in reach."""

from .placing import WindowPlacement, WindowQuestion, place_by_windows

__all__ = ["WindowPlacement", "WindowQuestion", "place_by_windows"]
