"""A filter that holds though ranges lie: hypotheses about which do, and for how long, bound the bubble."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from .errors import MeasurementError, StateError, TimeOrderError
from .inputs import numbers, positions
from .kernels import hypotheses as kernel
from .motion import MotionNoise
from .states import FilterState

__all__ = ["OcclusionBelief", "OcclusionModel", "carry_hypotheses", "correct_hypotheses", "update_hypotheses"]

Array = npt.NDArray[np.float64]
STATE = 6
# so many hypotheses are carried at most, 32 sets of five anchors under three regimes
MOST = 96
MOST_ANCHORS = 16


@dataclass(frozen=True, slots=True)
class OcclusionModel:
    """How ranges lie.

    shares: of the ranges that do; lasting_s: how long one goes on lying, 0 = the next is as likely to lie as any. Each
    pair is a regime; all are carried, and the ranges decide. An excess is at least least_m, and in the mean
    mean_beyond_m longer than that, exponentially. Raises MeasurementError.
    """

    shares: tuple[float, ...] = (0.02, 0.2, 0.2)
    lasting_s: tuple[float, ...] = (0.0, 0.0, 15.0)
    least_m: float = 1.0
    mean_beyond_m: float = 4.0

    def __post_init__(self) -> None:
        if not self.shares or len(self.shares) != len(self.lasting_s):
            raise MeasurementError("shares and lasting_s make the regimes: as many of the one as of the other.")
        if not all(0.0 < share < 1.0 for share in self.shares):
            raise MeasurementError("Each share must lie between 0 and 1.")
        if not all(0.0 <= lasting < math.inf for lasting in self.lasting_s):
            raise MeasurementError("Each lasting_s must be zero or more.")
        if not (0.0 <= self.least_m < math.inf and 0.0 < self.mean_beyond_m < math.inf):
            raise MeasurementError("least_m must be zero or more, mean_beyond_m above zero.")


@dataclass(frozen=True, eq=False)
class OcclusionBelief:
    """What is believed after the ranges of an instant, of k anchors: h hypotheses with their probabilities.

    means (h, 6 + k), covariances (h, 6 + k, 6 + k): as those of ``FilterState``, then the excess of each anchor's
    range. lying: (h, k) bool. regimes: (h,) of the model. probabilities: (h,), their sum is 1.
    """

    time_s: float
    means: Array
    covariances: Array
    lying: npt.NDArray[np.bool_]
    regimes: npt.NDArray[np.int64]
    probabilities: Array

    def state(self) -> FilterState:
        """All hypotheses together as one Gaussian: the bubble of its covariance bounds them all."""
        bank, mean, covariance = self._bank(len(self.means)), np.zeros(STATE), np.zeros((STATE, STATE))
        kernel.blend(bank, mean, covariance)
        return FilterState(self.time_s, mean, 0.5 * (covariance + covariance.T))

    @property
    def occluded(self) -> Array:
        """(k,) probability that the last range to each anchor lied."""
        share: Array = self.probabilities @ self.lying
        return share

    def _bank(self, room: int) -> kernel.Bank:
        held, n = self.means.shape
        bank = kernel.Bank(
            np.zeros((room, n)),
            np.zeros((room, n, n)),
            np.zeros((room, n - STATE), np.uint8),
            np.zeros(room, np.int64),
            np.zeros(room),
            np.array([held]),
        )
        bank.means[:held], bank.covariances[:held] = self.means, self.covariances
        bank.lying[:held], bank.regimes[:held] = self.lying, self.regimes
        bank.weights[:held] = np.log(self.probabilities)
        return bank


def carry_hypotheses(
    starts: FilterState | Sequence[FilterState], anchors: int, model: OcclusionModel | None = None
) -> OcclusionBelief:
    """The beliefs to begin with, without a clock: one, or both sides of a coplanar set of anchors, alike likely.

    All of one time. anchors: how many there will be. Raises StateError.
    """
    sides = [starts] if isinstance(starts, FilterState) else list(starts)
    asked = OcclusionModel() if model is None else model
    if not sides or len({side.time_s for side in sides}) > 1 or any(side.mean.size != STATE for side in sides):
        raise StateError("Hypotheses begin with one state or more, all of one time and without a clock.")
    if not 1 <= anchors <= MOST_ANCHORS or len(sides) * len(asked.shares) > MOST:
        raise StateError(f"There may be 1 to {MOST_ANCHORS} anchors, and {MOST} hypotheses.")
    regimes = len(asked.shares)
    held = len(sides) * regimes
    means, covariances = np.zeros((held, STATE + anchors)), np.zeros((held, STATE + anchors, STATE + anchors))
    for number, side in enumerate(sides):
        rows = slice(number * regimes, (number + 1) * regimes)
        means[rows, :STATE], covariances[rows, :STATE, :STATE] = side.mean, side.covariance
    return OcclusionBelief(
        sides[0].time_s,
        means,
        covariances,
        np.zeros((held, anchors), bool),
        np.tile(np.arange(regimes), len(sides)),
        np.full(held, 1.0 / held),
    )


def update_hypotheses(
    belief: OcclusionBelief,
    time_s: float,
    motion: MotionNoise,
    anchors_m: npt.ArrayLike,
    measured_m: npt.ArrayLike,
    variances_m2: npt.ArrayLike,
    *,
    sight: npt.ArrayLike = 1.0,
    model: OcclusionModel | None = None,
) -> OcclusionBelief:
    """The belief after ranges of one instant: each is right, lies by as much as before, or by another excess.

    anchors_m: (k, 3), measured_m: (k,), NaN = not measured, variances_m2: (k,) or one, inf = left out. sight: (k,) or
    one, probability that the map gives to each anchor being in sight: one that is hidden lies. model: that of
    ``carry_hypotheses``. Raises MeasurementError, TimeOrderError.
    """
    asked = OcclusionModel() if model is None else model
    anchors = positions("anchors_m", anchors_m)
    shape = (len(anchors),)
    if belief.means.shape[1] != STATE + len(anchors):
        raise MeasurementError(f"The belief is about {belief.means.shape[1] - STATE} anchors, not {len(anchors)}.")
    if int(belief.regimes.max()) >= len(asked.shares):
        raise MeasurementError("The belief was begun with another model: it has more regimes.")
    measured = numbers("measured_m", measured_m, shape)
    variances = numbers("variances_m2", np.broadcast_to(variances_m2, shape), shape)
    seen = numbers("sight", np.broadcast_to(sight, shape), shape)
    if np.isinf(measured).any() or not (variances > 0.0).all() or not ((seen >= 0.0) & (seen <= 1.0)).all():
        raise MeasurementError(
            "measured_m must be finite or NaN, variances_m2 above zero, and sight probabilities from 0 to 1."
        )
    since_s = float(time_s) - belief.time_s
    if not 0.0 <= since_s < math.inf:
        raise TimeOrderError(f"time_s must not go backwards: {time_s} s follows {belief.time_s} s.")
    bank, spare = belief._bank(MOST), belief._bank(MOST)
    kernel.advance_bank(bank, since_s, motion.psd())
    regimes, law = np.array([asked.shares, asked.lasting_s]).T.copy(), np.array([asked.least_m, asked.mean_beyond_m])
    scratch = np.zeros((MOST, 3, 4))
    for a in np.flatnonzero(~np.isnan(measured) & np.isfinite(variances)):
        # a sight of 0 or 1 would rule out what only the model may rule out
        told = anchors[a], measured[a], variances[a], since_s, float(np.clip(seen[a], 1e-6, 1.0))
        kernel.take_range(bank, spare, int(a), told, regimes, law, scratch)
    kernel.merge(bank)
    held = int(bank.held[0])
    weights = np.exp(bank.weights[:held] - bank.weights[:held].max())
    return OcclusionBelief(
        float(time_s),
        bank.means[:held].copy(),
        bank.covariances[:held].copy(),
        bank.lying[:held].astype(bool),
        bank.regimes[:held].copy(),
        weights / weights.sum(),
    )


def correct_hypotheses(
    belief: OcclusionBelief, measured: npt.ArrayLike, rows: npt.ArrayLike, noise: npt.ArrayLike
) -> OcclusionBelief:
    """The belief after something that is linear in place and velocity, and does not lie: a speed, the ground's height.

    measured: (m,); rows: (m, 6), in the order of ``FilterState``; noise: (m, m). Hypotheses that it does not fit become
    less likely. Raises MeasurementError.
    """
    z = np.atleast_1d(np.array(measured, np.float64))
    h = np.zeros((z.size, belief.means.shape[1]))
    h[:, :STATE] = numbers("rows", rows, (z.size, STATE))
    spread = numbers("noise", noise, (z.size, z.size))
    if not all(np.isfinite(one).all() for one in (z, h, spread)) or np.linalg.eigvalsh(spread)[0] <= 0.0:
        raise MeasurementError("measured and rows must be finite, and noise a covariance above zero.")
    innovation = z - belief.means @ h.T
    crossed = belief.covariances @ h.T
    total = h @ crossed + spread
    gain = np.linalg.solve(total, np.swapaxes(crossed, 1, 2)).swapaxes(1, 2)
    kept = np.eye(belief.means.shape[1]) - gain @ h
    covariances = kept @ belief.covariances @ kept.swapaxes(1, 2) + gain @ spread @ gain.swapaxes(1, 2)
    misfit = np.einsum("hi,hi->h", innovation, np.linalg.solve(total, innovation[..., None])[..., 0])
    fits = np.log(np.maximum(belief.probabilities, 1e-300)) - 0.5 * (misfit + np.linalg.slogdet(total)[1])
    weights = np.exp(fits - fits.max())
    means = belief.means + np.einsum("hij,hj->hi", gain, innovation)
    return replace(belief, means=means, covariances=covariances, probabilities=weights / weights.sum())
