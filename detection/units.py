"""Units that a log cannot mean: times by how far epochs are apart, ranges by their triangles with pairs of anchors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

__all__ = ["IMPOSSIBLE", "POSSIBLE", "impossible_share", "range_unit", "time_unit"]

Floats = npt.NDArray[np.float64]

# No track lasts over a longer silence: every epoch stands alone.
APART_S = 30.0
TIMES = (("milliseconds", 1e-3), ("microseconds", 1e-6), ("nanoseconds", 1e-9))
LIKELY_APART_S = 5.0
SINCE_1970_S = (9.4e8, 4.2e9)  # from the year 2000 to 2100

# factor from what is written to metres, and what may be written so
LENGTHS = (
    (1e-3, "millimetres", "the anchors' places in kilometres"),
    (1e-2, "centimetres", ""),
    (1e2, "", "the anchors' places in centimetres"),
    (1e3, "kilometres", "the anchors' places in millimetres"),
)
IMPOSSIBLE = 0.5  # share of pairs of ranges that cannot meet, from which a unit is looked for
ENOUGH_PAIRS = 3
POSSIBLE = 0.1  # the same, up to which it is believed


def time_unit(times_s: Sequence[float]) -> tuple[float, str] | None:
    """(seconds in a unit of time_s, a question) where times are no seconds; None where they may be."""
    finite = np.asarray([time_s for time_s in times_s if np.isfinite(time_s)], np.float64)
    if not len(finite):
        return None
    steps_s = np.diff(finite)
    steps_s = steps_s[steps_s > 0.0]
    apart_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    at_s = float(np.median(np.abs(finite)))
    since_1970 = [(name, s) for name, s in TIMES if SINCE_1970_S[0] <= at_s * s <= SINCE_1970_S[1]]
    if not since_1970 and (apart_s < APART_S or len(steps_s) < 2):
        return None
    likely = [(name, s) for name, s in TIMES if apart_s * s <= LIKELY_APART_S] or [TIMES[-1]]
    name, unit_s = (since_1970 or likely)[0]
    what = f"Epochs are {apart_s:.4g} s apart (median)" if apart_s else "There is one epoch"
    when = f", at times like {at_s:.4g}" if since_1970 else ""
    return unit_s, f"{what}{when}: is time_s in {name}?"


def range_unit(blocks: Sequence[tuple[Floats, Floats]], dimension: int) -> tuple[float, str] | None:
    """(how many times too large, a question) where ranges and anchors have different units; None where they may not.

    blocks: (k, 3) anchors and (k,) ranges of about one place each. Two ranges differ by no more than their anchors are
    apart, and together they are no less; factors of ten or more break that nearly everywhere.
    """
    if not blocks or impossible_share(blocks, dimension, 1.0) <= IMPOSSIBLE:
        return None
    shares = [impossible_share(blocks, dimension, factor) for factor, _, _ in LENGTHS]
    least = int(np.argmin(shares))
    if shares[least] > POSSIBLE:
        return None
    factor, ranges_in, anchors_in = LENGTHS[least]
    asked = " or ".join([word for word in (ranges_in and f"the ranges in {ranges_in}", anchors_in) if word])
    times = f"{1.0 / factor:.0f} times as long as" if factor < 1.0 else f"1/{factor:.0f} of what is"
    return 1.0 / factor, f"The ranges are about {times} possible between these anchors: are {asked}?"


def impossible_share(blocks: Sequence[tuple[Floats, Floats]], dimension: int, factor: float) -> float:
    """Share of pairs of ranges that cannot meet in any point, by a tenth and more."""
    broken = pairs = 0
    for anchors_m, ranges in blocks:
        offset_m = anchors_m[:, None, :dimension] - anchors_m[None, :, :dimension]
        apart_m = np.sqrt((offset_m * offset_m).sum(axis=2))
        ranges_m = factor * ranges
        differ_m = np.abs(ranges_m[:, None] - ranges_m[None, :])
        together_m = ranges_m[:, None] + ranges_m[None, :]
        above = np.triu(apart_m > 0.0, 1)
        pairs += int(above.sum())
        broken += int((above & ((differ_m > 1.1 * apart_m) | (1.1 * together_m < apart_m))).sum())
    return broken / pairs if pairs >= ENOUGH_PAIRS else 0.0
