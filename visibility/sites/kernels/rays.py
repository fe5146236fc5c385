"""From every post along one direction at once: how much target ground is in sight.

All posts of a row look along the same direction, so their rays cross each column of posts after the same number of
steps, equally far between two posts of it. One step of all is one pass over rows as they lie in memory.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import float32, prange

from compiled.options import inner_loop, parallel_kernel

__all__ = ["WALL_M", "Ray", "look_along"]

# ground over which nobody sees, as high as float32 has room for its slopes; and the tangent up to it from any eye
WALL_M = np.float32(1e30)
INTO_A_WALL = np.float32(1e12)


class Ray(NamedTuple):
    """A direction: rows per column, the length of a step, m, most steps; a target's height above ground, m.

    spread: how many posts of its column a ray stands for, one step away. drop_per_m2: of the curved ground.
    """

    slope: float
    step_m: float
    most_steps: int
    spread: float
    target_above_m: float
    drop_per_m2: float


class _Step(NamedTuple):
    """Where the rays cross a column (share of the way to the next row), tangents there, posts that each stands for."""

    share: Any
    per_m: Any
    drop: Any
    of_target: Any
    posts: Any


@inner_loop
def _take_step(
    eye_m: np.ndarray,
    upper_m: np.ndarray,
    lower_m: np.ndarray,
    targets: np.ndarray,
    step: _Step,
    horizon: np.ndarray,
    seen: np.ndarray,
) -> None:
    """What of its next column each eye sees over its horizon so far, and the horizon with that column."""
    for i in range(eye_m.size):
        ground_m = upper_m[i] + step.share * (lower_m[i] - upper_m[i])
        tangent = (ground_m - eye_m[i]) * step.per_m - step.drop
        before = horizon[i]
        # an unknown height compares as false: it is not seen, and hides nothing
        clear = tangent + step.of_target >= before and tangent < INTO_A_WALL
        seen[i] += step.posts * targets[i] if clear else float32(0.0)
        horizon[i] = tangent if tangent > before else before


@parallel_kernel
def look_along(eyes_m: np.ndarray, ground_m: np.ndarray, targets: np.ndarray, ray: Ray, seen: np.ndarray) -> None:
    """Add to ``seen`` (rows, cols) float32 how many posts of target ground each eye has in sight along a ray eastward.

    eyes_m: (rows, cols) float32, altitude of the eye over each post. ground_m: the surface, WALL_M where it is taken
    to hide all. targets: (rows, cols) float32, how much each post counts.
    """
    rows, cols = ground_m.shape
    for row in prange(rows):
        horizon = np.full(cols, np.float32(-np.inf), np.float32)
        for number in range(1, min(ray.most_steps, cols - 1) + 1):
            crossed = row + number * ray.slope
            upper = int(np.floor(crossed))
            share = crossed - upper
            lower = upper + 1 if share > 0.0 else upper
            if upper < 0 or lower >= rows:
                break
            nearest = upper if share < 0.5 else lower
            distance_m = number * ray.step_m
            step = _Step(
                float32(share),
                float32(1.0 / distance_m),
                float32(ray.drop_per_m2 * distance_m),
                float32(ray.target_above_m / distance_m),
                float32(number * ray.spread),
            )
            here = cols - number
            _take_step(
                eyes_m[row, :here],
                ground_m[upper, number:],
                ground_m[lower, number:],
                targets[nearest, number:],
                step,
                horizon[:here],
                seen[row, :here],
            )
