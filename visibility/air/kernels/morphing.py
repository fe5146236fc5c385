"""The morphing map's kernel: where in each column of air the dilution of precision stays below a limit.

A stretch of air is decided at once where a bound allows it, else cut. The bound: let A be the geometry matrix of a set
of anchors, b ≥ |dA/dz|, and P the position dilution. Then |d(1/P)/dz| ≤ b, and every other dilution D, of the
position's parts, the clock or everything, has |d(ln D)/dz| ≤ b·P. (D² = tr(S·N·Sᵀ) with N = (AᵀA)⁻¹; its derivative is
−2·tr(S·N·Aᵀ·A'·N·Sᵀ), at most 2·|A·N·Sᵀ|·b·|N·Sᵀ| in Frobenius norms over the position's columns: the first is D, the
last at most P·D.) A set that more anchors join only gets better, so a stretch over which the set changes is flyable
where the anchors seen throughout suffice, and not where all that are seen at some altitude of it do not. Nothing
thicker than the resolution is missed, however a dilution peaks.

Two kinds of columns have faster solvers: PDOP of ranges from anchors (pdop_columns), distant anchors (distant_columns).
"""

import math

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.air.kernels.column_findings import (
    ABOVE,
    CLOSED_AT_CEILING,
    EVERYWHERE,
    FLYABLE,
    NOT_FLYABLE,
    NOTHING_FOUND,
    NOWHERE,
    OUTSIDE,
    UNDECIDED,
    UNKNOWN,
    conclude,
    note,
)
from visibility.air.kernels.columns import (
    COLUMN_ROWS,
    MAYBE,
    SURE,
    count_of,
    fill_column,
    next_split,
    same_set,
    set_between,
    steepness,
)
from visibility.air.kernels.distant_columns import solve_distant
from visibility.air.kernels.pdop_columns import solve_pdop
from visibility.dilution.kernels.dilution import PDOP, dilutions, never_a_fix
from visibility.dilution.kernels.dop import RANGING

__all__ = [
    "ABOVE",
    "CLOSED_AT_CEILING",
    "EVERYWHERE",
    "FLYABLE",
    "NOT_FLYABLE",
    "NOWHERE",
    "OUTSIDE",
    "UNKNOWN",
    "morphing_columns",
]

ROOT_TOLERANCE_M = 1e-4
GREATEST_LIMIT = 1e4  # on PDOP, up to which the digits of a determinant suffice
MOST_STEPS = 100  # far more than the halving of weights ever needs


@scalar_kernel
def _bounds(table, words, low, high, point, question):
    """(least, greatest) value of the dilution of a set from low to high; point carries the column's position."""
    sources, kind, measure, _, _, _ = question
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    value, position = dilutions((point[0], point[1], middle), sources, words, kind, measure)
    first, _ = steepness(table, words, low, high)
    if first == 0.0:
        return value, value
    turn = first * half
    if math.isinf(position):
        if measure <= PDOP:
            return 1.0 / turn, math.inf
        return (math.inf if never_a_fix(point, sources, words) else 0.0), math.inf
    share = turn * position
    least = position / (1.0 + share) if measure <= PDOP else 0.0
    if share < 1.0:
        return max(least, value * (1.0 - share)), value / (1.0 - share)
    return least, math.inf


@scalar_kernel
def _suffices(words, greatest, question):
    return greatest < question[3] and count_of(words) >= question[4]


@scalar_kernel
def _judge(table, sets, low, high, point, question, known):
    """FLYABLE, NOT_FLYABLE, UNKNOWN or UNDECIDED, of all air from low to high; fills sets (4, words)."""
    limit, needed = question[3], question[4]
    set_between(table, low, high, SURE, True, sets[0])
    set_between(table, low, high, SURE, False, sets[1])
    if known:
        sets[2, :], sets[3, :] = sets[0], sets[1]
    else:
        set_between(table, low, high, MAYBE, True, sets[2])
        set_between(table, low, high, MAYBE, False, sets[3])
    if count_of(sets[3]) < needed:
        return NOT_FLYABLE
    least, greatest = 0.0, math.inf
    if count_of(sets[0]) >= needed:
        least, greatest = _bounds(table, sets[0], low, high, point, question)
        if greatest < limit:
            return FLYABLE
    if not same_set(sets[0], sets[3]):
        least, _ = _bounds(table, sets[3], low, high, point, question)
    if least >= limit:
        return NOT_FLYABLE
    if known or not _suffices(sets[2], _bounds(table, sets[2], low, high, point, question)[1], question):
        return UNDECIDED
    if count_of(sets[1]) < needed or _bounds(table, sets[1], low, high, point, question)[0] >= limit:
        return UNKNOWN
    return UNDECIDED


@scalar_kernel
def _judge_at(table, sets, altitude, point, question):
    """FLYABLE, NOT_FLYABLE or UNKNOWN at one altitude."""
    sources, kind, measure, _, _, _ = question
    at = (point[0], point[1], altitude)
    set_between(table, altitude, altitude, SURE, True, sets[0])
    if _suffices(sets[0], dilutions(at, sources, sets[0], kind, measure)[0], question):
        return FLYABLE
    set_between(table, altitude, altitude, MAYBE, True, sets[0])
    if _suffices(sets[0], dilutions(at, sources, sets[0], kind, measure)[0], question):
        return UNKNOWN
    return NOT_FLYABLE


@scalar_kernel
def _only_crossing(table, words, low, high, point, question):
    """Altitude at which the position dilution of one set passes the limit; NaN unless it provably does exactly once.

    With y = 1/P: |y''| ≤ 5·b²·P + c. By the mean value theorem some altitude has the slope of the chord, so none has
    slope 0 where the chord's is steeper than that bound times the stretch.
    """
    sources, kind, _, limit, _, _ = question
    first, second = steepness(table, words, low, high)
    width = high - low
    _, position = dilutions((point[0], point[1], 0.5 * (low + high)), sources, words, kind, PDOP)
    share = 0.5 * first * width * position
    if not share < 0.5:
        return math.nan
    bend = 5.0 * first * first * position / (1.0 - share) + second
    if bend * width > 0.5 * first:
        return math.nan
    at_low = 1.0 / dilutions((point[0], point[1], low), sources, words, kind, PDOP)[1] - 1.0 / limit
    at_high = 1.0 / dilutions((point[0], point[1], high), sources, words, kind, PDOP)[1] - 1.0 / limit
    if not (at_low * at_high < 0.0 and abs(at_high - at_low) > bend * width * width):
        return math.nan
    side = 0
    for _ in range(MOST_STEPS):
        if high - low <= ROOT_TOLERANCE_M:
            break
        # regula falsi that halves the weight of an end that stays (Illinois), safe at the rounding of a flat end
        cut = min(max((low * at_high - high * at_low) / (at_high - at_low), low), high)
        value = 1.0 / dilutions((point[0], point[1], cut), sources, words, kind, PDOP)[1] - 1.0 / limit
        if value == 0.0 or cut <= low or cut >= high:
            return cut
        if (value > 0.0) == (at_high > 0.0):
            high, at_high = cut, value
            at_low *= 0.5 if side == 1 else 1.0
            side = 1
        else:
            low, at_low = cut, value
            at_high *= 0.5 if side == -1 else 1.0
            side = -1
    return 0.5 * (low + high)


@scalar_kernel
def _solve(table, sets, stack, air, point, question, known):
    """(altitude, altitude above which all is flyable for certain, state, no-flight intervals) of one column.

    air: (ground, ceiling); stack: (n, 2) scratch.
    """
    ground, ceiling = air
    measure, resolution = question[2], question[5]
    found = NOTHING_FOUND
    stack[0, 0], stack[0, 1] = ground, ceiling
    size = 1
    while size > 0:
        size -= 1
        low, high = stack[size, 0], stack[size, 1]
        code = _judge(table, sets, low, high, point, question, known)
        if code == UNDECIDED:
            if high - low <= resolution or size + 2 > stack.shape[0]:
                code = _judge_at(table, sets, 0.5 * (low + high), point, question)
            elif measure == PDOP and same_set(sets[0], sets[3]):
                root = _only_crossing(table, sets[0], low, high, point, question)
                if not math.isnan(root):
                    above = _judge_at(table, sets, 0.5 * (root + high), point, question)
                    found = note(found, high, above)
                    low, high = low, root
                    code = NOT_FLYABLE if above == FLYABLE else FLYABLE
        if code == UNDECIDED:
            cut = next_split(table, low, high)
            stack[size, 0], stack[size, 1] = low, cut
            stack[size + 1, 0], stack[size + 1, 1] = cut, high
            size += 2
        else:
            found = note(found, high, code)
    return conclude(found, ground, ceiling)


@parallel_kernel
def morphing_columns(surfaces, place, ceiling, reach, question, out):
    """Fill out (altitude_m, safe_above_m, state, intervals), each (rows, cols) of the window.

    place: (origin_east, origin_north, cell_east, cell_north, first row, first col); ceiling: (metres, whether above
    ground). reach: see fill_column. question: (sources, kind, measure, limit, anchors needed, resolution in metres).
    """
    out_altitude, out_safe, out_state, out_intervals = out
    ground_m = surfaces[2]
    anchors = surfaces[0].shape[0]
    # numba takes no tuple of tuples of arrays into a parallel loop
    sources, kind, measure, limit, needed, resolution = question
    all_distant = sources[1].all()
    quadratic = kind == RANGING and measure == PDOP and not sources[1].any() and limit <= GREATEST_LIMIT
    for row in prange(out_state.shape[0]):
        table = np.empty((COLUMN_ROWS, anchors))
        sets = np.empty((4, (anchors + 63) // 64), np.uint64)
        stack = np.empty((20 * anchors + 256, 3))
        marks, order = np.empty(10), np.empty(anchors, np.int64)
        asked = (sources, kind, measure, limit, needed, resolution)
        north = place[1] - (place[4] + row) * place[3]
        for col in range(out_state.shape[1]):
            ground = float(ground_m[place[4] + row, place[5] + col])
            top = ground + ceiling[0] if ceiling[1] else ceiling[0]
            out_altitude[row, col], out_safe[row, col] = np.nan, np.inf
            out_intervals[row, col] = 0
            if math.isnan(ground):
                out_state[row, col] = UNKNOWN
                continue
            if ground >= top:
                out_state[row, col] = OUTSIDE
                continue
            point = (place[0] + (place[5] + col) * place[2], north)
            known = fill_column(table, surfaces, place[4] + row, place[5] + col, point, reach)
            air = (ground, top)
            if all_distant:
                altitude, safe, state, intervals = solve_distant(table, (order, sets[0]), air, asked, known)
            elif quadratic:
                wanted = (limit, needed, resolution)
                altitude, safe, state, intervals = solve_pdop(table, (marks, stack), air, wanted, known)
            else:
                altitude, safe, state, intervals = _solve(table, sets, stack, air, point, asked, known)
            out_altitude[row, col], out_safe[row, col] = altitude, safe
            out_state[row, col] = state
            out_intervals[row, col] = min(intervals, 255)
