"""Numbers in the sentences of answers, as people say them."""

from __future__ import annotations

import math

__all__ = ["more_or_less", "time_words"]


def time_words(seconds: float) -> str:
    """A time on the way, to about a hundredth of it."""
    if not math.isfinite(seconds) or seconds < 120.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"


def more_or_less(seconds: float) -> str:
    """A difference of times, with its sign."""
    return f"{'-' if seconds < 0.0 else '+'}{time_words(abs(seconds))}"
