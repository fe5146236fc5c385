"""Kernels for what an antenna reaches, and for turning minimum altitudes into visible, hidden and unknown."""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["classify", "raise_to_reach", "upper_bounds", "within_reach"]


@scalar_kernel
def _in_sector(east, north, azimuth_from, azimuth_width):
    if azimuth_width >= 2.0 * math.pi or (east == 0.0 and north == 0.0):
        return True
    return (math.atan2(east, north) - azimuth_from) % (2.0 * math.pi) <= azimuth_width


@scalar_kernel
def _ceiling(distance, limits):
    """Highest altitude above the anchor that range and elevation limits allow; -inf = none."""
    max_range, tan_max = limits[1], limits[5]
    if distance > max_range:
        return -math.inf
    top = math.sqrt(max_range * max_range - distance * distance) if max_range < math.inf else math.inf
    return min(top, tan_max * distance) if tan_max < math.inf else top


@scalar_kernel
def _lowest(distance, rise, limits):
    """Lowest altitude above the anchor, >= rise, that its range and elevation limits allow; inf = none."""
    min_range, max_range, tan_min = limits[0], limits[1], limits[4]
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
    near = limits[0]
    too_near = math.sqrt(near * near - distance * distance) if distance < near else 0.0
    return too_near, _ceiling(distance, limits)


@parallel_kernel
def raise_to_reach(altitude_m, eye, cells_m, limits, drop_per_m2):
    """Raise altitude_m (rows, cols) to the lowest altitude an antenna reaches, in place; +inf = none, NaN stays.

    eye: (row, col, altitude_m); cells_m: (north, east); limits: (min_range_m, max_range_m, azimuth_from_rad,
    azimuth_width_rad, tan of min and of max elevation).
    """
    for row in prange(altitude_m.shape[0]):
        north = (eye[0] - row) * cells_m[0]
        for col in range(altitude_m.shape[1]):
            east = (col - eye[1]) * cells_m[1]
            distance = math.hypot(east, north)
            drop = drop_per_m2 * distance * distance
            value = float(altitude_m[row, col])
            if not _in_sector(east, north, limits[2], limits[3]):
                altitude_m[row, col] = np.float32(math.inf)
            elif not math.isnan(value):
                base = eye[2] + drop
                lowest = _lowest(distance, value - base, limits)
                if lowest != value - base:
                    altitude_m[row, col] = np.float32(base + lowest)


@parallel_kernel
def within_reach(receiver_m, eye, cells_m, limits, drop_per_m2, out):
    """Whether a receiver at altitude receiver_m (rows, cols) is within an antenna's limits, terrain apart."""
    for row in prange(receiver_m.shape[0]):
        north = (eye[0] - row) * cells_m[0]
        for col in range(receiver_m.shape[1]):
            east = (col - eye[1]) * cells_m[1]
            distance = math.hypot(east, north)
            rise = float(receiver_m[row, col]) - drop_per_m2 * distance * distance - eye[2]
            out[row, col] = _in_sector(east, north, limits[2], limits[3]) and _lowest(distance, rise, limits) == rise


@parallel_kernel
def classify(altitude_m, hidden_below_m, receiver_m, out):
    """Fill out (n, rows, cols) for receivers at altitude receiver_m (rows, cols): 1 visible, 0 hidden, 255 unknown."""
    for row in prange(receiver_m.shape[0]):
        for anchor in range(altitude_m.shape[0]):
            for col in range(receiver_m.shape[1]):
                receiver = receiver_m[row, col]
                lowest = altitude_m[anchor, row, col]
                if math.isnan(receiver):
                    out[anchor, row, col] = 255
                elif receiver < hidden_below_m[anchor, row, col]:
                    out[anchor, row, col] = 0
                elif math.isnan(lowest):
                    out[anchor, row, col] = 255
                else:
                    out[anchor, row, col] = 1 if receiver >= lowest else 0
