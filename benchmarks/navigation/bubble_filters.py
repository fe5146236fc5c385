"""The weak solution and the proposed one of De Vivo et al., IV-B, over many simulated flights at once."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import navigation
from benchmarks.navigation.bubble_case import Case, Draws, Leg, heard
from navigation.kernels.tracks import step_many
from terrain import height_at
from visibility import visible_sets
from visibility.dilution import dop_at_points, pack_sets

__all__ = ["EPSILON", "Method", "Tracks", "bend_m2", "fly_filters"]

Array = npt.NDArray[np.float64]

EPSILON = 3.0
START_SIGMA_M, START_SIGMA_M_PER_S = 10.0, 1.0
# power of the flight's own accelerations at low frequencies, east or north (0.3 and 1.0) and up (0.18), before any run
MOTION = navigation.MotionNoise(1.0, 1.0, 0.2, 0.01)


@dataclass(frozen=True, slots=True)
class Method:
    """hidden_factor: what µ of a range without line of sight is multiplied by, inf = left out (eq. 26).

    second_order: whether R grows by what the bend of a range over the belief's spread adds.
    """

    name: str
    hidden_factor: float
    gate_sigma: float = math.inf
    second_order: bool = False


@dataclass(frozen=True, eq=False)
class Tracks:
    """s flights of n epochs. error_m: (s, n, 3) estimate less truth; covariance_m2: (s, n, 3, 3). nis, used: (s, n)."""

    error_m: Array
    covariance_m2: Array
    nis: Array
    used: npt.NDArray[np.int64]

    @property
    def distance_m(self) -> Array:
        """(s, n) how far the estimate is from the truth."""
        return np.asarray(np.linalg.norm(self.error_m, axis=-1))

    @property
    def radius_m(self) -> Array:
        """(s, n) of the bubble."""
        return navigation.bubble_radius_m(self.covariance_m2, EPSILON)


def fly_filters(case: Case, methods: list[Method], count: int, seed: int, *, reflect: bool = True) -> list[Tracks]:
    """Every method over the same simulated ranges of ``count`` flights; reflect: whether hidden anchors are heard."""
    generator = np.random.default_rng(seed)
    usual = {method: _usual_dilution(case, method) for method in methods}
    draws = Draws(case, count, generator)
    size = 8 if case.has_clock else 6
    first_m, epochs = case.points_m[0], len(case.points_m)
    velocity = (case.points_m[1] - first_m) / (case.times_s[1] - case.times_s[0])
    start = navigation.initial_state(
        0.0, first_m, velocity, position_sigma_m=START_SIGMA_M, velocity_sigma_m_per_s=START_SIGMA_M_PER_S,
        clock_m=(0.0, 0.0) if case.has_clock else None,
    )  # fmt: skip
    means = start.mean + generator.normal(size=(count, size)) * np.sqrt(np.diag(start.covariance))
    if case.has_clock:
        means[:, 6:] = 0.0  # the clock itself was drawn with that sigma
    beliefs = [(means.copy(), np.tile(start.covariance, (count, 1, 1))) for _ in methods]
    doubts = [np.zeros((count, 1)) for _ in methods]
    tracks = [_empty(count, epochs) for _ in methods]
    for leg_number, leg in enumerate(case.legs):
        for epoch in range(leg.first, leg.stop):
            step_s = 0.0 if epoch == 0 else float(case.times_s[epoch] - case.times_s[epoch - 1])
            draws.advance(step_s)
            measured_m = heard(case, leg_number, epoch, draws)
            if not reflect:
                measured_m[:, ~case.in_sight[leg_number][epoch - leg.first]] = np.nan
            for method, (mean, covariance), doubt, track in zip(methods, beliefs, doubts, tracks, strict=True):
                believed_m = mean[:, [0, 2, 4]] + step_s * mean[:, [1, 3, 5]]
                variances_m2 = _variances_m2(case, leg_number, epoch - leg.first, believed_m, method, usual[method])
                if method.second_order:
                    variances_m2 = variances_m2 + bend_m2(believed_m - leg.anchors_m[:, None], covariance)
                found = np.zeros((*measured_m.shape, 3))
                step_many(
                    mean, covariance, step_s, MOTION.psd(), leg.anchors_m, (measured_m, variances_m2),
                    (method.gate_sigma**2, doubt), found,
                )  # fmt: skip
                _keep(track, epoch, mean, covariance, case.points_m[epoch], found)
    return tracks


def _usual_dilution(case: Case, method: Method) -> float:
    """Median PDOP of the anchors taken, along the flight as planned."""
    found = []
    for leg, seen in zip(case.legs, case.in_sight, strict=True):
        found.append(_dilution(case, leg, case.points_m[leg.first : leg.stop], seen, method))
    whole = np.concatenate(found)
    return float(np.median(whole[np.isfinite(whole)]))


def _dilution(case: Case, leg: Leg, points_m: Array, visible: npt.NDArray[np.bool_], method: Method) -> Array:
    taken = visible if math.isinf(method.hidden_factor) else np.ones_like(visible)
    pdop: Array = dop_at_points(points_m, leg.anchors_m, pack_sets(taken), case.kind).pdop
    return pdop


def _variances_m2(case: Case, leg_number: int, row: int, believed_m: Array, method: Method, usual: float) -> Array:
    """(s, k) R of eq. 26 from who is predicted in sight of the believed place, not of the true one.

    µ makes R the variance of the ranges at the planned flight's median dilution, which scales it from there.
    """
    leg = case.legs[leg_number]
    grid = leg.surfaces.grid
    west_m, south_m, east_m, north_m = grid.bounds_m
    across_m = np.clip(believed_m[:, :2], (west_m, south_m), (east_m, north_m))
    # a belief under the ground would see nobody, and never come back
    inside_m = np.column_stack([across_m, np.maximum(believed_m[:, 2], height_at(grid, *across_m.T) + 10.0)])
    visible = visible_sets(leg.surfaces, inside_m).visible()
    dilution = _dilution(case, leg, believed_m, visible, method) / usual
    dilution[~np.isfinite(dilution)] = 1.0  # no fix at this instant is no reason to leave a good range out
    mu_m2 = case.noise.white_m2() + (case.noise.zenith_m * case.air_factor[leg_number][row]) ** 2
    variances: Array = dilution[:, None] * mu_m2 * np.where(visible, 1.0, method.hidden_factor)
    return variances


def bend_m2(lines_m: Array, covariance: Array) -> Array:
    """(s, k) what a range's second derivative adds to its variance, with the square of what it adds to its mean.

    lines_m: (k, s, 3) from the anchors; covariance: (s, n, n) of the belief a step ago. It is half of tr((H·P)²) and
    the square of half of tr(H·P), H the range's Hessian: nothing for satellites, metres for a drone near a wide belief.
    """
    range_m = np.linalg.norm(lines_m, axis=2)[..., None, None]
    along = lines_m[..., None] / range_m
    hessian = (np.eye(3) - along @ np.swapaxes(along, 2, 3)) / range_m
    spread = hessian @ covariance[:, :6:2, :6:2]
    bend: Array = 0.5 * np.trace(spread @ spread, axis1=2, axis2=3) + 0.25 * np.trace(spread, axis1=2, axis2=3) ** 2
    return bend.T


def _empty(count: int, epochs: int) -> Tracks:
    shape = (count, epochs)
    return Tracks(np.zeros((*shape, 3)), np.zeros((*shape, 3, 3)), np.zeros(shape), np.zeros(shape, np.int64))


def _keep(track: Tracks, epoch: int, mean: Array, covariance: Array, truth_m: Array, found: Array) -> None:
    track.error_m[:, epoch] = mean[:, [0, 2, 4]] - truth_m
    track.covariance_m2[:, epoch] = covariance[:, :6:2, :6:2]
    used = (found[..., 2] == navigation.Verdict.USED) | (found[..., 2] == navigation.Verdict.REACQUIRED)
    track.used[:, epoch] = used.sum(axis=1)
    squares = np.divide(found[..., 0] ** 2, found[..., 1], out=np.zeros_like(found[..., 0]), where=used)
    track.nis[:, epoch] = squares.sum(axis=1)
