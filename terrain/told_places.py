"""A place in a sentence, in the numbers in which the question was asked, so that it can be typed back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from .crs.frames import to_lon_lat
from .errors import FrameError
from .grid import ElevationGrid

__all__ = ["places_told", "told_place"]

# no degree of any body's surface that rovers drive on is longer
LONGEST_DEGREE_M = 111_700.0

_told: ContextVar[tuple[bool, bool]] = ContextVar("places_told", default=(True, False))


@contextmanager
def places_told(*, in_metres: bool, in_degrees: bool) -> Iterator[None]:
    """Sentences that are made within name places so; at least one of both."""
    before = _told.set((in_metres or not in_degrees, in_degrees))
    try:
        yield
    finally:
        _told.reset(before)


def told_place(grid: ElevationGrid, east_m: float, north_m: float, within_m: float = 1.0) -> str:
    """The place in brackets, with as many digits as its numbers need to be read back within so many metres."""
    in_metres, in_degrees = _told.get()
    digits = max(math.ceil(-math.log10(within_m)), 0)
    metres = f"({east_m:.{digits}f} m east, {north_m:.{digits}f} m north)"
    if not in_degrees:
        return metres
    try:
        lon_deg, lat_deg = to_lon_lat(grid, east_m, north_m)
    except FrameError:  # far off the map there may be no such degrees
        return metres
    digits = max(math.ceil(-math.log10(within_m / LONGEST_DEGREE_M)), 0)
    degrees = f"({lon_deg:.{digits}f} deg east, {lat_deg:.{digits}f} deg north)"
    return f"{metres} or {degrees}" if in_metres else degrees
