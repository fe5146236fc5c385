"""What the air of a column turned out to be, taken down stretch by stretch from the ceiling to the ground."""

import math

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
    "conclude",
    "note",
]

# what a stretch of air is like
NOT_FLYABLE, FLYABLE, UNKNOWN, UNDECIDED = 0, 1, 255, 2

# what a column is like; UNKNOWN too
NOWHERE, EVERYWHERE, ABOVE, CLOSED_AT_CEILING, OUTSIDE = 0, 1, 2, 3, 4

NOTHING_FOUND = (False, False, -math.inf, FLYABLE, 0, 0)


@scalar_kernel
def note(found, high, code):
    """Take down the next stretch of a column, going down from the ceiling; high is its upper end.

    found: (whether any stretch is flyable, any unknown, upper end of the first that is not flyable for certain, its
    code, separate no-flight intervals, state of the current run); NOTHING_FOUND to begin with.
    """
    flyable, unknown, safe, first_code, intervals, run = found
    if code == FLYABLE:
        return True, unknown, safe, first_code, intervals, 0
    if first_code == FLYABLE:
        safe, first_code = high, code
    if code == UNKNOWN:
        return flyable, True, safe, first_code, intervals, max(run, 1)
    return flyable, unknown, safe, first_code, intervals + (1 if run < 2 else 0), 2


@scalar_kernel
def conclude(found, ground, ceiling):
    """(altitude, altitude above which all is flyable for certain, state, no-flight intervals) of one column."""
    flyable, unknown, safe, first_code, intervals, _ = found
    if first_code == FLYABLE:
        return ground, ground, EVERYWHERE, intervals
    if safe >= ceiling:
        if first_code == UNKNOWN:
            return math.nan, math.inf, UNKNOWN, intervals
        return math.nan, math.inf, CLOSED_AT_CEILING if flyable or unknown else NOWHERE, intervals
    if first_code == UNKNOWN:
        return math.nan, safe, UNKNOWN, intervals
    return safe, safe, ABOVE, intervals
