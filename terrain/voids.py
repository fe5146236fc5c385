"""Which posts are unknown: what a file declares, and the fill values it forgot to declare."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from .errors import DemUnsupportedError

__all__ = ["implausible_heights", "unknown_posts"]

# the usual fill values of int16 and text DEMs; as exact heights of real ground they practically never occur
CLASSIC_FILLS = (-9999, -32768, -32767, 32767)
# no ground of any body stands 100 km high or deep: ±3.4e38, 1e38, -2147483648 and their like are fill
IMPOSSIBLE_HEIGHT = 1.0e5
EARTH_LOWEST_M, EARTH_HIGHEST_M = -500.0, 9000.0


def unknown_posts(
    name: str,
    values: npt.NDArray[Any],
    declared_void: npt.NDArray[np.bool_] | None,
    *,
    nodata: float | None,
    only_nan: bool,
) -> tuple[npt.NDArray[np.bool_], tuple[str, ...]]:
    """Mask (rows, cols) of the posts whose height is unknown, and a warning for each value taken as fill undeclared.

    nodata: the value that means "unknown" in place of what the file declares; NaN says that only NaN does.
    only_nan: nothing else than NaN was ever meant as fill.
    Raises DemUnsupportedError for infinite heights and where no post is known.
    """
    warnings: list[str] = []
    if nodata is not None:
        void = _equal(values, nodata)
        if not math.isnan(nodata) and not void.any():
            warnings.append(f"nodata={nodata:g} was given, but no post holds that value.")
    elif declared_void is not None:
        void = declared_void.copy()
    else:
        void = np.zeros(values.shape, np.bool_)
    if values.dtype.kind == "f":
        void |= np.isnan(values)
    if nodata is None and not only_nan:
        for fill in CLASSIC_FILLS:
            void, count = _also(void, _equal(values, fill))
            if count:
                warnings.append(
                    f"{count:,} posts hold {fill}, a usual fill value that the file does not declare: taken as unknown "
                    "ground (give nodata=nan to keep them as heights)."
                )
    if values.dtype.itemsize > 2 or values.dtype.kind == "f":
        infinite = int(np.count_nonzero(np.isinf(values) & ~void)) if values.dtype.kind == "f" else 0
        if infinite:
            raise DemUnsupportedError(f"{name} holds {infinite:,} infinite heights; give nodata=inf if they are fill.")
        with np.errstate(over="ignore"):  # float16 ends before that height, and compares rightly all the same
            void, count = _also(void, (values > IMPOSSIBLE_HEIGHT) | (values < -IMPOSSIBLE_HEIGHT))
        if count:
            warnings.append(f"{count:,} posts hold values beyond ±{IMPOSSIBLE_HEIGHT:,.0f}: taken as unknown ground.")
    if void.all():
        raise DemUnsupportedError(f"{name} has no known height: all {void.size:,} posts are void.")
    return void, tuple(warnings)


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


def _equal(values: npt.NDArray[Any], fill: float) -> npt.NDArray[np.bool_]:
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


def _also(void: npt.NDArray[np.bool_], more: npt.NDArray[np.bool_]) -> tuple[npt.NDArray[np.bool_], int]:
    new = more & ~void
    count = int(np.count_nonzero(new))
    return (void | new if count else void), count
