"""Covariances: whether one is, how one grows with time, and what one scalar measurement makes of it (Joseph form)."""

import math

from compiled.options import scalar_kernel

__all__ = ["NOT_FINITE", "NOT_POSITIVE", "NOT_SYMMETRIC", "OK", "covariance_fault", "grow", "joseph"]

OK, NOT_FINITE, NOT_SYMMETRIC, NOT_POSITIVE = 0, 1, 2, 3

# of the diagonal: rounding of thousands of steps stays below it, a mistake does not
ROUNDING = 1e-9

# Nobody is lost further than this on a planet that is driven on: beyond it a covariance no longer grows, so that the
# longest outage leaves numbers that the next range (1e-2 m²) can still be told from (1e12 m² · 1e-16).
LARGEST_M = 1e6
LARGEST_M_PER_S = 1e4

# One range makes a variance smaller by no more than this: what rounding leaves of a larger step could be negative.
MOST_AT_ONCE = 1e-12


@scalar_kernel
def covariance_fault(covariance):
    """OK, or why a square matrix (n, n) is no covariance; zero variances are allowed."""
    n = covariance.shape[0]
    for i in range(n):
        for j in range(n):
            if not math.isfinite(covariance[i, j]):
                return NOT_FINITE
    for i in range(n):
        if covariance[i, i] < 0.0:
            return NOT_POSITIVE
        for j in range(i):
            scale = math.sqrt(abs(covariance[i, i] * covariance[j, j]))
            if abs(covariance[i, j] - covariance[j, i]) > ROUNDING * max(scale, 1e-300):
                return NOT_SYMMETRIC
    return OK if _has_root(covariance.copy()) else NOT_POSITIVE


@scalar_kernel
def _has_root(work):
    """Whether a symmetric matrix has a Cholesky root, up to rounding; writes into work."""
    n = work.shape[0]
    for i in range(n):
        if work[i, i] == 0.0:
            for j in range(n):
                if work[i, j] != 0.0:
                    return False
            work[i, i] = 1.0  # a coordinate known for certain: its row is empty and takes no part
        work[i, i] *= 1.0 + ROUNDING
    for j in range(n):
        for k in range(j):
            work[j, j] -= work[j, k] * work[j, k]
        if not work[j, j] > 0.0:
            return False
        work[j, j] = math.sqrt(work[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                work[i, j] -= work[i, k] * work[j, k]
            work[i, j] /= work[j, j]
    return True


@scalar_kernel
def grow(covariance, step_s, psd):
    """Covariance (n, n) after step_s at constant velocity, in place: F·P·Fᵀ + Q (De Vivo et al., eqs. 30, 31).

    The state is pairs of a coordinate and its rate; psd: (at least n / 2,) of the rates' white noise, per pair. What
    would pass LARGEST_M or LARGEST_M_PER_S is scaled back, correlations kept.
    """
    n = covariance.shape[0]
    for i in range(0, n, 2):
        for j in range(n):
            covariance[i, j] += step_s * covariance[i + 1, j]
    for j in range(0, n, 2):
        for i in range(n):
            covariance[i, j] += step_s * covariance[i, j + 1]
    for i in range(0, n, 2):
        q = psd[i // 2]
        half = q * step_s * step_s / 2.0
        covariance[i, i] += q * step_s * step_s * step_s / 3.0
        covariance[i, i + 1] += half
        covariance[i + 1, i] += half
        covariance[i + 1, i + 1] += q * step_s
    for i in range(n):
        largest = LARGEST_M if i % 2 == 0 else LARGEST_M_PER_S
        if not covariance[i, i] <= largest * largest:
            scale = largest / math.sqrt(covariance[i, i])
            for j in range(n):
                covariance[i, j] *= scale
                covariance[j, i] *= scale


@scalar_kernel
def joseph(covariance, row, variance_m2, gain):
    """Correct covariance (n, n) in place for a measurement row·x, fill gain (n,); returns the innovation's variance.

    Joseph form, (I − K·H)·P·(I − K·H)ᵀ + K·R·Kᵀ: symmetric and positive whatever the rounding of the gain.
    """
    n = covariance.shape[0]
    expected_m2 = 0.0
    for i in range(n):
        gain[i] = 0.0
        for j in range(n):
            gain[i] += covariance[i, j] * row[j]
        expected_m2 += row[i] * gain[i]
    variance_m2 = max(variance_m2, MOST_AT_ONCE * expected_m2)
    innovation_m2 = expected_m2 + variance_m2
    for i in range(n):
        gain[i] /= innovation_m2
    # A = (I − K·H)·P, row by row; then A·(I − K·H)ᵀ + K·R·Kᵀ
    for j in range(n):
        seen = 0.0
        for i in range(n):
            seen += row[i] * covariance[i, j]
        for i in range(n):
            covariance[i, j] -= gain[i] * seen
    for i in range(n):
        seen = 0.0
        for j in range(n):
            seen += covariance[i, j] * row[j]
        for j in range(n):
            covariance[i, j] += (variance_m2 * gain[i] - seen) * gain[j]
    for i in range(n):
        for j in range(i):
            middle = 0.5 * (covariance[i, j] + covariance[j, i])
            covariance[i, j] = middle
            covariance[j, i] = middle
    return innovation_m2
