"""What the air of a column turned out to be, taken down stretch by stretch from the ceiling to the ground."""

import math
from typing import NamedTuple

from compiled.options import scalar_kernel

__all__ = [
    "ABOVE",
    "CLOSED_AT_CEILING",
    "EVERYWHERE",
    "FLYABLE",
    "NOTHING_FOUND",
    "NOT_FLYABLE",
    "NOWHERE",
    "OUTSIDE",
    "UNDECIDED",
    "UNKNOWN",
    "Column",
    "Findings",
    "conclude",
    "note",
]

# what a stretch of air is like
NOT_FLYABLE, FLYABLE, UNKNOWN, UNDECIDED = 0, 1, 255, 2

# what a column is like; UNKNOWN too
NOWHERE, EVERYWHERE, ABOVE, CLOSED_AT_CEILING, OUTSIDE = 0, 1, 2, 3, 4

# of the stretch before: flyable, unknown, not flyable
RUN_FLYABLE, RUN_UNKNOWN, RUN_CLOSED = 0, 1, 2


class Findings(NamedTuple):
    """What was found of a column so far: whether any stretch is flyable, and whether any is unknown.

    safe_above_m: upper end of the first stretch that is not flyable for certain; first_code: its code. intervals:
    separate no-flight intervals; run: what the stretch before was like.
    """

    flyable: bool
    unknown: bool
    safe_above_m: float
    first_code: int
    intervals: int
    run: int


class Column(NamedTuple):
    """A column's answer: altitude, altitude above which all is flyable for certain, state, no-flight intervals."""

    altitude_m: float
    safe_above_m: float
    state: int
    intervals: int


NOTHING_FOUND = Findings(False, False, -math.inf, FLYABLE, 0, RUN_FLYABLE)


@scalar_kernel
def note(found, high, code):
    """Take down the next stretch of a column, going down from the ceiling; high is its upper end.

    found: Findings, NOTHING_FOUND to begin with.
    """
    flyable, unknown, safe, first_code, intervals, run = found
    if code == FLYABLE:
        return Findings(True, unknown, safe, first_code, intervals, RUN_FLYABLE)
    if first_code == FLYABLE:
        safe, first_code = high, code
    if code == UNKNOWN:
        return Findings(flyable, True, safe, first_code, intervals, max(run, RUN_UNKNOWN))
    return Findings(flyable, unknown, safe, first_code, intervals + (1 if run < RUN_CLOSED else 0), RUN_CLOSED)


@scalar_kernel
def conclude(found, ground, ceiling):
    """The Column whose stretches were all taken down."""
    flyable, unknown, safe, first_code, intervals, _ = found
    if first_code == FLYABLE:
        return Column(ground, ground, EVERYWHERE, intervals)
    if safe >= ceiling:
        if first_code == UNKNOWN:
            return Column(math.nan, math.inf, UNKNOWN, intervals)
        return Column(math.nan, math.inf, CLOSED_AT_CEILING if flyable or unknown else NOWHERE, intervals)
    if first_code == UNKNOWN:
        return Column(math.nan, safe, UNKNOWN, intervals)
    return Column(safe, safe, ABOVE, intervals)
