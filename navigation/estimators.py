"""What a session's own filter makes of its epochs: one state and one covariance of ranges, verdicts, ground, odometry.

A detector says which ranges to lean on, a map how high the antenna is, wheels how fast it goes; an ``Estimator`` takes
them as they come. Another filter that has its ``step`` and answers a ``RoverEstimate`` may stand in its place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from detection import (
    DetectorSettings,
    EpochResult,
    GroundHeight,
    Motion,
    PositionFix,
    RangeEpoch,
    RangingAnchor,
    Rejection,
)

from .bubbles import bubble_radius_m
from .errors import StateError
from .linear import linear_update, update_ground
from .motion import MotionNoise
from .ranging import RangeUpdate, predict, update_ranges
from .states import POSITION, FilterState, initial_state

__all__ = ["ConstantVelocityEstimator", "Estimator", "RoverEstimate"]

Array = npt.NDArray[np.float64]

GATE = 4.0  # sigmas beyond which no range and no ground is believed, whatever its verdict
SIGMAS = 3.0  # in a bubble
SILENCE_S = 30.0  # without an epoch for so long it begins anew
LEAST_WEIGHT = 1e-3
# A good part of a range's error stays for seconds, and what is called clear may be a little too long all along: epochs
# after one another do not average that out.
SLOW = 2.0
SOFT = 2.0  # sigmas from which a range pulls clearly less
LOST_EPOCHS = 5
FAST = 3.0  # sigmas from which a velocity has a direction
ORDER = [0, 2, 4, 1, 3, 5]  # of the filter's numbers: place, then velocity


@dataclass(frozen=True, slots=True, eq=False)
class RoverEstimate:
    """Where a rover is and how it moves after an epoch, by one filter.

    time_s: of the epoch, on the ranging clock. position_m, velocity_m_per_s: (3,) east, north, up.
    covariance: (6, 6) of both, position first. bubble_m: radius of the safety bubble, three sigmas.
    used: ids of the ranges that it leaned on. reacquired: it was found lost and widened.
    """

    time_s: float
    position_m: Array
    velocity_m_per_s: Array
    covariance: Array
    bubble_m: float
    used: tuple[str, ...]
    reacquired: bool


class Estimator(Protocol):
    """A filter that goes along with a detector; changed in place, not for two threads at once."""

    def step(self, epoch: RangeEpoch, result: EpochResult, motion: Motion | None) -> RoverEstimate | None:
        """The belief after an epoch and what a detector answered to it; None before it has begun.

        motion: ``Detector.motion``, the epoch's odometry with its heading set right.
        """
        ...


class LostTrack:
    """Whether positions that redundant ranges confirm have been elsewhere for some epochs in a row."""

    def __init__(self) -> None:
        self._elsewhere = 0

    def found(self, state: FilterState, fix: PositionFix | None) -> bool:
        """Whether it is so after one more epoch; it then counts from the beginning."""
        if fix is None or not fix.checked or fix.mirror_m is not None:
            return False
        off_m = fix.position_m - state.position_m
        apart2 = float(off_m @ np.linalg.solve(fix.covariance_m2 + state.position_covariance_m2, off_m))
        self._elsewhere = self._elsewhere + 1 if apart2 > GATE**2 else 0
        lost = self._elsewhere >= LOST_EPOCHS
        if lost:
            self._elsewhere = 0
        return lost


class ConstantVelocityEstimator:
    """The Kalman filter at constant velocity (De Vivo et al., eqs. 28-35) behind a detector, in three dimensions.

    It begins at a position that redundant ranges confirm. A range weighs by the probability that it is not off, and by
    how well it fits; one that is occluded or too short is left out. The ground makes its height as sure as the map,
    never surer. Where the detector's checked position is elsewhere for long it begins anew there. Raises StateError.
    """

    def __init__(self, anchors: Sequence[RangingAnchor], settings: DetectorSettings) -> None:
        if settings.dimension != 3:
            raise StateError("A filter that goes along works in three dimensions; leave dimension at 3.")
        self._settings = settings
        self._anchors = {anchor.id: anchor for anchor in anchors}
        level, upright = settings.acceleration_m_per_s2**2, settings.vertical_acceleration_m_per_s2**2
        self._motion = MotionNoise(level, level, upright)
        self._state: FilterState | None = None
        self._lost = LostTrack()

    def step(self, epoch: RangeEpoch, result: EpochResult, motion: Motion | None) -> RoverEstimate | None:
        """As ``Estimator.step`` has it."""
        self._anchors |= {anchor.id: anchor for anchor in epoch.moved if anchor.id in self._anchors}
        if result.rejection is not None:
            return None
        time_s = epoch.time_s - self._settings.ranging_offset_s
        if self._state is None or not 0.0 <= time_s - self._state.time_s <= SILENCE_S:
            self._state = self._begun(time_s, result.position)
            return None if self._state is None else estimate(self._state, epoch.time_s, (), False)
        state = self._state
        rounds, used, reacquired = self._rounds(epoch, result, time_s), list[str](), False
        for at_s, heard in rounds:
            state = predict(state, max(at_s, state.time_s), self._motion)
            anchors_m, ranges_m, variances_m2 = (np.array(column) for column in zip(*heard.values(), strict=True))
            update = _update(state, anchors_m, ranges_m, variances_m2)
            state = update.state
            used += [name for name, taken in zip(heard, update.taken.tolist(), strict=True) if taken]
        state = predict(state, time_s, self._motion)
        if motion is not None and motion.reliable:
            told = driven(state, motion, self._settings.acceleration_m_per_s2)
            state = state if told is None else _corrected(state, *told)
        if epoch.ground is not None and all(one.reason is not Rejection.BAD_GROUND for one in result.rejected):
            state = _on_ground(state, epoch.ground)
        if self._lost.found(state, result.position):
            state, reacquired = self._begun(time_s, result.position) or state, True
        self._state = state
        return estimate(state, epoch.time_s, tuple(used), reacquired)

    def _begun(self, time_s: float, fix: PositionFix | None) -> FilterState | None:
        """A first belief where the position is the only one."""
        return None if fix is None or fix.mirror_m is not None else begun(time_s, fix, self._settings)

    def _rounds(
        self, epoch: RangeEpoch, result: EpochResult, time_s: float
    ) -> list[tuple[float, dict[str, tuple[tuple[float, float, float], float, float]]]]:
        """By time: of each anchor that is not off, its place, range and variance over the weight of its verdict.

        Where nothing confirms the verdicts, a range may be as much too long as an occluded one typically is.
        """
        settings = self._settings
        weights = {one.anchor_id: 1.0 - one.probability for one in result.verdicts if not one.off}
        unchecked_m = 0.0 if result.position is not None and result.position.checked else settings.excess_m
        rounds: dict[float, dict[str, tuple[tuple[float, float, float], float, float]]] = {}
        for one in epoch.ranges:
            if one.anchor_id not in weights:
                continue
            anchor = self._anchors[one.anchor_id]
            at_s = time_s if one.time_s is None else min(one.time_s - settings.ranging_offset_s, time_s)
            sigma_m = math.hypot(one.sigma_m or settings.range_sigma_m, anchor.sigma_m or settings.anchor_sigma_m)
            variance_m2 = ((SLOW * sigma_m) ** 2 + unchecked_m**2) / max(weights[one.anchor_id], LEAST_WEIGHT)
            place_m = (anchor.east_m, anchor.north_m, anchor.altitude_m)
            rounds.setdefault(at_s, {})[one.anchor_id] = place_m, one.range_m, variance_m2
        return sorted(rounds.items())


def _update(state: FilterState, anchors_m: Array, ranges_m: Array, variances_m2: Array) -> RangeUpdate:
    """The belief after ranges of one instant; each pulls by the less the further it is off (Geman and McClure)."""
    looked = update_ranges(state, anchors_m, ranges_m, variances_m2)
    size2 = looked.innovation_m**2 / looked.innovation_variance_m2
    weighed_m2 = np.where(size2 <= GATE**2, variances_m2 * (1.0 + size2 / SOFT**2) ** 2, np.inf)
    return update_ranges(state, anchors_m, ranges_m, weighed_m2)


def begun(time_s: float, fix: PositionFix | None, settings: DetectorSettings) -> FilterState | None:
    """A first belief at a position that redundant ranges confirm."""
    if fix is None or not fix.checked:
        return None
    speed = settings.max_speed_m_per_s / 3.0
    state = initial_state(time_s, fix.position_m, velocity_sigma_m_per_s=(speed, speed, 0.3 * speed))
    covariance = state.covariance.copy()
    covariance[POSITION, POSITION] = fix.covariance_m2
    return replace(state, covariance=covariance)


def driven(state: FilterState, motion: Motion, acceleration_m_per_s2: float) -> tuple[Array, Array, Array] | None:
    """(measured (m,), rows (m, 6), noise (m, m)): how fast odometry says the rover went, which way where it is told.

    None: it says nothing. Along the way its length errs, to either side its heading does too; what it speeds up or
    turns within comes on top.
    """
    turned = acceleration_m_per_s2 * math.sqrt(motion.duration_s / 3.0)  # mean velocity against that at the end
    ahead = math.hypot(motion.sigma_m / motion.duration_s, turned)
    level = state.velocity_m_per_s[:2]
    if motion.displacement_m is not None:
        told = np.array(motion.displacement_m) / motion.duration_s
        across = math.hypot(motion.across_m / motion.duration_s, ahead)
        way, speed = _way(told), float(np.hypot(*told))
        rows = np.zeros((2, state.mean.size))
        rows[:, [1, 3]] = way, (way[1], -way[0])
        return np.array([speed, 0.0]), rows, np.diag([ahead**2, across**2])
    speed = float(np.hypot(*level))
    variances = np.diag(state.covariance)
    if speed**2 <= FAST**2 * (variances[1] + variances[3]):
        return None  # a length says nothing of a way that is not known
    rows = np.zeros((1, state.mean.size))
    rows[0, [1, 3]] = level / speed
    return np.array([motion.length_m / motion.duration_s]), rows, np.array([[ahead**2]])


def _way(level: Array) -> Array:
    """(2,) unit vector east, north; east where there is no way."""
    length = float(np.hypot(*level))
    return level / length if length > 0.0 else np.array([1.0, 0.0])


def _corrected(state: FilterState, measured: Array, rows: Array, noise: Array) -> FilterState:
    found = linear_update(state.mean, state.covariance, measured, rows, noise)
    return replace(state, mean=found.mean, covariance=found.covariance)


def ground_row(state: FilterState, ground: GroundHeight) -> tuple[Array, Array, Array] | None:
    """(measured (1,), rows (1, 6), noise (1, 1)) of the height of a rover that stands on ground a map knows.

    The same ground errs the same way epoch after epoch, so the height over it becomes as sure as that, never surer:
    None where it is already.
    """
    over = np.array([-ground.slope_east, -ground.slope_north, 1.0])
    variance_m2, told_m2 = float(over @ state.position_covariance_m2 @ over), ground.sigma_m**2
    if variance_m2 <= told_m2:
        return None
    row = np.zeros((1, state.mean.size))
    row[0, 0:6:2] = over
    level_m = ground.altitude_m + over[:2] @ np.array([ground.east_m, ground.north_m])
    return np.array([level_m]), row, np.array([[variance_m2 * told_m2 / (variance_m2 - told_m2)]])


def _on_ground(state: FilterState, ground: GroundHeight) -> FilterState:
    """The belief of a rover that stands on ground a map knows, unless it lies far off."""
    told = ground_row(state, ground)
    if told is None:
        return state
    (plane_m,), _, ((variance_m2,),) = (part.tolist() for part in told)
    slope = (ground.slope_east, ground.slope_north)
    level_m = plane_m + float(np.dot(slope, state.position_m[:2]))
    return update_ground(state, level_m, slope, sigma_m=math.sqrt(variance_m2), gate_sigma=GATE).state


def estimate(state: FilterState, time_s: float, used: tuple[str, ...], reacquired: bool) -> RoverEstimate:
    """What is told of a belief."""
    covariance = state.covariance[np.ix_(ORDER, ORDER)]
    radius_m = float(bubble_radius_m(covariance[:3, :3], SIGMAS))
    position_m, velocity = state.position_m.copy(), state.velocity_m_per_s.copy()
    return RoverEstimate(time_s, position_m, velocity, covariance, radius_m, used, reacquired)
