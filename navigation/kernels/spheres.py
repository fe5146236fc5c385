"""How likely a normally distributed error in space stays within a sphere around its mean."""

import math

from numba import prange

from compiled.options import parallel_kernel, scalar_kernel

__all__ = ["probabilities_within", "probability_within", "radii_of_probability"]

# the principal axes, the largest first
A, B, C = 0, 1, 2
# beyond so many sigmas nothing is left
TAIL = 9.0


@scalar_kernel
def _within(radius_m, sigmas_m, lattice):
    """Probability of a sphere; sigmas along the principal axes.

    sigmas_m: largest first. The least axis is integrated in closed form; the other two by Gauss-Legendre nodes and
    weights of [0, 1], each over an angle, since the sphere's edge is a square root.
    """
    nodes, weights = lattice
    if not radius_m > 0.0:
        return 0.0
    if sigmas_m[A] == 0.0:
        return 1.0
    edge_a = min(radius_m, TAIL * sigmas_m[A])
    total = 0.0
    for i in range(nodes.shape[0]):
        angle = nodes[i] * math.pi / 2.0
        a = edge_a * math.sin(angle)
        dense = math.exp(-0.5 * (a / sigmas_m[A]) ** 2) / sigmas_m[A]
        share = weights[i] * math.pi / 2.0 * edge_a * math.cos(angle) * dense
        total += share * _within_circle(math.sqrt(max(radius_m * radius_m - a * a, 0.0)), sigmas_m, lattice)
    return min(total * math.sqrt(2.0 / math.pi), 1.0)


@scalar_kernel
def _within_circle(radius_m, sigmas_m, lattice):
    """Probability of a circle for the two smaller axes."""
    nodes, weights = lattice
    if sigmas_m[B] == 0.0:
        return 1.0
    edge_b = min(radius_m, TAIL * sigmas_m[B])
    total = 0.0
    for i in range(nodes.shape[0]):
        angle = nodes[i] * math.pi / 2.0
        b = edge_b * math.sin(angle)
        dense = math.exp(-0.5 * (b / sigmas_m[B]) ** 2) / sigmas_m[B]
        inner = 1.0
        if sigmas_m[C] > 0.0:
            inner = math.erf(math.sqrt(max(radius_m * radius_m - b * b, 0.0) / 2.0) / sigmas_m[C])
        total += weights[i] * math.pi / 2.0 * edge_b * math.cos(angle) * dense * inner
    return total * math.sqrt(2.0 / math.pi)


@scalar_kernel
def probability_within(radius_m, sigmas_m, lattice):
    """Probability that an error with sigmas (3,), largest first, is no longer than radius_m; NaN where either is."""
    if math.isnan(radius_m + sigmas_m[A] + sigmas_m[B] + sigmas_m[C]):
        return math.nan
    return _within(radius_m, sigmas_m, lattice)


@parallel_kernel
def probabilities_within(radius_m, sigmas_m, lattice, out):
    """Fill out (n,) for radius_m (n,) and sigmas_m (n, 3)."""
    for p in prange(out.shape[0]):
        out[p] = probability_within(radius_m[p], sigmas_m[p], lattice)


@scalar_kernel
def _radius_of(probability, sigmas_m, lattice):
    """Radius of the sphere that holds a probability, by regula falsi (Illinois); what it starts from holds 0 and 1."""
    low_m, high_m = 0.0, TAIL * math.sqrt(sigmas_m[A] ** 2 + sigmas_m[B] ** 2 + sigmas_m[C] ** 2)
    below, above = -probability, 1.0 - probability
    # over most of the way the probability is all but 1: begin at the root of the trace
    radius_m = high_m / TAIL
    side = 0
    for _ in range(100):
        off = _within(radius_m, sigmas_m, lattice) - probability
        if abs(off) < 1e-12 or high_m - low_m <= 1e-10 * high_m:
            break
        if off < 0.0:
            low_m, below = radius_m, off
            if side == -1:
                above *= 0.5
            side = -1
        else:
            high_m, above = radius_m, off
            if side == 1:
                below *= 0.5
            side = 1
        radius_m = (low_m * above - high_m * below) / (above - below)
    return radius_m


@parallel_kernel
def radii_of_probability(probability, sigmas_m, lattice, out_m):
    """Fill out_m (n,) with the radius of the sphere that holds that probability, for sigmas_m (n, 3)."""
    for p in prange(out_m.shape[0]):
        if math.isnan(sigmas_m[p, A] + sigmas_m[p, B] + sigmas_m[p, C]):
            out_m[p] = math.nan
        else:
            out_m[p] = _radius_of(probability, sigmas_m[p], lattice)
