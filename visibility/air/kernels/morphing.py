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
from typing import Any, NamedTuple

import numpy as np
from numba import float64, prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.air.kernels.columns import (
    ABOVE,
    CLOSED_AT_CEILING,
    COLUMN_ROWS,
    EVERYWHERE,
    FLYABLE,
    MAYBE,
    NOT_FLYABLE,
    NOTHING_FOUND,
    NOWHERE,
    OUTSIDE,
    SURE,
    UNDECIDED,
    UNKNOWN,
    Question,
    conclude,
    count_of,
    fill_column,
    next_split,
    note,
    same_set,
    set_between,
    steepness,
)
from visibility.air.kernels.distant_columns import solve_distant
from visibility.air.kernels.pdop_columns import solve_pdop
from visibility.dilution.kernels.dop import PDOP, RANGING, dilutions, never_a_fix
from visibility.dilution.kernels.normal_matrices import Sources

__all__ = [
    "ABOVE",
    "CLOSED_AT_CEILING",
    "EVERYWHERE",
    "FLYABLE",
    "NOT_FLYABLE",
    "NOWHERE",
    "OUTSIDE",
    "UNKNOWN",
    "Ceiling",
    "Columns",
    "morphing_columns",
]

# rows of the sets of a stretch: in sight for certain throughout, somewhere; and perhaps throughout, somewhere
SURE_THROUGHOUT, SURE_SOMEWHERE, MAYBE_THROUGHOUT, MAYBE_SOMEWHERE = 0, 1, 2, 3
SETS = 4
LOW, HIGH = 0, 1  # columns of the stack of stretches

ROOT_TOLERANCE_M = 1e-4
GREATEST_LIMIT = 1e4  # on PDOP, up to which the digits of a determinant suffice
MOST_STEPS = 100  # far more than the halving of weights ever needs


class Ceiling(NamedTuple):
    """The top of the air, metres, and whether it counts from the ground of each post."""

    ceiling_m: float
    above_ground: bool


class Columns(NamedTuple):
    """Answers over the posts of a window, (rows, cols) each: float32 twice, uint8 twice; see ``Column``."""

    altitude_m: Any
    safe_above_m: Any
    state: Any
    intervals: Any


@scalar_kernel
def _bounds(table, words, low, high, point, question):
    """(least, greatest) value of the dilution of a set from low to high; point carries the column's position."""
    sources, kind, measure = question.sources, question.kind, question.measure
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
    return greatest < question.limit and count_of(words) >= question.needed


@scalar_kernel
def _judge(table, sets, low, high, point, question, known):
    """FLYABLE, NOT_FLYABLE, UNKNOWN or UNDECIDED, of all air from low to high; fills sets (SETS, words)."""
    limit, needed = question.limit, question.needed
    sure, most = sets[SURE_THROUGHOUT], sets[MAYBE_SOMEWHERE]
    set_between(table, low, high, SURE, True, sure)
    set_between(table, low, high, SURE, False, sets[SURE_SOMEWHERE])
    if known:
        sets[MAYBE_THROUGHOUT, :], sets[MAYBE_SOMEWHERE, :] = sure, sets[SURE_SOMEWHERE]
    else:
        set_between(table, low, high, MAYBE, True, sets[MAYBE_THROUGHOUT])
        set_between(table, low, high, MAYBE, False, most)
    if count_of(most) < needed:
        return NOT_FLYABLE
    least, greatest = 0.0, math.inf
    if count_of(sure) >= needed:
        least, greatest = _bounds(table, sure, low, high, point, question)
        if greatest < limit:
            return FLYABLE
    if not same_set(sure, most):
        least, _ = _bounds(table, most, low, high, point, question)
    if least >= limit:
        return NOT_FLYABLE
    if known:
        return UNDECIDED
    _, greatest = _bounds(table, sets[MAYBE_THROUGHOUT], low, high, point, question)
    if not _suffices(sets[MAYBE_THROUGHOUT], greatest, question):
        return UNDECIDED
    if count_of(sets[SURE_SOMEWHERE]) < needed:
        return UNKNOWN
    least, _ = _bounds(table, sets[SURE_SOMEWHERE], low, high, point, question)
    return UNKNOWN if least >= limit else UNDECIDED


@scalar_kernel
def _judge_at(table, words, altitude, point, question):
    """FLYABLE, NOT_FLYABLE or UNKNOWN at one altitude; words: room for a set."""
    at = (point[0], point[1], altitude)
    for start in (SURE, MAYBE):
        set_between(table, altitude, altitude, start, True, words)
        value, _ = dilutions(at, question.sources, words, question.kind, question.measure)
        if _suffices(words, value, question):
            return FLYABLE if start == SURE else UNKNOWN
    return NOT_FLYABLE


@scalar_kernel
def _over_limit(point, altitude, words, question):
    """1 / PDOP − 1 / limit of a set at an altitude over a point: above zero where the dilution is below the limit."""
    _, position = dilutions((point[0], point[1], altitude), question.sources, words, question.kind, PDOP)
    return 1.0 / position - 1.0 / question.limit


@scalar_kernel
def _only_crossing(table, words, low, high, point, question):
    """Altitude at which the position dilution of one set passes the limit; NaN unless it provably does exactly once.

    With y = 1/P: |y''| ≤ 5·b²·P + c. By the mean value theorem some altitude has the slope of the chord, so none has
    slope 0 where the chord's is steeper than that bound times the stretch.
    """
    first, second = steepness(table, words, low, high)
    width = high - low
    _, position = dilutions((point[0], point[1], 0.5 * (low + high)), question.sources, words, question.kind, PDOP)
    share = 0.5 * first * width * position
    if not share < 0.5:
        return math.nan
    bend = 5.0 * first * first * position / (1.0 - share) + second
    if bend * width > 0.5 * first:
        return math.nan
    at_low = _over_limit(point, low, words, question)
    at_high = _over_limit(point, high, words, question)
    if not (at_low * at_high < 0.0 and abs(at_high - at_low) > bend * width * width):
        return math.nan
    side = 0
    for _ in range(MOST_STEPS):
        if high - low <= ROOT_TOLERANCE_M:
            break
        # regula falsi that halves the weight of an end that stays (Illinois), safe at the rounding of a flat end
        cut = min(max((low * at_high - high * at_low) / (at_high - at_low), low), high)
        value = _over_limit(point, cut, words, question)
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
    """The Column over one post.

    air: (ground, ceiling); stack: (n, 2) scratch.
    """
    ground, ceiling = air
    found = NOTHING_FOUND
    stack[0, LOW], stack[0, HIGH] = ground, ceiling
    size = 1
    while size > 0:
        size -= 1
        low, high = stack[size, LOW], stack[size, HIGH]
        code = _judge(table, sets, low, high, point, question, known)
        if code == UNDECIDED:
            if high - low <= question.resolution_m or size + 2 > stack.shape[0]:
                code = _judge_at(table, sets[SURE_THROUGHOUT], 0.5 * (low + high), point, question)
            elif question.measure == PDOP and same_set(sets[SURE_THROUGHOUT], sets[MAYBE_SOMEWHERE]):
                root = _only_crossing(table, sets[SURE_THROUGHOUT], low, high, point, question)
                if not math.isnan(root):
                    above = _judge_at(table, sets[SURE_THROUGHOUT], 0.5 * (root + high), point, question)
                    found = note(found, high, above)
                    low, high = low, root
                    code = NOT_FLYABLE if above == FLYABLE else FLYABLE
        if code == UNDECIDED:
            cut = next_split(table, low, high)
            stack[size, LOW], stack[size, HIGH] = low, cut
            stack[size + 1, LOW], stack[size + 1, HIGH] = cut, high
            size += 2
        else:
            found = note(found, high, code)
    return conclude(found, ground, ceiling)


@parallel_kernel
def morphing_columns(surfaces, window, ceiling, antennas, question, out):
    """Fill Columns over the posts of a Window.

    surfaces, antennas: see fill_column; question: a Question.
    """
    ground_m = surfaces.ground_m
    out_altitude, out_safe, out_state, out_intervals = out
    anchors = antennas.places.shape[0]
    # numba takes no tuple of tuples of arrays into a parallel loop
    sources, kind, measure, limit, needed, resolution_m = question
    places, distant, variances = sources
    all_distant, any_distant = distant.all(), distant.any()
    quadratic = kind == RANGING and measure == PDOP and not any_distant and limit <= GREATEST_LIMIT
    for row in prange(out_state.shape[0]):
        table = np.empty((COLUMN_ROWS, anchors))
        sets = np.empty((SETS, (anchors + 63) // 64), np.uint64)
        stack = np.empty((20 * anchors + 256, 3))
        marks, order = np.empty(10), np.empty(anchors, np.int64)
        asked = Question(Sources(places, distant, variances), kind, measure, limit, needed, resolution_m)
        grid_row = window.first_row + row
        north = window.origin_north_m - grid_row * window.cell_north_m
        for col in range(out_state.shape[1]):
            grid_col = window.first_col + col
            ground = float64(ground_m[grid_row, grid_col])
            top = ground + ceiling.ceiling_m if ceiling.above_ground else ceiling.ceiling_m
            out_altitude[row, col], out_safe[row, col] = np.nan, np.inf
            out_intervals[row, col] = 0
            if math.isnan(ground):
                out_state[row, col] = UNKNOWN
                continue
            if ground >= top:
                out_state[row, col] = OUTSIDE
                continue
            point = (window.origin_east_m + grid_col * window.cell_east_m, north)
            known = fill_column(table, surfaces, grid_row, grid_col, point, antennas)
            air = (ground, top)
            if all_distant:
                found = solve_distant(table, (order, sets[SURE_THROUGHOUT]), air, asked, known)
            elif quadratic:
                found = solve_pdop(table, (marks, stack), air, asked, known)
            else:
                found = _solve(table, sets, stack, air, point, asked, known)
            out_altitude[row, col], out_safe[row, col] = found.altitude_m, found.safe_above_m
            out_state[row, col] = found.state
            out_intervals[row, col] = min(found.intervals, 255)
