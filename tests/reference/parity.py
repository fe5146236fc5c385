"""Least squares by the definition, and the search over sets by solving each anew: the slow oracle of the monitor."""

from __future__ import annotations

import itertools

import numpy as np


def residual_statistic(rows, measured, sigmas):
    """(squared length of the weighted residuals, solution) of z = A·x + noise, by numpy's own least squares."""
    a, z = rows / sigmas[:, None], measured / sigmas
    x, _, rank, _ = np.linalg.lstsq(a, z, rcond=None)
    if rank < rows.shape[1]:
        return None
    return float(((z - a @ x) ** 2).sum()), x


def fewest_excluded(rows, measured, sigmas, limits, most):
    """Sets of the least size without which the statistic passes, by statistic; limits[d] by degrees of freedom."""
    count, unknowns = rows.shape
    for size in range(most + 1):
        degrees = count - size - unknowns
        if degrees < 1:
            return size, []
        passing = []
        for left_out in itertools.combinations(range(count), size):
            kept = np.setdiff1d(np.arange(count), left_out)
            found = residual_statistic(rows[kept], measured[kept], sigmas[kept])
            if found is not None and found[0] <= limits[degrees]:
                passing.append((found[0], left_out, found[1]))
        if passing:
            return size, sorted(passing, key=lambda one: one[0])
    return most, []
