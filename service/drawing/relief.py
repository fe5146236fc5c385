"""Rasters at drawing size and their shaded relief."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["Sampling", "mean_heights", "pick", "shaded_relief"]

# A picture needs no more pixels than these along its longer side, and hatching needs at least the smaller number.
MOST_PIXELS = 1400
FEWEST_PIXELS = 700
SUN_AZIMUTH_RAD = math.radians(315.0)
SUN_ELEVATION_RAD = math.radians(45.0)
# Relief is exaggerated until the typical slope looks like this one: plains stay readable, mountains do not clip.
TYPICAL_SLOPE = 0.45


@dataclass(frozen=True, slots=True)
class Sampling:
    """How a grid becomes picture cells: every ``step``-th post, drawn ``repeat`` pixels wide."""

    step: int
    repeat: int

    @classmethod
    def of(cls, shape: tuple[int, int]) -> Sampling:
        """What brings the longer side near the drawing size."""
        longest = max(shape)
        step = math.ceil(longest / MOST_PIXELS)
        return cls(step, max(1, round(FEWEST_PIXELS / max(1, longest // step))))


def pick(array: npt.NDArray[Any], sampling: Sampling) -> npt.NDArray[Any]:
    """Classes of every step-th post, repeated to picture pixels; classes are never averaged."""
    middle = sampling.step // 2
    picked = array[middle :: sampling.step, middle :: sampling.step] if sampling.step > 1 else array
    return repeated(picked, sampling.repeat)


def repeated(array: npt.NDArray[Any], repeat: int) -> npt.NDArray[Any]:
    """Each cell as a square of ``repeat`` pixels."""
    return array if repeat == 1 else array.repeat(repeat, axis=0).repeat(repeat, axis=1)


def mean_heights(heights_m: npt.NDArray[np.float32], step: int) -> npt.NDArray[np.float32]:
    """Mean height of each step × step block that ``pick`` takes a post from; NaN where the block has a NaN post."""
    if step == 1:
        return heights_m
    rows, cols = (len(range(step // 2, n, step)) for n in heights_m.shape)
    padded = np.pad(
        heights_m,
        ((0, max(0, rows * step - heights_m.shape[0])), (0, max(0, cols * step - heights_m.shape[1]))),
        mode="edge",
    )[: rows * step, : cols * step]
    means: npt.NDArray[np.float32] = padded.reshape(rows, step, cols, step).mean(axis=(1, 3), dtype=np.float32)
    return means


def shaded_relief(
    heights_m: npt.NDArray[np.float32], cell_east_m: float, cell_north_m: float
) -> npt.NDArray[np.float32]:
    """Brightness 0..1 of ground lit from the north-west; flat and unknown ground have that of a plain.

    heights_m: (rows, cols), NaN = unknown.
    """
    flat = np.float32(math.sin(SUN_ELEVATION_RAD))
    if min(heights_m.shape) < 2:
        return np.full(heights_m.shape, flat, np.float32)
    down_south, down_east = np.gradient(heights_m, cell_north_m, cell_east_m)
    steepness = np.hypot(down_south, down_east)
    known = steepness[np.isfinite(steepness)]
    typical = float(np.percentile(known, 80)) if known.size else 0.0
    exaggeration = TYPICAL_SLOPE / typical if typical > 0.0 else 1.0
    slope_east, slope_north = down_east * exaggeration, -down_south * exaggeration
    light_east = math.sin(SUN_AZIMUTH_RAD) * math.cos(SUN_ELEVATION_RAD)
    light_north = math.cos(SUN_AZIMUTH_RAD) * math.cos(SUN_ELEVATION_RAD)
    facing = (flat - slope_east * light_east - slope_north * light_north) / np.sqrt(
        1.0 + slope_east * slope_east + slope_north * slope_north
    )
    return np.where(np.isnan(facing), flat, np.clip(facing, 0.0, 1.0)).astype(np.float32)
