"""How likely the numbers of a depth sensor and the outline of a ball are, and how that changes with the ball."""

import math
from typing import NamedTuple

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["Pixels", "Spread", "sphere_likelihood"]

RADIUS = 3  # of a ball's four numbers, the others are its centre
LEAST = 1e-12  # probability of what the model excludes: an outlier costs no more than this


class Pixels(NamedTuple):
    """Rays (n, 3) with a forward part of 1, numbers (n,) of the sensor, NaN where the pixel is not on the ball."""

    rays: np.ndarray
    numbers: np.ndarray


class Spread(NamedTuple):
    """The sensor's inverse depth offset - step·number, its noise in steps; the outline's blur and margin in radians."""

    offset_per_m: float
    step_per_m: float
    noise_steps: float
    limb_rad: float
    margin_rad: float


@scalar_kernel
def _normal(x):
    """(probability below x, density at x) of the normal distribution."""
    return 0.5 * math.erfc(-x / math.sqrt(2.0)), math.exp(-0.5 * x * x) / math.sqrt(2.0 * math.pi)


@scalar_kernel
def _add(probability, slope, row, score, information):
    """Take one event in: probability, its derivative by a variable, and that variable's by the parameters."""
    p = max(probability, LEAST)
    for i in range(row.shape[0]):
        score[i] += slope / p * row[i]
        for j in range(row.shape[0]):
            information[i, j] += slope * slope / (p * p) * row[i] * row[j]
    return math.log(p)


@scalar_kernel
def sphere_likelihood(pixels, ball, spread, score, information):
    """Log-likelihood of a ball (centre, radius; (4,)); fills score (4,) and information (4, 4), outer products' sum."""
    score[:] = 0.0
    information[:] = 0.0
    row, point = np.zeros(4), np.zeros(3)
    place, radius = ball[:RADIUS], ball[RADIUS]
    square = place[0] ** 2 + place[1] ** 2 + place[2] ** 2
    away, flat = math.sqrt(square), math.sqrt(max(square - radius * radius, 1e-12))
    limb_rad = math.asin(min(radius / away, 1.0))
    total = 0.0
    for n in range(pixels.rays.shape[0]):
        direction, number = pixels.rays[n], pixels.numbers[n]
        length = math.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
        along = direction[0] * place[0] + direction[1] * place[1] + direction[2] * place[2]
        cosine = min(along / (length * away), 1.0)
        angle = math.acos(cosine)
        within = limb_rad - angle
        seen = not math.isnan(number)
        if spread.limb_rad > 0.0 and (not seen or within < 6.0 * spread.limb_rad):
            below, density = _normal(within / spread.limb_rad)
            sine = max(math.sin(angle), 1e-9)
            for i in range(3):
                turn = (place[i] / away * cosine - direction[i] / length) / (away * sine)
                row[i] = -radius * place[i] / (square * flat) - turn
            row[RADIUS] = 1.0 / flat
            sign = 1.0 if seen else -1.0
            total += _add(below if seen else 1.0 - below, sign * density / spread.limb_rad, row, score, information)
        if not seen or within <= spread.margin_rad:
            continue
        inside = along * along - length * length * (square - radius * radius)
        if inside <= 0.0:
            continue
        depth = (along - math.sqrt(inside)) / (length * length)
        slant = 0.0
        for i in range(3):
            point[i] = depth * direction[i] - place[i]
            slant += point[i] * direction[i]
        # 1/z = offset - step·number
        expected = (spread.offset_per_m - 1.0 / depth) / spread.step_per_m
        scale = 1.0 / (depth * depth * spread.step_per_m * slant)
        for i in range(3):
            row[i] = scale * point[i]
        row[RADIUS] = scale * radius
        upper, upper_density = _normal((number + 0.5 - expected) / spread.noise_steps)
        lower, lower_density = _normal((number - 0.5 - expected) / spread.noise_steps)
        slope = (lower_density - upper_density) / spread.noise_steps
        total += _add(upper - lower, slope, row, score, information)
    return total
