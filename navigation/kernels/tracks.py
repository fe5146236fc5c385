"""Whole logs of ranges, and many filters side by side."""

from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

from .ranges import advance, update_ranges

__all__ = ["filter_events", "step_many"]


@scalar_kernel
def filter_events(mean, covariance, events, anchors_m, psd, gate, history, found):
    """Take in ranges one by one, each at its own time; mean and covariance end as the last belief.

    events: (times_s (m,), anchor (m,) numbers of rows of anchors_m, measured_m (m,), variances_m2 (m,)); the first time
    is that of the belief or later, none goes backwards. history: (means (m, n), position covariances (m, 3, 3)) after
    each; gate and found (m, 3) as of update_ranges.
    """
    times_s, anchor, measured_m, variances_m2 = events
    means, covariances = history
    for e in range(1, times_s.shape[0]):
        advance(mean, covariance, times_s[e] - times_s[e - 1], psd)
        a = anchor[e]
        last = e + 1
        update_ranges(
            mean, covariance, anchors_m[a : a + 1], measured_m[e:last], variances_m2[e:last], gate, found[e:last]
        )
        means[e] = mean
        for i in range(3):
            for j in range(3):
                covariances[e, i, j] = covariance[2 * i, 2 * j]


@parallel_kernel
def step_many(means, covariances, step_s, psd, anchors_m, ranges, gate, found):
    """Advance s filters by step_s and correct each by its own ranges, in place.

    means: (s, n); covariances: (s, n, n); anchors_m: (k, 3); ranges: (measured_m (s, k), variances_m2 (s, k));
    gate: (squared, doubts (s, 1)); found: (s, k, 3), as of update_ranges.
    """
    measured_m, variances_m2 = ranges
    squared, doubts = gate
    for s in prange(means.shape[0]):
        advance(means[s], covariances[s], step_s, psd)
        own_gate = squared, doubts[s]
        update_ranges(means[s], covariances[s], anchors_m, measured_m[s], variances_m2[s], own_gate, found[s])
