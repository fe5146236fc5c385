"""Whether the filter's covariance is the truth: NEES and NIS over many runs, without and with hidden anchors."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

import navigation
from navigation.kernels.tracks import step_many

__all__ = ["shares_inside"]

Array = npt.NDArray[np.float64]

ANCHORS_M = np.array(
    [(900, 100, 300), (-800, 400, 250), (100, -900, 400), (-200, 700, 120),
     (600, -500, 350), (-700, -600, 200), (300, 900, 450), (-100, -100, 500)], float,
)  # fmt: skip
MOTION = navigation.MotionNoise(0.05, 0.05, 0.02)
RANGE_SIGMA_M, STEP_S = 0.5, 1.0
HIDDEN_ANCHORS, HIDDEN_SHARE, LATE_M = 3, 0.4, 20.0


def shares_inside(runs: int, steps: int, seed: int, *, hidden: bool, excluded: bool) -> tuple[float, float]:
    """Shares of steps at which the mean NEES of the position and the mean NIS lie within their two-sided 95 % bounds.

    hidden: three of eight anchors are out of sight for two fifths of the steps, and late by 20 m on average then;
    excluded: those are left out, as a map predicts them.
    """
    generator = np.random.default_rng(seed)
    start = navigation.initial_state(0.0, (0.0, 0.0, 30.0), position_sigma_m=5.0)
    root = np.linalg.cholesky(start.covariance)
    truth = start.mean + generator.normal(size=(runs, 6)) @ root.T
    means, covariances = np.tile(start.mean, (runs, 1)), np.tile(start.covariance, (runs, 1, 1))
    noise_root = np.linalg.cholesky(_process_noise())
    nees_inside, nis_inside = 0, 0
    for _ in range(steps):
        truth[:, ::2] += STEP_S * truth[:, 1::2]
        truth += generator.normal(size=(runs, 6)) @ noise_root.T
        measured_m = np.linalg.norm(ANCHORS_M - truth[:, None, ::2], axis=2)
        measured_m += generator.normal(0.0, RANGE_SIGMA_M, measured_m.shape)
        variances_m2 = np.full(measured_m.shape, RANGE_SIGMA_M**2)
        if hidden:
            late = generator.random((runs, HIDDEN_ANCHORS)) < HIDDEN_SHARE
            measured_m[:, :HIDDEN_ANCHORS] += late * generator.exponential(LATE_M, late.shape)
            if excluded:
                variances_m2[:, :HIDDEN_ANCHORS][late] = np.inf
        found = np.zeros((*measured_m.shape, 3))
        ungated = np.inf, np.zeros((runs, 1))
        step_many(means, covariances, STEP_S, MOTION.psd(), ANCHORS_M, (measured_m, variances_m2), ungated, found)
        error_m = (means - truth)[:, ::2]
        nees = np.einsum("si,sij,sj->s", error_m, np.linalg.inv(covariances[:, ::2, ::2]), error_m)
        low, high = navigation.mean_bounds(3, runs)
        nees_inside += low <= nees.mean() <= high
        used = found[..., 2] == navigation.Verdict.USED
        squares = found[..., 0][used] ** 2 / found[..., 1][used]
        low, high = navigation.mean_bounds(1, len(squares))
        nis_inside += low <= squares.mean() <= high
    return nees_inside / steps, nis_inside / steps


def _process_noise() -> Array:
    """(6, 6) of one step (eq. 31)."""
    pair = np.array([[STEP_S**3 / 3.0, STEP_S**2 / 2.0], [STEP_S**2 / 2.0, STEP_S]])
    return np.kron(np.diag(MOTION.psd()[:3]), pair)
