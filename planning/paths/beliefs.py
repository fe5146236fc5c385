"""What the rover's filter will know along a path, before it is driven: covariances, sigmas, bubbles."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import scipy

from navigation import initial_state, predict_bubble
from planning.questions.problems import PathProblem
from visibility import Anchor, DistantAnchor, MovingAnchor

from .sight_maps import Positioning, anchor_at, anchor_places

__all__ = ["expected_sigma_m", "predicted_sigma_m"]

Floats = npt.NDArray[np.float64]

# sigmas further out say no more than "lost"
LOST_M = 100.0
# moving anchors are taken to stand still for so long, or for a part in so many of the whole way
FRAME_S, MOST_FRAMES = 10.0, 100


def predicted_sigma_m(
    problem: PathProblem, points_m: Floats, times_s: Floats, rise: Floats, visible: npt.NDArray[np.bool_]
) -> Floats:
    """(n,) root of the trace of the position's covariance along a path, from navigation's filter.

    points_m: (n, 3) of the antenna. rise: (n, 2) of the ground per metre east and north. visible: (n, anchors).
    """
    model = problem.navigation
    anchors_m, sigma_m, seen = _as_standing(problem, times_s, visible)
    first = initial_state(
        0.0,
        points_m[0],
        position_sigma_m=model.initial_sigma_m,
        velocity_sigma_m_per_s=model.initial_velocity_sigma_m_per_s,
    )
    bubble = predict_bubble(
        points_m,
        times_s,
        anchors_m,
        seen,
        sigma_m,
        motion=model.motion,
        interval_s=model.interval_s,
        initial_covariance=first.covariance,
        ground_slope=rise,
        ground_sigma_m=model.ground_sigma_m,
    )
    return np.sqrt(bubble.trace_m2)


def _as_standing(
    problem: PathProblem, times_s: Floats, visible: npt.NDArray[np.bool_]
) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """(positions, range sigmas, who is in sight) with a moving anchor as one for each of its frames."""
    if not problem.anchors:
        return np.zeros((0, 3)), np.zeros(0), visible
    frame_s = max(FRAME_S, float(times_s[-1]) / MOST_FRAMES)
    frame = np.floor(times_s / frame_s)
    places, sigmas, columns = [], [], []
    for number, anchor in enumerate(problem.anchors):
        moving = not isinstance(anchor, Anchor | DistantAnchor)
        for one in np.unique(frame).tolist() if moving else [None]:
            seen = visible[:, number] & ((frame == one) if one is not None else True)
            middle_s = 0.0 if one is None else (one + 0.5) * frame_s
            place = anchor_places(problem, anchor, np.array([middle_s]))[0]
            if np.isnan(place).any() or not seen.any():
                continue
            places.append(place)
            sigmas.append(_range_sigma_m(problem, anchor, middle_s))
            columns.append(seen)
    if not places:
        return np.zeros((0, 3)), np.zeros(0), np.zeros((len(times_s), 0), np.bool_)
    return np.array(places), np.array(sigmas), np.column_stack(columns)


def _range_sigma_m(problem: PathProblem, anchor: Anchor | DistantAnchor | MovingAnchor, time_s: float) -> float:
    """Of a range to an anchor whose own position is not exact either."""
    there = anchor_at(anchor, problem.departure_s + time_s)
    if there is None:
        return LOST_M
    pose_m = there.pose_sigma_m if isinstance(there, Anchor) else 0.0
    return max(math.hypot(there.ranging_sigma_m, pose_m), 1e-3)


def expected_sigma_m(problem: PathProblem, positioning: Positioning) -> npt.NDArray[np.float32]:
    """(rows - 1, cols - 1) sigma to be expected in each square, whatever the way to it, up to LOST_M.

    Of a fix where there is one; elsewhere that of the nearest square with a fix, grown by the time it takes to come
    from there with nothing but the last velocity.
    """
    sigmas = [_range_sigma_m(problem, anchor, 0.0) for anchor in problem.anchors]
    fix_m = positioning.dop.astype(np.float64) * float(np.mean(sigmas))
    fixed = np.isfinite(fix_m) & (fix_m < LOST_M)
    if not fixed.any():
        return np.full(fix_m.shape, LOST_M, np.float32)
    grid = problem.grid
    away_m, (row, col) = scipy.ndimage.distance_transform_edt(
        ~fixed, (grid.cell_north_m, grid.cell_east_m), return_indices=True
    )
    seconds = away_m / problem.rover.speed_m_per_s
    model = problem.navigation
    psd = float(np.mean(model.motion.psd()[:2]))
    # velocity known to a tenth of its first sigma while there was a fix, then disturbed by white acceleration
    grown_m2 = 2.0 * ((0.1 * model.initial_velocity_sigma_m_per_s * seconds) ** 2 + psd * seconds**3 / 3.0)
    sigma: npt.NDArray[np.float32] = np.minimum(np.sqrt(fix_m[row, col] ** 2 + grown_m2), LOST_M).astype(np.float32)
    return sigma
