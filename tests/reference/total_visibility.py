"""How many target posts each post sees, by marching one ray after the other; no code of ours."""

import math

import numpy as np


def seen_posts(heights_m, targets, site_m, target_m, cell_m, directions, max_range_m, drop_per_m2, unknown_hides):
    """(rows, cols): the posts of targets (0 or 1 each) in sight of each post, itself among them; NaN over unknown ones.

    Each ray of a quarter crosses one column (row) of posts after the other, stands there for its share of the posts
    between the quarter's diagonals, and sees the ground on the straight line between the two posts beside it.
    """
    rows, cols = heights_m.shape
    each = directions // 4
    found = np.full((rows, cols), np.nan)
    for row in range(rows):
        for col in range(cols):
            if math.isnan(heights_m[row, col]):
                continue
            eye_m = heights_m[row, col] + site_m
            found[row, col] = targets[row, col]
            for number in range(each):
                slope = (2 * number + 1) / each - 1
                for along_row, sign in ((True, 1), (True, -1), (False, 1), (False, -1)):
                    found[row, col] += _ray(
                        heights_m, targets, row, col, eye_m, target_m, cell_m, slope, along_row, sign,
                        2 / each, max_range_m, drop_per_m2, unknown_hides,
                    )  # fmt: skip
    return found


def _ray(
    heights_m, targets, row, col, eye_m, target_m, cell_m, slope, along_row, sign, spread, max_range_m, drop_per_m2,
    unknown_hides,
):  # fmt: skip
    east_m, north_m = cell_m
    step_m = math.hypot(east_m, slope * north_m) if along_row else math.hypot(north_m, slope * east_m)
    horizon, seen, step = -math.inf, 0.0, 0
    while True:
        step += 1
        if step * step_m > max_range_m:
            return seen
        main = (col if along_row else row) + sign * step
        side = (row if along_row else col) + step * slope
        low = math.floor(side)
        high = low if side == low else low + 1
        if not 0 <= main < heights_m.shape[1 if along_row else 0]:
            return seen
        if low < 0 or high >= heights_m.shape[0 if along_row else 1]:
            return seen
        one, other = ((low, main), (high, main)) if along_row else ((main, low), (main, high))
        nearest = one if side - low < 0.5 else other
        ground_m = heights_m[one] + (side - low) * (heights_m[other] - heights_m[one])
        if math.isnan(ground_m):
            if unknown_hides:
                return seen
            continue
        distance_m = step * step_m
        tangent = (ground_m - eye_m) / distance_m - drop_per_m2 * distance_m
        if tangent + target_m / distance_m >= horizon:
            seen += step * spread * targets[nearest]
        horizon = max(horizon, tangent)
