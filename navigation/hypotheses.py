"""A session's filter that carries what ranges may be: its bubble holds though some lie and nobody says which."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from detection import DetectorSettings, EpochResult, Motion, PositionFix, RangeEpoch, RangingAnchor, Rejection, Sight

from .errors import StateError
from .estimators import (
    SILENCE_S,
    SLOW,
    ConstantVelocityEstimator,
    Estimator,
    LostTrack,
    RoverEstimate,
    begun,
    driven,
    estimate,
    ground_row,
)
from .motion import MotionNoise
from .occlusions import (
    MOST_ANCHORS,
    OcclusionBelief,
    OcclusionModel,
    carry_hypotheses,
    correct_hypotheses,
    update_hypotheses,
)

__all__ = ["ESTIMATORS", "HypothesesEstimator"]

Array = npt.NDArray[np.float64]
LIKELY = 0.5


class HypothesesEstimator:
    """The hypotheses of ``update_hypotheses`` behind a detector, in three dimensions, from epoch to epoch.

    It takes every range as it comes, but for those too short, with the probability of sight that the map gives; the
    detector's verdicts, drawn from the same ranges, do not weigh a second time. It begins at a position that redundant
    ranges confirm, on both sides of anchors that lie in a plane. Ground and odometry count as for
    ``ConstantVelocityEstimator``. Raises StateError.
    """

    def __init__(self, anchors: Sequence[RangingAnchor], settings: DetectorSettings) -> None:
        if settings.dimension != 3:
            raise StateError("The filter of hypotheses works in three dimensions; leave dimension at 3.")
        if not 1 <= len(anchors) <= MOST_ANCHORS:
            raise StateError(f"The filter of hypotheses works with 1 to {MOST_ANCHORS} anchors, not {len(anchors)}.")
        self._settings = settings
        self._anchors = {anchor.id: anchor for anchor in anchors}
        level, upright = settings.acceleration_m_per_s2**2, settings.vertical_acceleration_m_per_s2**2
        self._motion = MotionNoise(level, level, upright)
        # an excess as the settings have it, made up as that of the model's own: a fifth at least, the rest beyond it
        self._model = OcclusionModel(least_m=0.2 * settings.excess_m, mean_beyond_m=0.8 * settings.excess_m)
        self._belief: OcclusionBelief | None = None
        self._lost = LostTrack()

    def step(self, epoch: RangeEpoch, result: EpochResult, motion: Motion | None) -> RoverEstimate | None:
        """As ``Estimator.step`` has it."""
        self._anchors |= {anchor.id: anchor for anchor in epoch.moved if anchor.id in self._anchors}
        if result.rejection is not None:
            return None
        time_s = epoch.time_s - self._settings.ranging_offset_s
        belief = self._belief
        if belief is None or not 0.0 <= time_s - belief.time_s <= SILENCE_S:
            self._belief = self._begun(time_s, result.position)
            return None if self._belief is None else estimate(self._belief.state(), epoch.time_s, (), False)
        heard = self._rounds(epoch, result, time_s)
        for at_s, measured, variances, sight in heard:
            belief = self._taken(belief, max(at_s, belief.time_s), measured, variances, sight)
        nothing = np.full(len(self._anchors), np.nan)
        belief = self._taken(belief, time_s, nothing, np.ones_like(nothing), np.ones_like(nothing))
        if motion is not None and motion.reliable:
            told = driven(belief.state(), motion, self._settings.acceleration_m_per_s2)
            belief = belief if told is None else correct_hypotheses(belief, *told)
        if epoch.ground is not None and all(one.reason is not Rejection.BAD_GROUND for one in result.rejected):
            surface = ground_row(belief.state(), epoch.ground)
            belief = belief if surface is None else correct_hypotheses(belief, *surface)
        reacquired = self._lost.found(belief.state(), result.position)
        if reacquired:
            belief = self._begun(time_s, result.position) or belief
        self._belief = belief
        came = np.logical_or.reduce([~np.isnan(measured) for _, measured, _, _ in heard] or [np.zeros(0, bool)])
        likely = [
            name
            for name, here, lies in zip(self._anchors, came, belief.occluded, strict=False)
            if here and lies < LIKELY
        ]
        return estimate(belief.state(), epoch.time_s, tuple(likely), reacquired)

    def _begun(self, time_s: float, fix: PositionFix | None) -> OcclusionBelief | None:
        """Where the detector's checked position is, and on the other side of a plane of anchors as well."""
        one = begun(time_s, fix, self._settings)
        if one is None or fix is None:
            return None
        sides = [one]
        if fix.mirror_m is not None:
            mean = one.mean.copy()
            mean[0::2] = fix.mirror_m
            sides.append(replace(one, mean=mean))
        return carry_hypotheses(sides, len(self._anchors), self._model)

    def _taken(
        self, belief: OcclusionBelief, at_s: float, measured: Array, variances: Array, sight: Array
    ) -> OcclusionBelief:
        places = np.array([(one.east_m, one.north_m, one.altitude_m) for one in self._anchors.values()])
        return update_hypotheses(
            belief, at_s, self._motion, places, measured, variances, sight=sight, model=self._model
        )

    def _rounds(self, epoch: RangeEpoch, result: EpochResult, time_s: float) -> list[tuple[float, Array, Array, Array]]:
        """By time: of each anchor the range, NaN = none, its variance, and the probability of sight foretold."""
        settings = self._settings
        judged = {one.anchor_id for one in result.verdicts if one.sight is not Sight.TOO_SHORT}
        names, shape = {name: number for number, name in enumerate(self._anchors)}, len(self._anchors)
        rounds: dict[float, tuple[Array, Array, Array]] = {}
        for one in epoch.ranges:
            if one.anchor_id not in judged:
                continue
            at_s = time_s if one.time_s is None else min(one.time_s - settings.ranging_offset_s, time_s)
            measured, variances, sight = rounds.setdefault(
                at_s, (np.full(shape, np.nan), np.ones(shape), np.ones(shape))
            )
            anchor, number = self._anchors[one.anchor_id], names[one.anchor_id]
            sigma_m = math.hypot(one.sigma_m or settings.range_sigma_m, anchor.sigma_m or settings.anchor_sigma_m)
            measured[number], variances[number] = one.range_m, (SLOW * sigma_m) ** 2
            sight[number] = 1.0 if one.p_sight is None else one.p_sight
        return [(at_s, *told) for at_s, told in sorted(rounds.items(), key=lambda pair: pair[0])]


# a session's filters by the name that requests have for them
ESTIMATORS: dict[str, Callable[[Sequence[RangingAnchor], DetectorSettings], Estimator]] = {
    "constant_velocity": ConstantVelocityEstimator,
    "hypotheses": HypothesesEstimator,
}
