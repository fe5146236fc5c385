"""Kernels for what an antenna reaches, and for turning minimum altitudes into visible, hidden and unknown."""

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["LIMIT_FIELDS", "Limits", "classify", "hide_beyond_reach", "raise_to_reach", "upper_bounds"]

# share of a squared distance that is more than its rounding
SPARE = 1e-9


class Limits(NamedTuple):
    """What an antenna reaches: ranges, m; azimuth from where and how far round, rad; tan of the elevations."""

    min_range_m: float
    max_range_m: float
    azimuth_from_rad: float
    azimuth_width_rad: float
    tan_min_elevation: float
    tan_max_elevation: float


# the antennas of several anchors: one record each, read by the same names
LIMIT_FIELDS = np.dtype([(name, np.float64) for name in Limits._fields])


@scalar_kernel
def _in_sector(east, north, limits):
    if limits.azimuth_width_rad >= 2.0 * math.pi or (east == 0.0 and north == 0.0):
        return True
    return (math.atan2(east, north) - limits.azimuth_from_rad) % (2.0 * math.pi) <= limits.azimuth_width_rad


@scalar_kernel
def _ceiling(distance, limits):
    """Highest altitude above the anchor that range and elevation limits allow; -inf = none."""
    max_range, tan_max = limits.max_range_m, limits.tan_max_elevation
    if distance > max_range:
        return -math.inf
    top = math.sqrt(max_range * max_range - distance * distance) if max_range < math.inf else math.inf
    return min(top, tan_max * distance) if tan_max < math.inf else top


@scalar_kernel
def _lowest(distance, rise, limits):
    """Lowest altitude above the anchor, >= rise, that its range and elevation limits allow; inf = none."""
    min_range, max_range, tan_min = limits.min_range_m, limits.max_range_m, limits.tan_min_elevation
    if distance > max_range:
        return math.inf
    if max_range < math.inf:
        rise = max(rise, -math.sqrt(max_range * max_range - distance * distance))
    if tan_min > -math.inf:
        rise = max(rise, tan_min * distance)
    if distance < min_range:
        too_near = math.sqrt(min_range * min_range - distance * distance)
        if abs(rise) < too_near:
            rise = too_near
    return rise if rise <= _ceiling(distance, limits) else math.inf


@scalar_kernel
def upper_bounds(distance, limits):
    """(half the height of the air too near an anchor, highest altitude it reaches), both counted from the anchor's."""
    near = limits.min_range_m
    too_near = math.sqrt(near * near - distance * distance) if distance < near else 0.0
    return too_near, _ceiling(distance, limits)


@scalar_kernel
def _ranges(limits):
    """(from, to, beyond), m²: squared distances surely within the ranges of an antenna, and surely beyond.

    Surely: rounding cannot make it otherwise. Nothing is where its angles are limited too.
    """
    angles = limits.tan_min_elevation > -math.inf or limits.tan_max_elevation < math.inf
    if angles or limits.azimuth_width_rad < 2.0 * math.pi:
        return math.inf, -math.inf, math.inf
    near, far = limits.min_range_m * limits.min_range_m, limits.max_range_m * limits.max_range_m
    return near * (1.0 + SPARE), far * (1.0 - SPARE), far * (1.0 + SPARE)


@parallel_kernel
def raise_to_reach(altitude_m, eye, cells_m, limits, drop_per_m2):
    """Raise altitude_m (rows, cols) to the lowest altitude an antenna reaches, in place; +inf = none, NaN stays.

    eye: a GridPoint (crossings); cells_m: (east, north); limits: of its antenna.
    """
    cell_east_m, cell_north_m = cells_m
    near, far, beyond = _ranges(limits)
    for row in prange(altitude_m.shape[0]):
        north = (eye.row - row) * cell_north_m
        for col in range(altitude_m.shape[1]):
            east = (col - eye.col) * cell_east_m
            value = float(altitude_m[row, col])
            flat = east * east + north * north
            rise = value - eye.altitude_m - drop_per_m2 * flat
            if near <= flat + rise * rise <= far:
                continue
            if flat > beyond:
                if not math.isnan(value):
                    altitude_m[row, col] = np.float32(math.inf)
                continue
            distance = math.hypot(east, north)
            drop = drop_per_m2 * distance * distance
            if not _in_sector(east, north, limits):
                altitude_m[row, col] = np.float32(math.inf)
            elif not math.isnan(value):
                base = eye.altitude_m + drop
                lowest = _lowest(distance, value - base, limits)
                if lowest != value - base:
                    altitude_m[row, col] = np.float32(base + lowest)


@parallel_kernel
def hide_beyond_reach(base_m, above_m, eye, cells_m, limits, drop_per_m2, out):
    """Set out (rows, cols) to 0 where a receiver so far above a known base_m is beyond an antenna's limits."""
    cell_east_m, cell_north_m = cells_m
    near, far, beyond = _ranges(limits)
    for row in prange(base_m.shape[0]):
        north = (eye.row - row) * cell_north_m
        for col in range(base_m.shape[1]):
            receiver = base_m[row, col] + above_m
            if out[row, col] == 0 or math.isnan(receiver):
                continue
            east = (col - eye.col) * cell_east_m
            flat = east * east + north * north
            rise = float(receiver) - eye.altitude_m - drop_per_m2 * flat
            if near <= flat + rise * rise <= far:
                continue
            if flat > beyond:
                out[row, col] = 0
                continue
            distance = math.hypot(east, north)
            rise = float(receiver) - drop_per_m2 * distance * distance - eye.altitude_m
            if not (_in_sector(east, north, limits) and _lowest(distance, rise, limits) == rise):
                out[row, col] = 0


@parallel_kernel
def classify(altitude_m, hidden_below_m, base_m, above_m, out):
    """Fill out (n, rows, cols): 1 visible, 0 hidden, 255 unknown, for receivers so far above base_m (rows, cols)."""
    for row in prange(base_m.shape[0]):
        for anchor in range(altitude_m.shape[0]):
            for col in range(base_m.shape[1]):
                receiver = base_m[row, col] + above_m
                lowest = altitude_m[anchor, row, col]
                if math.isnan(receiver):
                    out[anchor, row, col] = 255
                elif receiver < hidden_below_m[anchor, row, col]:
                    out[anchor, row, col] = 0
                elif math.isnan(lowest):
                    out[anchor, row, col] = 255
                else:
                    out[anchor, row, col] = 1 if receiver >= lowest else 0
