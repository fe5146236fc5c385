"""The extended Kalman filter of ranges at constant velocity (De Vivo et al., eqs. 28-35).

The state is east, east rate, north, north rate, up, up rate, and with a clock its offset and drift in metres: 6 or 8
numbers. Noise of the motion is psd (4,): east, north, up, clock.
"""

import math

from compiled.options import scalar_kernel

from .covariance import grow, joseph

__all__ = [
    "CLOCK",
    "EAST",
    "GATED",
    "INNOVATION",
    "LEFT_OUT",
    "LOST",
    "NORTH",
    "REACQUIRED",
    "UP",
    "USED",
    "VARIANCE",
    "VERDICT",
    "advance",
    "range_row",
    "reopen",
    "update_ranges",
]

# places of the state; the rate of each follows it
EAST, NORTH, UP, CLOCK = 0, 2, 4, 6
WITH_CLOCK = 8  # so many numbers
# columns of what was found of a measurement
INNOVATION, VARIANCE, VERDICT = 0, 1, 2


# What became of a measurement.
LEFT_OUT, USED, GATED, REACQUIRED = 0, 1, 2, 3
# A gate that keeps out nearly everything guards a belief that is wrong. Each measurement gated counts one, each used
# takes two away; at this sum the belief is given up.
LOST = 12.0
REOPENED = 24.0  # so many measurements then pass, before the gate is closed again
DRIFTED_S = 10.0


@scalar_kernel
def advance(mean, covariance, step_s, psd):
    """State and covariance after step_s, in place (eqs. 28, 30, 31)."""
    for i in range(0, mean.shape[0], 2):
        mean[i] += step_s * mean[i + 1]
    grow(covariance, step_s, psd)


@scalar_kernel
def range_row(mean, anchor_m, row):
    """Fill row (n,), the Jacobian of the range to anchor_m (3,), and return the range (eqs. 18, 33-35).

    An anchor at the very place has no direction: its row says nothing of the position.
    """
    east, north, up = mean[EAST] - anchor_m[0], mean[NORTH] - anchor_m[1], mean[UP] - anchor_m[2]
    range_m = math.sqrt(east * east + north * north + up * up)
    row[:] = 0.0
    if range_m > 0.0:
        row[EAST], row[NORTH], row[UP] = east / range_m, north / range_m, up / range_m
    if mean.shape[0] == WITH_CLOCK:
        row[CLOCK] = 1.0
        range_m += mean[CLOCK]
    return range_m


@scalar_kernel
def reopen(covariance, off_m2):
    """Widen a belief that is wrong, in place: by as much as it is off, and rates so that they reach that in 10 s."""
    for i in range(covariance.shape[0]):
        covariance[i, i] += off_m2 / (DRIFTED_S * DRIFTED_S) if i % 2 else off_m2


@scalar_kernel
def bend_m2(mean, covariance, anchor_m):
    """What the bend of a range over a wide belief adds to its variance: the square of its second derivative's part."""
    across_m2 = covariance[EAST, EAST] + covariance[NORTH, NORTH] + covariance[UP, UP]
    east, north, up = mean[EAST] - anchor_m[0], mean[NORTH] - anchor_m[1], mean[UP] - anchor_m[2]
    return 0.75 * across_m2 * across_m2 / max(east * east + north * north + up * up, 1e-9)


@scalar_kernel
def update_ranges(mean, covariance, anchors_m, measured_m, variances_m2, gate, found):
    """Correct state and covariance in place by ranges of one instant; fill found (k, 3).

    anchors_m: (k, 3); measured_m: (k,), NaN = not measured; variances_m2: (k,), inf = left out. gate: (squared number
    of sigmas beyond which a single innovation is not believed, inf = none; doubt (1,), in place, see LOST).
    found: INNOVATION, its VARIANCE, and as VERDICT LEFT_OUT, USED, GATED, or REACQUIRED: used by a belief that was
    found wrong. Every range is linearised at the state before the first one, so their order does not matter but for
    the gate.
    """
    n = mean.shape[0]
    squared, doubt = gate
    before, row, gain = mean.copy(), mean.copy(), mean.copy()
    for a in range(anchors_m.shape[0]):
        found[a, INNOVATION], found[a, VARIANCE], found[a, VERDICT] = math.nan, math.nan, LEFT_OUT
        if math.isnan(measured_m[a]) or not variances_m2[a] < math.inf:
            continue
        innovation_m = measured_m[a] - range_row(before, anchors_m[a], row)
        expected_m2 = variances_m2[a]
        for i in range(n):
            innovation_m -= row[i] * (mean[i] - before[i])
            for j in range(n):
                expected_m2 += row[i] * covariance[i, j] * row[j]
        found[a, INNOVATION], found[a, VARIANCE] = innovation_m, expected_m2
        variance_m2, beyond = variances_m2[a], innovation_m * innovation_m > squared * expected_m2
        verdict = USED
        if doubt[0] >= 0.0 and beyond:
            doubt[0] += 1.0
            if doubt[0] < LOST:
                found[a, VERDICT] = GATED
                continue
            reopen(covariance, innovation_m * innovation_m)
            doubt[0] = -REOPENED
            beyond = False
        elif doubt[0] >= 0.0:
            doubt[0] = max(doubt[0] - 2.0, 0.0)
        if doubt[0] < 0.0:
            # found wrong, the belief takes every range, by less the further out, and minds how a wide one is bent
            verdict = REACQUIRED
            doubt[0] += 1.0
            variance_m2 += bend_m2(mean, covariance, anchors_m[a])
            if beyond:
                variance_m2 += innovation_m * innovation_m / squared
        joseph(covariance, row, variance_m2, gain)
        for i in range(n):
            mean[i] += gain[i] * innovation_m
        found[a, VERDICT] = verdict
