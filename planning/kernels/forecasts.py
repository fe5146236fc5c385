"""What a map foretells of a few lines, and where a few ranges meet: one call each, where numpy would take dozens."""

import math

import numpy as np

from compiled.options import scalar_kernel

__all__ = ["DIRECT", "IN_SIGHT", "free_place", "line_odds"]

# columns of what is found of lines
IN_SIGHT, DIRECT = 0, 1
RIDGE = 1e-9  # keeps a system solvable that says nothing of an axis; its variance is then told as huge


@scalar_kernel
def line_odds(clearance_m, away_m, reach_m, errors, found):
    """Fill found (n, 2): probability that each line is clear, IN_SIGHT, and that it is or is bent by little, DIRECT.

    away_m: how far from the rover the least clearance is; reach_m: how long each line is. errors: (sigma of the
    ground's heights, distance over which they are alike, how much too long a range may be), metres. NaN stays NaN.
    """
    dem_sigma_m, correlation_m, excess_m = errors
    for i in range(clearance_m.shape[0]):
        lifted = 1.0 - away_m[i] / max(reach_m[i], 1e-9)
        alike = math.exp(-away_m[i] / correlation_m)
        # under the rover itself nothing errs; what is left keeps the division honest
        variance = max(1.0 + lifted * (lifted - 2.0 * alike), 1e-4)
        scale = -1.0 / (dem_sigma_m * math.sqrt(2.0 * variance))
        harmless_m = math.sqrt(max(2.0 * excess_m * away_m[i] * lifted, 0.0))
        found[i, IN_SIGHT] = 0.5 * math.erfc(clearance_m[i] * scale)
        found[i, DIRECT] = 0.5 * math.erfc((clearance_m[i] + harmless_m) * scale)


@scalar_kernel
def free_place(anchors_m, ranges_m, sigmas_m, over, steps, place_m):
    """(worst variance of the height over, largest part of the last step, sum of squared misfits, in sigmas).

    Moves place_m (3,) to where the ranges (n,) to anchors (n, 3) meet, in so many steps. over (3,): gradient of the
    height over the ground.
    """
    n = ranges_m.shape[0]
    variance_m2, largest_m, misfit2 = 0.0, 0.0, 0.0
    row = np.empty(3)
    for _ in range(steps):
        normal, pulled = RIDGE * np.eye(3), np.zeros(3)
        misfit2 = 0.0
        for i in range(n):
            length2 = 0.0
            for a in range(3):
                row[a] = place_m[a] - anchors_m[i, a]
                length2 += row[a] * row[a]
            distance_m = max(math.sqrt(length2), 1e-6)
            for a in range(3):
                row[a] /= distance_m * sigmas_m[i]
            misfit = (ranges_m[i] - distance_m) / sigmas_m[i]
            misfit2 += misfit * misfit
            for a in range(3):
                pulled[a] += row[a] * misfit
                for b in range(3):
                    normal[a, b] += row[a] * row[b]
        # near the anchors' plane ranges know a height worse than above it: the worst on the way counts
        variance_m2 = max(variance_m2, np.dot(over, np.linalg.solve(normal, over)))
        step_m = np.linalg.solve(normal, pulled)
        place_m += step_m
        largest_m = np.max(np.abs(step_m))
    return variance_m2, largest_m, misfit2
