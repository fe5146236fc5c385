"""Rauch, Tung and Striebel's smoother: what the whole log says of each stage of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from .kernels import error_state as kernel
from .kernels import strapdown
from .kernels.logs import Stages, Track

__all__ = ["SmoothedTrack", "smooth"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class SmoothedTrack:
    """The smoothed solution at s readings with measurements: position_m, velocity_m_per_s (s, 3), quaternion (s, 4).

    reading: (s,) their numbers. sigmas: (s, n). position_covariance_m2: (s, 3, 3).
    """

    reading: npt.NDArray[np.int64]
    times_s: Array
    position_m: Array
    velocity_m_per_s: Array
    quaternion: Array
    sigmas: Array
    position_covariance_m2: Array


def smooth(times_s: Array, track: Track, stages: Stages) -> SmoothedTrack:
    """Go back through the stages of a filtered log; the errors that later measurements tell are fed into it."""
    count, size = stages.corrections.shape
    error, covariance = np.zeros(size), stages.after[-1].copy()
    errors, covariances = np.zeros((count, size)), np.zeros((count, size, size))
    covariances[-1] = covariance
    for stage in range(count - 2, -1, -1):
        before, after = stages.before[stage + 1], stages.after[stage]
        # scaled to ones on the diagonal, for the numbers of a state differ by ten orders of magnitude
        scale = np.sqrt(np.maximum(np.diag(before), 1e-300))
        crossed = (after @ stages.transitions[stage + 1].T) / scale
        gain = np.linalg.lstsq(before / np.outer(scale, scale), crossed.T, rcond=1e-14)[0].T / scale
        error = gain @ (error + stages.corrections[stage + 1])
        covariance = after + gain @ (covariance - before) @ gain.T
        covariance = 0.5 * (covariance + covariance.T)
        errors[stage], covariances[stage] = error, covariance
    reading = stages.readings
    quaternion = np.zeros((count, 4))
    turn = np.zeros(4)
    for stage in range(count):
        strapdown.quaternion_of(errors[stage, kernel.PSI : kernel.PSI + 3].copy(), turn)
        strapdown.turned(turn, track.quaternions[reading[stage]], quaternion[stage])
    return SmoothedTrack(
        reading,
        times_s[reading],
        track.positions[reading] + errors[:, kernel.POSITION : kernel.POSITION + 3],
        track.velocities[reading] + errors[:, kernel.VELOCITY : kernel.VELOCITY + 3],
        quaternion,
        np.sqrt(np.maximum(np.diagonal(covariances, axis1=1, axis2=2), 0.0)),
        covariances[:, :3, :3].copy(),
    )
