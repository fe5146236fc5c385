"""What can go wrong with navigation.

NavigationError
├── StateError          a state or covariance that is none: not finite, not symmetric, not positive ...
├── MeasurementError    ranges, anchors or variances that make no measurement; an anchor without its µ
├── TimeOrderError      times that go backwards; carries index
└── BubbleError         a bubble, path or confidence that cannot be asked for; carries index where one point is at fault
"""

from __future__ import annotations

__all__ = ["BubbleError", "MeasurementError", "NavigationError", "StateError", "TimeOrderError"]


class NavigationError(Exception):
    """Base of everything that navigation raises on purpose."""


class StateError(NavigationError):
    """A state or its covariance is none."""


class MeasurementError(NavigationError):
    """Ranges, anchors or variances make no measurement."""


class TimeOrderError(NavigationError):
    """Times go backwards; carries ``index``, the first that does."""

    def __init__(self, message: str, *, index: int = 0) -> None:
        super().__init__(message)
        self.index = index


class BubbleError(NavigationError):
    """A bubble cannot be asked for; carries ``index`` where one point of the path is at fault."""

    def __init__(self, message: str, *, index: int | None = None) -> None:
        super().__init__(message)
        self.index = index
