"""Columns of air whose position dilution from ranges is limited: solved by roots of bounds quadratic in altitude.

Ranges whose clock is known give the normal matrix N(z) = Σ w·d·dᵀ, where d leads to an anchor and w = 1/|d|². With
each weight held at its least over the stretch, the matrix is nowhere greater (Löwner), so that PDOP² = tr N⁻¹ is
nowhere less; held at its greatest, the other way round. With weights held, d depends on z in its upward part alone,
and det N and tr adj N are quadratic in z. So is limit²·det N − tr adj N, which is > 0 exactly where PDOP < limit: air
between and beyond its roots is decided at once. An anchor straight above or below is seen along the vertical from every
altitude, so its d·dᵀ·w is held as it is.

A stretch is divided where a bound passes the limit. What neither bound decides is asked again, as narrow as it has
become, with the anchors and weights of that narrower stretch; where it has hardly become narrower, it is cut.
"""

import math
from typing import NamedTuple

from compiled.options import scalar_kernel, summing_loop
from visibility.air.kernels.columns import (
    AWAY,
    EAST,
    FLYABLE,
    GAP_FROM,
    GAP_TO,
    LEVEL,
    MAYBE,
    NORTH,
    NOT_FLYABLE,
    NOTHING_FOUND,
    SURE,
    TOP,
    UNDECIDED,
    UNKNOWN,
    conclude,
    next_split,
    note,
)

__all__ = ["margin_at_best", "margin_at_worst", "solve_pdop"]

NEVER = (0.0, 0.0, -1.0)  # a margin that is negative throughout


class Sums(NamedTuple):
    """How many anchors, and sums of their weights, of those times their directions and products of these."""

    anchors: float
    weight: float
    east: float
    north: float
    up: float
    ee: float
    en: float
    nn: float
    eu: float
    nu: float
    uu: float


@summing_loop
def _sums_throughout(table, low, high, start):
    """Sums of least weights over the anchors that are seen all the way from low to high."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    count, s, s_e, s_n, s_u = 0.0, 0.0, 0.0, 0.0, 0.0
    ee, en, nn, eu, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(table.shape[1]):
        clear_of_gap = (table[GAP_TO, a] <= low) | (table[GAP_FROM, a] >= high)
        seen = (table[start, a] <= low) & (table[TOP, a] >= high) & clear_of_gap
        east, north, up, away = table[EAST, a], table[NORTH, a], table[LEVEL, a] - middle, table[AWAY, a]
        beside = abs(up) + half
        here = 1.0 if seen else 0.0
        over = away == 0.0
        w = 0.0 if over else here / (away * away + beside * beside)
        count += here
        w_e, w_n, w_u = w * east, w * north, w * up
        s, s_e, s_n, s_u = s + w, s_e + w_e, s_n + w_n, s_u + w_u
        ee, en, nn = ee + w_e * east, en + w_e * north, nn + w_n * north
        eu, nu, uu = eu + w_e * up, nu + w_n * up, uu + (here if over else w_u * up)
    return Sums(count, s, s_e, s_n, s_u, ee, en, nn, eu, nu, uu)


@summing_loop
def _sums_somewhere(table, low, high, start):
    """As _sums_throughout, with the greatest weights and all anchors that are seen somewhere from low to high."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    count, s, s_e, s_n, s_u = 0.0, 0.0, 0.0, 0.0, 0.0
    ee, en, nn, eu, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(table.shape[1]):
        in_gap = (table[GAP_FROM, a] <= low) & (table[GAP_TO, a] >= high)
        seen = (table[start, a] < high) & (table[TOP, a] > low) & (not in_gap)
        east, north, up, away = table[EAST, a], table[NORTH, a], table[LEVEL, a] - middle, table[AWAY, a]
        beside = abs(up) - half
        beside = beside if beside > 0.0 else 0.0
        here = 1.0 if seen else 0.0
        over = away == 0.0
        w = 0.0 if over else here / (away * away + beside * beside)
        count += here
        w_e, w_n, w_u = w * east, w * north, w * up
        s, s_e, s_n, s_u = s + w, s_e + w_e, s_n + w_n, s_u + w_u
        ee, en, nn = ee + w_e * east, en + w_e * north, nn + w_n * north
        eu, nu, uu = eu + w_e * up, nu + w_n * up, uu + (here if over else w_u * up)
    return Sums(count, s, s_e, s_n, s_u, ee, en, nn, eu, nu, uu)


@scalar_kernel
def _margin(sums, square):
    """(a, b, c) of limit²·det N − tr adj N = a·t² + b·t + c, t counted from the stretch's middle; square = limit²."""
    _, s, s_e, s_n, s_u, ee, en, nn, eu, nu, uu = sums
    flat = ee * nn - en * en
    k = square * flat - (ee + nn)
    p, q, r = square * nn - 1.0, square * en, square * ee - 1.0
    return (
        k * s - (p * s_e * s_e - 2.0 * q * s_e * s_n + r * s_n * s_n),
        -2.0 * (k * s_u - (p * eu * s_e - q * (eu * s_n + nu * s_e) + r * nu * s_n)),
        k * uu - (p * eu * eu - 2.0 * q * eu * nu + r * nu * nu) - flat,
    )


@scalar_kernel
def margin_at_worst(table, low, high, start, square, needed):
    """(a, b, c) of a margin that is > 0 only where air from low to high is flyable; start: as for set_between."""
    sums = _sums_throughout(table, low, high, start)
    return _margin(sums, square) if sums.anchors >= needed else NEVER


@scalar_kernel
def margin_at_best(table, low, high, start, square, needed):
    """(a, b, c) of a margin that is <= 0 only where air from low to high is not flyable."""
    sums = _sums_somewhere(table, low, high, start)
    return _margin(sums, square) if sums.anchors >= needed else NEVER


# columns of the stack of pieces
LOW, HIGH, CODE = 0, 1, 2
LEAST_GAIN = 0.5  # a stretch that is left wider than this share of itself is cut


@scalar_kernel
def _add_roots(margin, half, marks, count):
    """Add to marks[1:count], ascending, the roots of a margin between -half and half; returns the new count."""
    a, b, c = margin
    square = b * b - 4.0 * a * c
    if not square > 0.0:
        return count
    root = -0.5 * (b + math.copysign(math.sqrt(square), b))
    for t in (root / a, c / root):
        if -half < t < half:
            at = count
            while at > 1 and marks[at - 1] > t:
                marks[at] = marks[at - 1]
                at -= 1
            marks[at] = t
            count += 1
    return count


class Wanted(NamedTuple):
    """limit², how many anchors are needed, whether the visibility of all is known."""

    square: float
    needed: int
    known: bool


@scalar_kernel
def _at(margin, t):
    a, b, c = margin
    return (a * t + b) * t + c


@scalar_kernel
def _code(margins, t):
    """FLYABLE, NOT_FLYABLE, UNKNOWN or UNDECIDED at t from the middle of a stretch."""
    sure_worst, sure_best, maybe_worst, maybe_best = margins
    if _at(sure_worst, t) > 0.0:
        return FLYABLE
    if _at(maybe_best, t) <= 0.0:
        return NOT_FLYABLE
    if _at(maybe_worst, t) > 0.0 and _at(sure_best, t) <= 0.0:
        return UNKNOWN
    return UNDECIDED


@scalar_kernel
def _divide(table, low, high, wanted, marks, stack, size):
    """Put the pieces of the stretch from low to high on the stack, the highest on top; returns the stack's size."""
    square, needed, known = wanted
    sure_worst = margin_at_worst(table, low, high, SURE, square, needed)
    sure_best = margin_at_best(table, low, high, SURE, square, needed)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    marks[0] = -half
    count = _add_roots(sure_best, half, marks, _add_roots(sure_worst, half, marks, 1))
    maybe_worst, maybe_best = sure_worst, sure_best
    if not known:
        maybe_worst = margin_at_worst(table, low, high, MAYBE, square, needed)
        maybe_best = margin_at_best(table, low, high, MAYBE, square, needed)
        count = _add_roots(maybe_best, half, marks, _add_roots(maybe_worst, half, marks, count))
    marks[count] = half
    margins = (sure_worst, sure_best, maybe_worst, maybe_best)
    first = size
    for piece in range(count):
        code = _code(margins, 0.5 * (marks[piece] + marks[piece + 1]))
        upper = high if piece == count - 1 else middle + marks[piece + 1]
        if size > first and stack[size - 1, CODE] == code:
            stack[size - 1, HIGH] = upper
            continue
        lower = low if piece == 0 else middle + marks[piece]
        stack[size, LOW], stack[size, HIGH], stack[size, CODE] = lower, upper, code
        size += 1
    return size


@scalar_kernel
def _cut(table, stack, at, size):
    """Cut piece number ``at`` of the stack in two; returns the stack's new size."""
    for other in range(size, at + 1, -1):
        stack[other] = stack[other - 1]
    cut = next_split(table, stack[at, LOW], stack[at, HIGH])
    stack[at + 1, LOW], stack[at + 1, HIGH], stack[at + 1, CODE] = cut, stack[at, HIGH], UNDECIDED
    stack[at, HIGH] = cut
    return size + 1


@scalar_kernel
def _code_at(table, altitude, wanted):
    """FLYABLE, NOT_FLYABLE or UNKNOWN at one altitude."""
    square, needed, known = wanted
    if _at(margin_at_worst(table, altitude, altitude, SURE, square, needed), 0.0) > 0.0:
        return FLYABLE
    if not known and _at(margin_at_worst(table, altitude, altitude, MAYBE, square, needed), 0.0) > 0.0:
        return UNKNOWN
    return NOT_FLYABLE


@scalar_kernel
def solve_pdop(table, scratch, air, question, known):
    """The Column over one post.

    air: (ground, ceiling); scratch: (marks (10,), stack (n, 3)); question: a Question (columns).
    """
    ground, ceiling = air
    marks, stack = scratch
    wanted = Wanted(question.limit * question.limit, question.needed, known)
    found = NOTHING_FOUND
    stack[0, LOW], stack[0, HIGH], stack[0, CODE] = ground, ceiling, UNDECIDED
    size = 1
    while size > 0:
        size -= 1
        low, high, code = stack[size, LOW], stack[size, HIGH], int(stack[size, CODE])
        if code == UNDECIDED and (high - low <= question.resolution_m or size + 12 > stack.shape[0]):
            code = _code_at(table, 0.5 * (low + high), wanted)
        if code != UNDECIDED:
            found = note(found, high, code)
            continue
        before = size
        size = _divide(table, low, high, wanted, marks, stack, size)
        for piece in range(size - 1, before - 1, -1):
            wide = stack[piece, HIGH] - stack[piece, LOW] > LEAST_GAIN * (high - low)
            if wide and stack[piece, CODE] == UNDECIDED:
                size = _cut(table, stack, piece, size)
    return conclude(found, ground, ceiling)
