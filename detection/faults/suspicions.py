"""What a log as a whole may suffer from, by name, and how it is told."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

__all__ = ["Cause", "Suspicion"]


class Cause(StrEnum):
    """What a log as a whole may suffer from."""

    RANGE_UNIT = "unit of ranges"
    TIME_UNIT = "unit of time"
    TIME_ORDER = "order in time"
    DIMENSION = "dimension"
    ALTITUDES = "altitudes of anchors"
    OFFSET = "offset of all ranges"
    SCALE = "scale of all ranges"
    SWAPPED = "swapped ids"
    MOVED = "place of an anchor"
    ANCHOR_OFFSET = "offset of an anchor"
    FRAME = "frame"
    SIGMA = "sigma of ranges"
    TOO_FEW = "too few ranges"
    NOT_FOUND = "not found"


@dataclass(frozen=True, slots=True)
class Suspicion:
    """A likely cause, a sentence, and a number.

    value: of units how many metres or seconds one is, or how many times too long ranges are; metres of an offset, of a
    sigma, or between where an anchor is said to stand and where it seems to; radians by which a frame is turned; how
    often rows go back; NaN where there is none. sigma: of an offset, a scale or a shift, in its unit; NaN where nothing
    was estimated. anchor_ids: whose fault it is; empty = of the log.
    """

    cause: Cause
    sentence: str
    value: float = math.nan
    sigma: float = math.nan
    anchor_ids: tuple[str, ...] = ()
