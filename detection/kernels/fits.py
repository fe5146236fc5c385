"""A position for a set of ranges: the linear system of sphere intersections, then Gauss-Newton.

A set of ranges is the bits of an int64. flat: two dimensions, the altitude stays zero.
"""

import math
from typing import NamedTuple

from compiled.options import scalar_kernel

from .linear_systems import linear_start, spread_of
from .small_systems import NOTHING, Symmetric, from_anchor, inverse, solved, trace, weakest_axis, without_axis

__all__ = [
    "COLLINEAR",
    "CROSSED",
    "MIRRORED",
    "NO_FIT",
    "ONE",
    "Fit",
    "descend",
    "fit",
    "side_of",
]

# How many places fit a set of ranges. Crossed: one, and the best place on the other side of the anchors is their plane.
NO_FIT, ONE, MIRRORED, COLLINEAR, CROSSED = 0, 1, 2, 3, 4
FREE = (0.0, 0.0, 0.0)

# Least over largest eigenvalue of the linear system (an aspect of 1 to 10 squared) under which both sides are tried.
NEARLY_FLAT = 0.01
# The same (an aspect of 1 to 1.8) above which no second place lies on the other side of the anchors.
ONE_SIDED = 0.3
ON_A_LINE = 1e-6
# Least part of the way between two places that lies along the axes which a hint knows, for the hint to tell them apart.
KNOWN_APART = 0.1
ITERATIONS = 12
CONVERGED_M = 1e-7


class Descent(NamedTuple):
    """The place of the least squares, its squared residuals in sigmas, how often every range was looked at."""

    place: tuple[float, float, float]
    cost: float
    rounds: int


class Fit(NamedTuple):
    """How many places fit a set of ranges, one with its cost (as in Descent), and the other with its own."""

    places: int
    place: tuple[float, float, float]
    cost: float
    other: tuple[float, float, float]
    other_cost: float
    rounds: int


@scalar_kernel
def descend(ranges, kept, flat, start, held):
    """The Descent to the least squares, by damped Gauss-Newton.

    held: a unit vector along which the place stays where it is, or ``FREE``.
    """
    anchors, measured, sigmas, _, _ = ranges
    held_e, held_n, held_u = held
    at_e, at_n, at_u = start
    damping, cost = 0.0, math.inf
    best_e, best_n, best_u = start
    matrix, gradient = NOTHING, FREE
    rounds = 0
    for _ in range(ITERATIONS):
        rounds += 1
        ee, en, eu, nn, nu, uu = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        down_e, down_n, down_u, here = 0.0, 0.0, 0.0, 0.0
        for i in range(measured.shape[0]):
            if not (kept >> i) & 1:
                continue
            east, north, up, distance = from_anchor((at_e, at_n, at_u), anchors, i)
            distance = max(distance, 1e-9)
            east, north, up = east / distance, north / distance, up / distance
            weight = 1.0 / (sigmas[i] * sigmas[i])
            residual = measured[i] - distance
            here += weight * residual * residual
            ee, en, eu = ee + weight * east * east, en + weight * east * north, eu + weight * east * up
            nn, nu, uu = nn + weight * north * north, nu + weight * north * up, uu + weight * up * up
            pull = weight * residual
            down_e, down_n, down_u = down_e + pull * east, down_n + pull * north, down_u + pull * up
        if flat:
            eu, nu, down_u = 0.0, 0.0, 0.0
            uu = 0.5 * (ee + nn)
        along = down_e * held_e + down_n * held_n + down_u * held_u
        down_e, down_n, down_u = down_e - along * held_e, down_n - along * held_n, down_u - along * held_u
        if here <= cost:
            gained, cost = cost - here, here
            best_e, best_n, best_u = at_e, at_n, at_u
            matrix, gradient = Symmetric(ee, en, eu, nn, nu, uu), (down_e, down_n, down_u)
            damping *= 0.1
            if gained <= 1e-7 * (1.0 + here):
                break
        else:
            damping = max(10.0 * damping, 1e-3)
        ee, en, eu, nn, nu, uu = without_axis(matrix, held)
        more = damping * (ee + nn + uu)
        inverted, exists = inverse(Symmetric(ee + more, en, eu, nn + more, nu, uu + more))
        if not exists:
            damping = max(10.0 * damping, 1e-6)
            more = damping * (ee + nn + uu)
            inverted, exists = inverse(Symmetric(ee + more, en, eu, nn + more, nu, uu + more))
            if not exists:
                break
        down_e, down_n, down_u = gradient
        step_e, step_n, step_u = solved(inverted, down_e, down_n, down_u)
        at_e, at_n, at_u = best_e + step_e, best_n + step_n, best_u + step_u
        if step_e * step_e + step_n * step_n + step_u * step_u < CONVERGED_M * CONVERGED_M:
            break
    return Descent((best_e, best_n, best_u), cost, rounds)


@scalar_kernel
def _out_of_plane_m(place, middle, axis):
    """How far a place lies out of the anchors' plane, along its normal."""
    out_m = 0.0
    for i in range(3):
        out_m += (place[i] - middle[i]) * axis[i]
    return out_m


@scalar_kernel
def _moved(place, by_m, axis):
    """A place moved along a unit vector."""
    east, north, up = place
    axis_e, axis_n, axis_u = axis
    return east + by_m * axis_e, north + by_m * axis_n, up + by_m * axis_u


@scalar_kernel
def _from_both_sides(ranges, kept, flat, descended, across, plane):
    """What ``fit`` gives for descents from either side of the anchors: the first, and where the second begins.

    plane: the middle of the anchors, and its unit normal.

    They end in two places only if they end on either side. One that crosses the plane finds no least squares on its own
    side: it goes where the other went, slowly through the plane, and where it stands after its last step is no place.
    Then the best place on its side lies in the plane.
    """
    middle, axis = plane
    place, cost, rounds = descended
    other, other_cost, more = descend(ranges, kept, flat, across, FREE)
    rounds += more
    out_m, other_out_m = _out_of_plane_m(place, middle, axis), _out_of_plane_m(other, middle, axis)
    if out_m * other_out_m > 0.0:
        if other_cost < cost:
            place, cost, out_m = other, other_cost, other_out_m
        within, within_cost, more = descend(ranges, kept, flat, _moved(place, -out_m, axis), axis)
        return Fit(CROSSED, place, cost, within, within_cost, rounds + more)
    if other_cost < cost:
        return Fit(MIRRORED, other, other_cost, place, cost, rounds)
    return Fit(MIRRORED, place, cost, other, other_cost, rounds)


@scalar_kernel
def side_of(place, other, hint):
    """Which of two places a hint is nearer to along the axes that it knows: −1 the first, 1 the second, 0 neither.

    Neither where they lie apart mostly along the other axes: what little is left is noise, or what the anchors stand
    off their plane (masts along a road and an altitude).
    """
    here, there, known, apart = 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        between = (place[axis] - other[axis]) ** 2
        apart += between
        if not math.isnan(hint[axis]):
            known += between
            here += (place[axis] - hint[axis]) ** 2
            there += (other[axis] - hint[axis]) ** 2
    if known < KNOWN_APART * KNOWN_APART * apart:
        return 0
    return -1 if here < there else 1 if there < here else 0


@scalar_kernel
def fit(ranges, kept, flat, refine):
    """The Fit of the kept ranges.

    Where the anchors lie nearly in one plane (on one line in two dimensions), the linear system says where in the
    plane; how far out of it, to either side, follows from the ranges. Unless they stand all around, both sides are
    tried: ranges with errors meet on the wrong side of a shallow layer of anchors too.
    """
    matrix, right, middle = linear_start(ranges, kept, flat)
    right_e, right_n, right_u = right
    middle_e, middle_n, middle_u = middle
    axis_e, axis_n, axis_u, least, second = weakest_axis(matrix)
    axis = (axis_e, axis_n, axis_u)
    if not trace(matrix) > 0.0:
        return Fit(NO_FIT, FREE, math.inf, FREE, math.inf, 0)
    if second < ON_A_LINE:
        return Fit(COLLINEAR, FREE, math.inf, FREE, math.inf, 0)
    if least > NEARLY_FLAT or (not refine and least > 1e-9):
        inverted, exists = inverse(matrix)
        if not exists:
            return Fit(NO_FIT, FREE, math.inf, FREE, math.inf, 0)
        east, north, up = solved(inverted, right_e, right_n, right_u)
        start = (east + middle_e, north + middle_n, 0.0 if flat else up + middle_u)
        if not refine:
            return Fit(ONE, start, 0.0, FREE, math.inf, 0)
        descended = descend(ranges, kept, flat, start, FREE)
        if least > ONE_SIDED:
            return Fit(ONE, descended.place, descended.cost, FREE, math.inf, descended.rounds)
        out_m = _out_of_plane_m(descended.place, middle, axis)
        across = _moved(descended.place, -2.0 * out_m, axis)
        return _from_both_sides(ranges, kept, flat, descended, across, (middle, axis))
    more = trace(matrix)
    ee, en, eu, nn, nu, uu = matrix
    inverted, exists = inverse(
        Symmetric(
            ee + more * axis_e * axis_e,
            en + more * axis_e * axis_n,
            eu + more * axis_e * axis_u,
            nn + more * axis_n * axis_n,
            nu + more * axis_n * axis_u,
            uu + more * axis_u * axis_u,
        )
    )
    if not exists:
        return Fit(NO_FIT, FREE, math.inf, FREE, math.inf, 0)
    # the weakest axis is taken out of the right side: what little it says is mostly noise
    along = right_e * axis_e + right_n * axis_n + right_u * axis_u
    east, north, up = solved(inverted, right_e - along * axis_e, right_n - along * axis_n, right_u - along * axis_u)
    in_plane = (east + middle_e, north + middle_n, 0.0 if flat else up + middle_u)
    out_m = math.sqrt(max(spread_of(ranges, kept, in_plane), 0.0))
    above, below = _moved(in_plane, out_m, axis), _moved(in_plane, -out_m, axis)
    if not refine:
        return Fit(MIRRORED, above, 0.0, below, 0.0, 0)
    return _from_both_sides(ranges, kept, flat, descend(ranges, kept, flat, above, FREE), below, (middle, axis))
