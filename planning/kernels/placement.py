"""Kernels of anchor placement: what a target is worth to a goal, and what each candidate would add.

A target's state is one row: ee, en, eu, nn, nu, uu (sum of weighted products of unit directions), e, n, u (sum of
weighted directions), sum of weights, number in sight, value. Anchors are rows of east, north, altitude, weight. Sight
is packed: bit i of row a = anchor a sees target i.
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
    "keep_in_range",
    "weight_under_mask",
]

# what a target is worth
COVERAGE, DOP, ERROR, INFORMATION = 0, 1, 2, 3
# which part of the position counts
POSITION, HORIZONTAL, VERTICAL = 0, 1, 2

STATE_COLUMNS, COUNT, VALUE = 12, 10, 11

# a matrix this much flatter than its trace fixes nothing; float64 still tells such determinants from 0
FLATTEST = 1e-12
# prior of the information that greedy collects: without it the first anchor's would be minus infinity
PRIOR = 1e-3


@scalar_kernel
def _without_clock(state):
    """(ee, en, eu, nn, nu, uu) where the receiver's clock is solved for as well."""
    e, n, u, total = state[6], state[7], state[8], max(state[9], 1e-300)
    return (
        state[0] - e * e / total,
        state[1] - e * n / total,
        state[2] - e * u / total,
        state[3] - n * n / total,
        state[4] - n * u / total,
        state[5] - u * u / total,
    )


@scalar_kernel
def _variance(state, normal, clock, part, on_surface):
    """Sum of variances of the part asked for; +inf where there is no fix."""
    matrix = (state[0], state[1], state[2], state[3], state[4], state[5])
    if clock:
        matrix = _without_clock(state)
    ee, en, eu, nn, nu, uu = matrix
    trace = ee + nn + uu
    if on_surface:
        # sum of the 2 x 2 minors and the determinant of the matrix between two axes of the plane
        along_e = ee * normal[0] + en * normal[1] + eu * normal[2]
        along_n = en * normal[0] + nn * normal[1] + nu * normal[2]
        along_u = eu * normal[0] + nu * normal[1] + uu * normal[2]
        across = normal[0] * along_e + normal[1] * along_n + normal[2] * along_u
        in_plane = trace - across
        det = (
            normal[0] * normal[0] * (nn * uu - nu * nu)
            + normal[1] * normal[1] * (ee * uu - eu * eu)
            + normal[2] * normal[2] * (ee * nn - en * en)
            + 2.0 * normal[0] * normal[1] * (eu * nu - en * uu)
            + 2.0 * normal[0] * normal[2] * (en * nu - eu * nn)
            + 2.0 * normal[1] * normal[2] * (en * eu - ee * nu)
        )
        return in_plane / det if det > FLATTEST * trace * trace and trace > 0.0 else math.inf
    minor_e, minor_n, minor_u = nn * uu - nu * nu, ee * uu - eu * eu, ee * nn - en * en
    det = ee * minor_e - en * (en * uu - nu * eu) + eu * (en * nu - nn * eu)
    if not (det > FLATTEST * trace * trace * trace and trace > 0.0):
        return math.inf
    if part == HORIZONTAL:
        return (minor_e + minor_n) / det
    return (minor_u if part == VERTICAL else minor_e + minor_n + minor_u) / det


@scalar_kernel
def _worth(state, normal, question):
    """What a target is worth with these anchors in sight.

    question: (objective, needed, limit², clock, part, on surface, spare, worst counted).
    """
    objective, needed, limit2, clock, part, on_surface, _, worst = question
    if objective == COVERAGE:
        return 1.0 if state[COUNT] >= needed else 0.0
    if objective == INFORMATION:
        prior = PRIOR * max(state[9] / max(state[COUNT], 1.0), 1e-30)
        ee, nn, uu = state[0] + prior, state[3] + prior, state[5] + prior
        en, eu, nu = state[1], state[2], state[4]
        det = ee * (nn * uu - nu * nu) - en * (en * uu - nu * eu) + eu * (en * nu - nn * eu)
        return math.log(max(det, 1e-300) / (prior * prior * prior))
    if state[COUNT] < needed:
        return 0.0 if objective == DOP else -worst
    variance = _variance(state, normal, clock, part, on_surface)
    if objective == DOP:
        return 1.0 if variance < limit2 else 0.0
    return -min(math.sqrt(variance), worst)


@scalar_kernel
def _move(state, point, anchor, sign):
    """Add (+1) or take away (-1) an anchor that is in sight."""
    east, north, up = anchor[0] - point[0], anchor[1] - point[1], anchor[2] - point[2]
    distance2 = east * east + north * north + up * up
    if distance2 == 0.0:
        return
    weight = sign * anchor[3] / distance2
    state[0] += weight * east * east
    state[1] += weight * east * north
    state[2] += weight * east * up
    state[3] += weight * north * north
    state[4] += weight * north * up
    state[5] += weight * up * up
    weight = sign * anchor[3] / math.sqrt(distance2)
    state[6] += weight * east
    state[7] += weight * north
    state[8] += weight * up
    state[9] += sign * anchor[3]
    state[COUNT] += sign


@scalar_kernel
def _sees(bits, anchor, target):
    return (bits[anchor, target >> 6] >> np.uint64(target & 63)) & np.uint64(1) != 0


@scalar_kernel
def _worth_after_loss(state, target, cells, present, present_bits, question):
    """The same, after the worst loss where one anchor may be lost; ``state`` comes back as it was."""
    point, normal = cells[0][target], cells[1][target]
    value = _worth(state, normal, question)
    if question[6] == 0 or question[0] == INFORMATION:
        return value
    for a in range(present.shape[0]):
        if _sees(present_bits, a, target):
            _move(state, point, present[a], -1.0)
            value = min(value, _worth(state, normal, question))
            _move(state, point, present[a], 1.0)
    return value


@parallel_kernel
def fill_states(cells, present, present_bits, question, states):
    """Fill states (m, 12) from the anchors present (k, 4) and their sight (k, words).

    cells: (point (m, 3), unit normal (m, 3), weight (m,)).
    """
    for i in prange(states.shape[0]):
        states[i, :] = 0.0
        for a in range(present.shape[0]):
            if _sees(present_bits, a, i):
                _move(states[i], cells[0][i], present[a], 1.0)
        states[i, VALUE] = _worth_after_loss(states[i], i, cells, present, present_bits, question)


@parallel_kernel
def additions(cells, states, present, present_bits, candidates, bits, question, out):
    """Fill out (n, 2) with the weighted sum of values and the least value if candidate c (n, 4) were added.

    bits: (n, words) sight of the candidates.
    """
    targets = states.shape[0]
    # with fewer in sight one more changes nothing; information has no such threshold
    least_count = 0.0 if question[0] == INFORMATION else question[1] + question[6] - 1.0
    for c in prange(candidates.shape[0]):
        total, least, before = 0.0, math.inf, 0.0
        state = np.empty(STATE_COLUMNS)
        for i in range(targets):
            value = states[i, VALUE]
            # what is good stays good: one more anchor takes no information away
            good = question[0] == DOP and value == 1.0
            if not good and states[i, COUNT] >= least_count and _sees(bits, c, i):
                state[:] = states[i]
                if question[6] != 0:
                    before = _worth(state, cells[1][i], question)
                _move(state, cells[0][i], candidates[c], 1.0)
                value = _worth_after_loss(state, i, cells, present, present_bits, question)
                if question[6] != 0:
                    value = min(value, before)  # the newcomer itself may be the one that is lost
            total += cells[2][i] * value
            least = min(least, value)
        out[c, 0], out[c, 1] = total, least


@scalar_kernel
def _ones(word):
    """How many bits of a word are set."""
    word -= (word >> np.uint64(1)) & np.uint64(0x5555555555555555)
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return (word * np.uint64(0x0101010101010101)) >> np.uint64(56)


@parallel_kernel
def weight_under_mask(bits, which, mask, weight, out):
    """Fill out (r,) with the weight of the targets in mask (words,) that each row bits[which[r]] sees.

    weight: (m,), or (0,) where every target counts 1.
    """
    for r in prange(which.shape[0]):
        row = bits[which[r]]
        total = 0.0
        if weight.shape[0] == 0:
            ones = np.uint64(0)
            for w in range(mask.shape[0]):
                ones += _ones(row[w] & mask[w])
            total = float(ones)
        else:
            for w in range(mask.shape[0]):
                word = row[w] & mask[w]
                if word != 0:
                    for b in range(min(64, weight.shape[0] - 64 * w)):
                        if (word >> np.uint64(b)) & np.uint64(1) != 0:
                            total += weight[64 * w + b]
        out[r] = total


@parallel_kernel
def keep_in_range(seen, place_m, point_m, max_range_m, drop_per_m2):
    """Clear seen (n, m) bool where a target (m, 3) is further from an anchor (n, 3) than its longest slant range.

    drop_per_m2: curvature, as for antenna limits: ground at distance d lies d² times that lower.
    """
    for i in prange(point_m.shape[0]):
        for a in range(place_m.shape[0]):
            east, north = point_m[i, 0] - place_m[a, 0], point_m[i, 1] - place_m[a, 1]
            across2 = east * east + north * north
            up = point_m[i, 2] - drop_per_m2 * across2 - place_m[a, 2]
            if across2 + up * up > max_range_m * max_range_m:
                seen[a, i] = False
