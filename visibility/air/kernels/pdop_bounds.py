"""Bounds of the position dilution over a stretch of air that are quadratic in altitude.

Ranges whose clock is known give the normal matrix N(z) = Σ w·d·dᵀ, where d leads to an anchor and w = 1/|d|². With
each weight held at its least over the stretch, the matrix is nowhere greater (Löwner), so that PDOP² = tr N⁻¹ is
nowhere less; held at its greatest, the other way round. With weights held, d depends on z in its upward part alone,
and det N and tr adj N are quadratic in z. So is limit²·det N − tr adj N, which is > 0 exactly where PDOP < limit: air
between and beyond its roots is decided at once. An anchor straight above or below is seen along the vertical from every
altitude, so its d·dᵀ·w is held as it is.
"""

from typing import NamedTuple

from compiled.options import scalar_kernel, summing_loop
from visibility.air.kernels.columns import AWAY, EAST, GAP_FROM, GAP_TO, LEVEL, NORTH, TOP

__all__ = ["margin_at_best", "margin_at_worst"]

NEVER = (0.0, 0.0, -1.0)  # a margin that is negative throughout


class Sums(NamedTuple):
    """How many anchors, and sums of their weights, of those times their directions and products of these."""

    count: float
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
    return _margin(sums, square) if sums.count >= needed else NEVER


@scalar_kernel
def margin_at_best(table, low, high, start, square, needed):
    """(a, b, c) of a margin that is <= 0 only where air from low to high is not flyable."""
    sums = _sums_somewhere(table, low, high, start)
    return _margin(sums, square) if sums.count >= needed else NEVER
