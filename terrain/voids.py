"""Which posts are unknown: what a file declares, and the fill values it forgot to declare."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import DemUnsupportedError
from .files.raw import RawDem

__all__ = ["implausible_heights", "unknown_posts"]

Numbers = npt.NDArray[Any]
Mask = npt.NDArray[np.bool_]

# the usual fill values of int16 and text DEMs; as exact heights of real ground they practically never occur
CLASSIC_FILLS = (-9999, -32768, -32767, 32767)
# no ground of any body stands 100 km high or deep: ±3.4e38, 1e38, -2147483648 and their like are fill
IMPOSSIBLE_HEIGHT_M = 1.0e5
# share of a number by which it may change where it is rounded to float32
FLOAT32 = 1.2e-7
EARTH_LOWEST_M, EARTH_HIGHEST_M = -500.0, 9000.0


def unknown_posts(
    name: str, raw: RawDem, *, factor: float, offset_m: float, nodata: float | None, may_be_void: bool = False
) -> tuple[Mask, tuple[str, ...]]:
    """Mask (rows, cols) of the posts whose height is unknown, and a warning for each value taken as fill undeclared.

    factor, offset_m: height in metres = value · factor + offset_m; what is plausible is judged on heights.
    nodata: the value that means "unknown" in place of what the file declares; NaN says that only NaN does.
    may_be_void: whether no post needs to be known, as in a window of a file.
    Raises DemUnsupportedError for infinite heights and where no post is known.
    """
    values, warnings = raw.values, list[str]()
    if nodata is None and _all_known(raw, factor, offset_m):
        return np.zeros(values.shape, np.bool_), ()
    if nodata is not None:
        void = _equal(values, nodata)
        if not math.isnan(nodata) and not void.any():
            warnings.append(f"nodata={nodata:g} was given, but no post holds that value.")
    elif raw.declared_void is not None:
        void = raw.declared_void.copy()
    else:
        void = np.zeros(values.shape, np.bool_)
    if values.dtype.kind == "f":
        void |= np.isnan(values)
        infinite = int(np.count_nonzero(np.isinf(values) & ~void))
        if infinite:
            raise DemUnsupportedError(f"{name} holds {infinite:,} infinite heights; give nodata=inf if they are fill.")
    declared = np.count_nonzero(void)
    void, impossible = _also(void, _impossible(values, factor, offset_m))
    if nodata is None and not raw.from_grid:
        void = _with_classic_fills(raw, void, warnings)
    if impossible:
        warnings.append(f"{impossible:,} posts hold heights beyond ±100,000 m: taken as unknown ground.")
    if void.all() and not may_be_void:
        why = ""
        if impossible == void.size - declared > 0:
            why = " Its heights lie beyond ±100,000 m; give height_unit= if they are not in metres."
        raise DemUnsupportedError(f"{name} has no known height: all {void.size:,} posts are void.{why}")
    return void, tuple(warnings)


def _all_known(raw: RawDem, factor: float, offset_m: float) -> bool:
    """Whether lowest and highest value alone tell that nothing is void; False says nothing."""
    if raw.declared_void is not None and raw.declared_void.any():
        return False
    lowest, highest = float(raw.values.min()), float(raw.values.max())
    low, high = _possible(factor, offset_m)
    slack = FLOAT32 * max(abs(lowest), abs(highest))
    among = (lowest - slack <= number <= highest + slack for number in _fills(raw))
    return low <= lowest <= highest <= high and not any(among)  # what is no number is neither above nor below


def _fills(raw: RawDem) -> list[float]:
    """The usual fill values, as they stand in the file or once scaled, each once."""
    pairs = ((float(fill), round((fill - raw.offset) / raw.scale, 6)) for fill in CLASSIC_FILLS)
    return list(dict.fromkeys(number for pair in pairs for number in pair))


def _possible(factor: float, offset_m: float) -> tuple[float, float]:
    """Between which values the height is one that ground may have."""
    low, high = sorted((limit_m - offset_m) / factor for limit_m in (-IMPOSSIBLE_HEIGHT_M, IMPOSSIBLE_HEIGHT_M))
    return low, high


def _impossible(values: Numbers, factor: float, offset_m: float) -> Mask:
    """Where the height is one that no ground has."""
    low, high = _possible(factor, offset_m)
    if values.dtype.kind in "iu":
        kind = np.iinfo(values.dtype)
        low, high = max(low, float(kind.min)), min(high, float(kind.max))
        if (low, high) == (kind.min, kind.max):
            return np.zeros(values.shape, np.bool_)
    with np.errstate(over="ignore"):  # float16 ends before that height, and compares rightly all the same
        return np.asarray((values > high) | (values < low), np.bool_)


def _with_classic_fills(raw: RawDem, void: Mask, warnings: list[str]) -> Mask:
    """The voids and the usual fill values, as they stand in the file or once scaled.

    In integers that are heights as they stand they are fill; else only apart from all other values of the file, since
    scaled or fractional heights may come to such a number by themselves.
    """
    whole = raw.values.dtype.kind in "iu" and (raw.scale, raw.offset) == (1.0, 0.0)
    found: dict[float, Mask] = {}
    for number in _fills(raw):
        there = _equal(raw.values, number) & ~void
        if there.any():
            found[number] = there
    if not found:
        return void
    rest = ~void
    for there in found.values():
        rest &= ~there
    lowest, highest = (raw.values[rest].min(), raw.values[rest].max()) if rest.any() else (0.0, 0.0)
    for number, there in found.items():
        outside = max(float(lowest) - number, number - float(highest))
        count = np.count_nonzero(there)
        said = f"{count:,} posts hold {number:.10g}, a usual fill value that the file does not declare: "
        if whole or not rest.any() or outside > (float(highest) - float(lowest)) / 2.0:
            void = void | there
            warnings.append(f"{said}taken as unknown ground (give nodata=nan to keep them as heights).")
        elif outside > 0.0:
            warnings.append(f"{said}kept as heights, next to the others (give nodata={number:.10g} if they are fill).")
    return void


def implausible_heights(heights_m: npt.NDArray[np.float32]) -> tuple[str, ...]:
    """Warnings about heights that no ground on Earth has: counted, and left as they are."""
    warnings = []
    for count, extreme, words in (
        (np.count_nonzero(heights_m < EARTH_LOWEST_M), np.nanmin(heights_m), f"below {EARTH_LOWEST_M:g} m"),
        (np.count_nonzero(heights_m > EARTH_HIGHEST_M), np.nanmax(heights_m), f"above {EARTH_HIGHEST_M:g} m"),
    ):
        if count:
            warnings.append(
                f"{count:,} posts lie {words} (to {extreme:g} m), where Earth has no ground; they are kept as heights. "
                "Give nodata= if the value means “unknown”, or height_unit= if it is not in metres."
            )
    return tuple(warnings)


def _equal(values: Numbers, fill: float) -> Mask:
    if values.dtype.kind == "f":
        # a fill value written as text reaches a float32 file rounded to float32
        with np.errstate(over="ignore"):
            equal = np.isnan(values) if math.isnan(fill) else values == values.dtype.type(fill)
        return np.asarray(equal, np.bool_)
    if not float(fill).is_integer():
        return np.zeros(values.shape, np.bool_)
    limits = np.iinfo(values.dtype)
    if not limits.min <= fill <= limits.max:
        return np.zeros(values.shape, np.bool_)
    return np.asarray(values == int(fill), np.bool_)


def _also(void: Mask, more: Mask) -> tuple[Mask, int]:
    new = more & ~void
    count = int(np.count_nonzero(new))
    return (void | new if count else void), count
