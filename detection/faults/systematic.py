"""Faults that all ranges of a log share, by least squares: an offset, a scale, or a height that is not looked at."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..kernels import fits
from ..kernels.linear_systems import Ranges

__all__ = ["Block", "SharedFit", "shared_fit"]

Floats = npt.NDArray[np.float64]

ROUNDS, LAST_ROUNDS = 12, 8
# Before these, blocks that are stuck begin again from among their neighbours, so many on either side.
RESEATED, NEIGHBOURS, REFINED = (ROUNDS - 4, ROUNDS), 5, 5
# A residual of more sigmas pulls no harder than one of so many (Huber): what is occluded stays out of it.
HUBER = 1.5
# In the last rounds, one that is beyond so many hardly pulls at all (Geman and McClure).
BEYOND = 3.0
# A median of absolute residuals to the sigma of normal ones.
MEDIAN_TO_SIGMA = 1.4826
NO_LIMIT_M = 1e12
# Factors of which one puts a descent near the scale it looks for: feet either way, and what calibration mends.
SCALES = (1.0, 3.28084, 0.3048)


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """Ranges from about one place: (k, 3) anchors, (k,) ranges, (k,) seconds before or after the middle of them.

    time_s: that middle. ids: whose each range is. places_m: where every anchor is said to stand then.
    """

    anchors_m: Floats
    ranges_m: Floats
    late_s: Floats
    time_s: float
    ids: tuple[str, ...]
    places_m: Mapping[str, tuple[float, float, float]]


@dataclass(frozen=True, slots=True, eq=False)
class SharedFit:
    """What ranges are, against what they should be: ``scale`` · distance + ``offset_m``.

    sigma_m: how far they are off any place even so, for each degree of freedom. places_m: (m, d) of the rover, by
    block. residuals_m: (m, k) of the ranges, NaN beyond those of a block. offset_sigma_m, scale_sigma: of what was
    estimated, else 0.
    """

    offset_m: float
    scale: float
    sigma_m: float
    places_m: Floats
    residuals_m: Floats
    offset_sigma_m: float = 0.0
    scale_sigma: float = 0.0

    def misfits(self, sigma_m: float) -> Floats:
        """(m,) how unlikely the ranges of each block are even so, in nats; none counts for more than three sigmas."""
        size = np.nan_to_num(self.residuals_m / sigma_m)
        nats: Floats = 0.5 * np.minimum(size * size, BEYOND * BEYOND).sum(axis=1)
        return nats

    def misfit(self, sigma_m: float) -> float:
        """The same of all blocks together."""
        return float(self.misfits(sigma_m).sum())


def shared_fit(
    blocks: Sequence[Block],
    dimension: Literal[2, 3],
    range_sigma_m: float,
    speed_m_per_s: float,
    what: Literal["nothing", "offset", "scale"],
) -> SharedFit | None:
    """Places and velocities of all blocks with one offset or one scale for all their ranges; None = not determined.

    speed_m_per_s: one sigma of the rover's velocity, by which ranges of one block may be apart in time.
    """
    if not blocks:
        return None
    if what != "scale":
        return _Batch(blocks, dimension, speed_m_per_s, 1.0).fit(range_sigma_m, what)
    fitted = [_Batch(blocks, dimension, speed_m_per_s, scale).fit(range_sigma_m, what) for scale in SCALES]
    return min((one for one in fitted if one is not None), key=lambda one: one.sigma_m, default=None)


class _Batch:
    """All blocks as arrays, padded to the longest: (m, k, 3) anchors, (m, k) ranges, times, and whether it is one."""

    def __init__(self, blocks: Sequence[Block], dimension: int, speed_m_per_s: float, scale: float) -> None:
        m, k = len(blocks), max(len(block.ranges_m) for block in blocks)
        self.d, self.speed_m_per_s, self.scale = dimension, speed_m_per_s, scale
        self.anchors_m, self.is_one = np.zeros((m, k, dimension)), np.zeros((m, k), np.bool_)
        self.ranges_m, self.late_s = np.zeros((m, k)), np.zeros((m, k))
        self.state = np.zeros((m, 2 * dimension))
        for row, block in enumerate(blocks):
            n = len(block.ranges_m)
            self.anchors_m[row, :n], self.is_one[row, :n] = block.anchors_m[:, :dimension], True
            self.ranges_m[row, :n], self.late_s[row, :n] = block.ranges_m, block.late_s
            self.state[row, :dimension] = _start(block, dimension, scale)

    def fit(self, range_sigma_m: float, what: str) -> SharedFit | None:
        """Gauss-Newton over all places, velocities and what they share, each residual weighed by how far it is off."""
        d, damping, sigma_m = self.d, 1e-3, range_sigma_m
        offset_m, scale, shared_variance = 0.0, self.scale, 0.0
        state = self.state
        residual_m, rows, distance_m = self._look(state, offset_m, scale)
        for number in range(ROUNDS + LAST_ROUNDS):
            last = number >= ROUNDS
            if number in RESEATED:
                state = self._reseated(state, offset_m, scale, sigma_m)
                residual_m, rows, distance_m = self._look(state, offset_m, scale)
            sigma_m = max(range_sigma_m, _spread_m(residual_m[self.is_one]))
            size = np.abs(residual_m) / sigma_m
            pulls = (1.0 + (size / BEYOND) ** 2) ** -2 if last else 1.0 / np.maximum(size / HUBER, 1.0)
            weights = np.where(self.is_one, pulls / sigma_m**2, 0.0)
            normal = np.einsum("mki,mk,mkj->mij", rows, weights, rows)
            normal[:, range(d, 2 * d), range(d, 2 * d)] += self.speed_m_per_s**-2
            trace = normal[:, range(d), range(d)].sum(axis=1)
            normal[:, range(2 * d), range(2 * d)] += (damping * trace / d)[:, None] + 1e-12
            right = np.einsum("mki,mk->mi", rows, weights * residual_m)
            right[:, d:] -= state[:, d:] * self.speed_m_per_s**-2
            step = np.linalg.solve(normal, right[..., None])[..., 0]
            shared = 0.0
            if what != "nothing":
                # what all blocks share, with each block's own unknowns taken out (Schur)
                toward = distance_m if what == "scale" else np.ones_like(distance_m)
                cross = np.einsum("mki,mk->mi", rows, weights * toward)
                taken = np.linalg.solve(normal, cross[..., None])[..., 0]
                left = float((weights * toward * toward).sum() - (cross * taken).sum())
                if not left > 1e-9 * float((weights * toward * toward).sum()):
                    return None
                shared = float((weights * toward * residual_m).sum() - (taken * right).sum()) / left
                shared_variance = 1.0 / left
                step -= shared * taken
            new = state + step
            new_offset_m = offset_m + (shared if what == "offset" else 0.0)
            new_scale = scale + (shared if what == "scale" else 0.0)
            if not (np.isfinite(new).all() and new_scale > 0.0):
                return None
            looked = self._look(new, new_offset_m, new_scale)
            better = self._cost(looked[0], sigma_m, last) <= self._cost(residual_m, sigma_m, last)
            damping = damping * 0.1 if better else min(10.0 * damping, 1e3)
            if better:
                state, offset_m, scale, (residual_m, rows, distance_m) = new, new_offset_m, new_scale, looked
        count = int(self.is_one.sum())
        free = count - self._unknowns() - (what != "nothing")
        if free < 1:
            return None
        sigma_m = _spread_m(residual_m[self.is_one]) * math.sqrt(count / free)
        shared_sigma = math.sqrt(shared_variance)
        return SharedFit(
            offset_m, scale, sigma_m, state[:, :d], np.where(self.is_one, residual_m, np.nan),
            shared_sigma * (what == "offset"), shared_sigma * (what == "scale"),
        )  # fmt: skip

    def _unknowns(self) -> int:
        """Of places, and of velocities where a block's ranges are from more than one moment."""
        moving = (np.ptp(self.late_s, axis=1) > 0.0).sum()
        return self.d * (len(self.state) + int(moving))

    def _look(self, state: Floats, offset_m: float, scale: float) -> tuple[Floats, Floats, Floats]:
        """(m, k) residuals, (m, k, 2d) their slopes along the state, (m, k) distances."""
        d = self.d
        offset = state[:, None, :d] + self.late_s[..., None] * state[:, None, d:] - self.anchors_m
        distance_m = np.maximum(np.sqrt((offset * offset).sum(axis=2)), 1e-9)
        toward = scale * offset / distance_m[..., None]
        rows = np.concatenate([toward, toward * self.late_s[..., None]], axis=2)
        residual_m = np.where(self.is_one, self.ranges_m - scale * distance_m - offset_m, 0.0)
        return residual_m, rows, distance_m

    def _reseated(self, state: Floats, offset_m: float, scale: float, sigma_m: float) -> Floats:
        """The state, with blocks moved to their neighbours' median place, or mirrored, where ranges meet better so."""
        if len(state) > 2 * NEIGHBOURS:
            around = np.pad(state, ((NEIGHBOURS, NEIGHBOURS), (0, 0)), mode="edge")
            windows = np.lib.stride_tricks.sliding_window_view(around, 2 * NEIGHBOURS + 1, axis=0)
            state = self._likelier(state, np.median(windows, axis=2), offset_m, scale, sigma_m)
        return self._likelier(state, self._mirrored(state), offset_m, scale, sigma_m)

    def _mirrored(self, state: Floats) -> Floats:
        """Each place on the other side of the plane that is nearest to its block's anchors."""
        d, count = self.d, self.is_one.sum(axis=1)[:, None]
        middle_m = self.anchors_m.sum(axis=1) / count
        apart_m = np.where(self.is_one[..., None], self.anchors_m - middle_m[:, None], 0.0)
        normal = np.linalg.eigh(np.einsum("mki,mkj->mij", apart_m, apart_m))[1][:, :, 0]
        mirrored = state.copy()
        mirrored[:, :d] -= 2.0 * ((state[:, :d] - middle_m) * normal).sum(axis=1)[:, None] * normal
        return mirrored

    def _likelier(self, state: Floats, other: Floats, offset_m: float, scale: float, sigma_m: float) -> Floats:
        """Of each block its state, or what another one leads to where its ranges meet better there."""
        for _ in range(REFINED):
            residual_m, rows, _ = self._look(other, offset_m, scale)
            weights = np.where(self.is_one, (1.0 + (residual_m / (BEYOND * sigma_m)) ** 2) ** -2 / sigma_m**2, 0.0)
            normal = np.einsum("mki,mk,mkj->mij", rows, weights, rows)
            normal[:, range(self.d, 2 * self.d), range(self.d, 2 * self.d)] += self.speed_m_per_s**-2
            normal[:, range(2 * self.d), range(2 * self.d)] += 1e-3 * sigma_m**-2
            right = np.einsum("mki,mk->mi", rows, weights * residual_m)
            right[:, self.d :] -= other[:, self.d :] * self.speed_m_per_s**-2
            other = other + np.linalg.solve(normal, right[..., None])[..., 0]
        better = self._costs(self._look(other, offset_m, scale)[0], sigma_m) < self._costs(
            self._look(state, offset_m, scale)[0], sigma_m
        )
        return np.where((better & np.isfinite(other).all(axis=1))[:, None], other, state)

    def _costs(self, residual_m: Floats, sigma_m: float) -> Floats:
        """(m,) of each block, where what is far off hardly counts."""
        size2 = (residual_m / sigma_m) ** 2
        costs: Floats = (0.5 * size2 / (1.0 + size2 / BEYOND**2)).sum(axis=1)
        return costs

    def _cost(self, residual_m: Floats, sigma_m: float, last: bool) -> float:
        if last:
            return float(self._costs(residual_m, sigma_m).sum())
        size = np.abs(residual_m) / sigma_m
        return float(np.where(size <= HUBER, 0.5 * size * size, HUBER * (size - 0.5 * HUBER)).sum())


def _spread_m(residual_m: Floats) -> float:
    return MEDIAN_TO_SIGMA * float(np.median(np.abs(residual_m)))


def _start(block: Block, dimension: int, scale: float) -> Floats:
    """Where all ranges of a block about meet, from its linear system; under their anchors where that has no answer."""
    n = len(block.ranges_m)
    sigmas_m, no_limits_m = np.ones(n), np.full(n, NO_LIMIT_M)
    ranges = Ranges(block.anchors_m, block.ranges_m / scale, sigmas_m, no_limits_m, np.zeros(n))
    found = fits.fit(ranges, (1 << n) - 1, dimension == 2, True)
    place_m = found.place
    if dimension == 3 and math.isfinite(found.other_cost) and found.other[2] < place_m[2]:
        place_m = found.other
    start = np.array(place_m[:dimension])
    if np.isfinite(start).all() and start.any():
        return start
    middle_m: Floats = block.anchors_m[:, :dimension].mean(axis=0)
    if dimension == 3:
        middle_m[2] -= 1.0
    return middle_m
