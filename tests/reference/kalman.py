"""The extended Kalman filter of ranges, matrix by matrix as De Vivo et al. print it (Table III, eqs. 28-35)."""

import numpy as np


def transition(size, step_s):
    matrix = np.eye(size)
    for i in range(0, size, 2):
        matrix[i, i + 1] = step_s
    return matrix


def process_noise(psd, step_s):
    block = np.array([[step_s**3 / 3.0, step_s**2 / 2.0], [step_s**2 / 2.0, step_s]])
    size = 2 * len(psd)
    matrix = np.zeros((size, size))
    for i, q in enumerate(psd):
        matrix[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = q * block
    return matrix


def predicted(mean, covariance, psd, step_s):
    f = transition(len(mean), step_s)
    return f @ mean, f @ covariance @ f.T + process_noise(psd, step_s)


def expected_ranges(mean, anchors_m):
    ranges_m = np.array([np.linalg.norm(mean[[0, 2, 4]] - anchor) for anchor in anchors_m])
    return ranges_m + (mean[6] if len(mean) == 8 else 0.0)


def numerical_jacobian(mean, anchors_m, step=1e-4):
    columns = []
    for i in range(len(mean)):
        nudge = np.zeros(len(mean))
        nudge[i] = step
        columns.append(
            (expected_ranges(mean + nudge, anchors_m) - expected_ranges(mean - nudge, anchors_m)) / (2 * step)
        )
    return np.column_stack(columns)


def analytic_jacobian(mean, anchors_m):
    rows = np.zeros((len(anchors_m), len(mean)))
    for row, anchor in zip(rows, anchors_m, strict=True):
        away = mean[[0, 2, 4]] - anchor
        row[[0, 2, 4]] = away / np.linalg.norm(away)
        if len(mean) == 8:
            row[6] = 1.0
    return rows


def updated(mean, covariance, h, innovation, r):
    """Table III; (mean, covariance, P_zz)."""
    p_zz = h @ covariance @ h.T + r
    gain = covariance @ h.T @ np.linalg.inv(p_zz)
    return mean + gain @ innovation, covariance - gain @ p_zz @ gain.T, p_zz
