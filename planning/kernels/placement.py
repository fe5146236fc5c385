"""Kernels of anchor placement: what a target is worth to a goal, and what each candidate would add.

A target's state is one row, its columns named below: sums of weighted products of unit directions, of weighted
directions and of weights, the number in sight, the value, and the value while nothing is lost. Anchors are rows of
east, north, altitude, weight. Sight is packed: bit i of row a = anchor a sees target i. aim, targets: ``Aim`` and
``TargetRows`` of planning.placement.judges.
"""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = [
    "COUNT",
    "COVERAGE",
    "DOP",
    "ERROR",
    "HORIZONTAL",
    "INFORMATION",
    "POSITION",
    "STATE_COLUMNS",
    "VALUE",
    "VERTICAL",
    "additions",
    "fill_states",
]

# what a target is worth
COVERAGE, DOP, ERROR, INFORMATION = 0, 1, 2, 3
# which part of the position counts
POSITION, HORIZONTAL, VERTICAL = 0, 1, 2

# columns of a state
EE, EN, EU, NN, NU, UU, SUM_E, SUM_N, SUM_U, SUM, COUNT, VALUE, WHOLE = range(13)
STATE_COLUMNS = 13
# columns of an anchor, of a point and of a normal
EAST, NORTH, UP, WEIGHT = range(4)
# of all targets with one more candidate: their weighted worths added, and the least
TOTAL, LEAST = 0, 1

# a matrix this much flatter than its trace fixes nothing; float64 still tells such determinants from 0
FLATTEST = 1e-12
# prior of the information that greedy collects: without it the first anchor's would be minus infinity
PRIOR = 1e-3


@scalar_kernel
def _without_clock(state):
    """(ee, en, eu, nn, nu, uu) where the receiver's clock is solved for as well."""
    e, n, u, total = state[SUM_E], state[SUM_N], state[SUM_U], max(state[SUM], 1e-300)
    return (
        state[EE] - e * e / total,
        state[EN] - e * n / total,
        state[EU] - e * u / total,
        state[NN] - n * n / total,
        state[NU] - n * u / total,
        state[UU] - u * u / total,
    )


@scalar_kernel
def _variance(state, normal, aim):
    """Sum of variances of the part asked for; +inf where there is no fix."""
    matrix = (state[EE], state[EN], state[EU], state[NN], state[NU], state[UU])
    if aim.clock:
        matrix = _without_clock(state)
    ee, en, eu, nn, nu, uu = matrix
    trace = ee + nn + uu
    if aim.on_surface:
        # sum of the 2 x 2 minors and the determinant of the matrix between two axes of the plane
        along_e = ee * normal[EAST] + en * normal[NORTH] + eu * normal[UP]
        along_n = en * normal[EAST] + nn * normal[NORTH] + nu * normal[UP]
        along_u = eu * normal[EAST] + nu * normal[NORTH] + uu * normal[UP]
        across = normal[EAST] * along_e + normal[NORTH] * along_n + normal[UP] * along_u
        in_plane = trace - across
        det = (
            normal[EAST] * normal[EAST] * (nn * uu - nu * nu)
            + normal[NORTH] * normal[NORTH] * (ee * uu - eu * eu)
            + normal[UP] * normal[UP] * (ee * nn - en * en)
            + 2.0 * normal[EAST] * normal[NORTH] * (eu * nu - en * uu)
            + 2.0 * normal[EAST] * normal[UP] * (en * nu - eu * nn)
            + 2.0 * normal[NORTH] * normal[UP] * (en * eu - ee * nu)
        )
        return in_plane / det if det > FLATTEST * trace * trace and trace > 0.0 else math.inf
    minor_e, minor_n, minor_u = nn * uu - nu * nu, ee * uu - eu * eu, ee * nn - en * en
    det = ee * minor_e - en * (en * uu - nu * eu) + eu * (en * nu - nn * eu)
    if not (det > FLATTEST * trace * trace * trace and trace > 0.0):
        return math.inf
    if aim.part == HORIZONTAL:
        return (minor_e + minor_n) / det
    return (minor_u if aim.part == VERTICAL else minor_e + minor_n + minor_u) / det


@scalar_kernel
def _worth(state, normal, aim):
    """What a target is worth with these anchors in sight."""
    if aim.objective == COVERAGE:
        return 1.0 if state[COUNT] >= aim.needed else 0.0
    if aim.objective == INFORMATION:
        prior = PRIOR * max(state[SUM] / max(state[COUNT], 1.0), 1e-30)
        ee, nn, uu = state[EE] + prior, state[NN] + prior, state[UU] + prior
        en, eu, nu = state[EN], state[EU], state[NU]
        det = ee * (nn * uu - nu * nu) - en * (en * uu - nu * eu) + eu * (en * nu - nn * eu)
        return math.log(max(det, 1e-300) / (prior * prior * prior))
    if state[COUNT] < aim.needed:
        return 0.0 if aim.objective == DOP else -aim.worst_m
    variance = _variance(state, normal, aim)
    if aim.objective == DOP:
        return 1.0 if variance < aim.limit2 else 0.0
    return -min(math.sqrt(variance), aim.worst_m)


@scalar_kernel
def _move(state, point, anchor, sign):
    """Add (+1) or take away (-1) an anchor that is in sight."""
    east, north, up = anchor[EAST] - point[EAST], anchor[NORTH] - point[NORTH], anchor[UP] - point[UP]
    distance2 = east * east + north * north + up * up
    if distance2 == 0.0:
        return
    weight = sign * anchor[WEIGHT] / distance2
    state[EE] += weight * east * east
    state[EN] += weight * east * north
    state[EU] += weight * east * up
    state[NN] += weight * north * north
    state[NU] += weight * north * up
    state[UU] += weight * up * up
    weight = sign * anchor[WEIGHT] / math.sqrt(distance2)
    state[SUM_E] += weight * east
    state[SUM_N] += weight * north
    state[SUM_U] += weight * up
    state[SUM] += sign * anchor[WEIGHT]
    state[COUNT] += sign


@scalar_kernel
def _joined(state, point, anchor, clock):
    """The state with an anchor that is in sight, as a tuple: most candidates come to nothing, and memory costs most."""
    east, north, up = anchor[EAST] - point[EAST], anchor[NORTH] - point[NORTH], anchor[UP] - point[UP]
    distance2 = east * east + north * north + up * up
    weight, scale, total, one = 0.0, 0.0, 0.0, 0.0
    if distance2 != 0.0:
        weight, total, one = anchor[WEIGHT] / distance2, anchor[WEIGHT], 1.0
        scale = total / math.sqrt(distance2) if clock else 0.0
    return (
        state[EE] + weight * east * east,
        state[EN] + weight * east * north,
        state[EU] + weight * east * up,
        state[NN] + weight * north * north,
        state[NU] + weight * north * up,
        state[UU] + weight * up * up,
        state[SUM_E] + scale * east,
        state[SUM_N] + scale * north,
        state[SUM_U] + scale * up,
        state[SUM] + total,
        state[COUNT] + one,
        0.0,
        0.0,
    )


@scalar_kernel
def _sees(bits, anchor, target):
    return (bits[anchor, target >> 6] >> np.uint64(target & 63)) & np.uint64(1) != 0


@scalar_kernel
def _after_loss(state, target, targets, present, present_bits, aim, value, least):
    """What is left of a value after the worst loss of an anchor present; at ``least`` no more losses are looked at.

    ``state`` comes back as it was.
    """
    point, normal = targets.point_m[target], targets.normal[target]
    for a in range(present.shape[0]):
        if value <= least:
            return least
        if _sees(present_bits, a, target):
            _move(state, point, present[a], -1.0)
            value = min(value, _worth(state, normal, aim))
            _move(state, point, present[a], 1.0)
    return max(value, least)


@parallel_kernel
def fill_states(targets, present, present_bits, aim, states):
    """Fill states (m, 13) from the anchors present (k, 4) and their sight (k, words)."""
    loses, least = aim.spare > 0 and aim.objective != INFORMATION, 0.0 if aim.objective == DOP else -aim.worst_m
    for i in prange(states.shape[0]):
        states[i, :] = 0.0
        for a in range(present.shape[0]):
            if _sees(present_bits, a, i):
                _move(states[i], targets.point_m[i], present[a], 1.0)
        value = _worth(states[i], targets.normal[i], aim)
        states[i, VALUE], states[i, WHOLE] = value, value
        if loses:
            states[i, VALUE] = _after_loss(states[i], i, targets, present, present_bits, aim, value, least)


@parallel_kernel
def additions(targets, states, present, present_bits, candidates, bits, aim, out):
    """Fill out (n, 2) with the weighted sum of values and the least value if candidate c (n, 4) were added.

    bits: (n, words) sight of the candidates.
    """
    # with fewer in sight one more changes nothing; information has no such threshold
    least_count = 0.0 if aim.objective == INFORMATION else aim.needed + aim.spare - 1.0
    loses = aim.spare > 0 and aim.objective != INFORMATION
    for c in prange(candidates.shape[0]):
        total, least = 0.0, math.inf
        state = np.empty(STATE_COLUMNS)
        for i in range(states.shape[0]):
            value = states[i, VALUE]
            # what is good stays good: one more anchor takes no information away
            good = aim.objective == DOP and value == 1.0
            if not good and states[i, COUNT] >= least_count and _sees(bits, c, i):
                if not loses:
                    more = _joined(states[i], targets.point_m[i], candidates[c], aim.clock)
                    value = _worth(more, targets.normal[i], aim)
                elif value < states[i, WHOLE]:
                    # the newcomer itself may be the one that is lost, so that nothing is gained over the whole
                    state[:] = states[i]
                    _move(state, targets.point_m[i], candidates[c], 1.0)
                    whole = min(_worth(state, targets.normal[i], aim), states[i, WHOLE])
                    value = _after_loss(state, i, targets, present, present_bits, aim, whole, value)
            total += targets.weight[i] * value
            least = min(least, value)
        out[c, TOTAL], out[c, LEAST] = total, least
