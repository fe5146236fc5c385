"""A vehicle followed through a street by pseudoranges, wheels and a gyro; the bubble holds though half of them lie."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError, TimeOrderError
from ..inertial import TangentFrame
from ..inputs import numbers
from .inputs import StreetErrors, StreetRanges, StreetStart, WheelReadings
from .kernels import excesses as kernel

__all__ = ["StreetTrack", "follow_street"]

Array = npt.NDArray[np.float64]
LIGHT_M_PER_S = 299_792_458.0
CLOCK_SIGMA_M, DRIFT_SIGMA_M_PER_S = 100.0, 10.0
MOST_SATELLITES = 64


@dataclass(frozen=True, eq=False)
class StreetTrack:
    """What is believed after each of k epochs of pseudoranges.

    position_m: (k, 3) east, north, up; position_covariance_m2: (k, 3, 3). heading_rad: (k,) clockwise from north.
    clock_m: (k,). hidden: (m,) probability that each range came round a corner, NaN where none came.
    """

    times_s: Array
    position_m: Array
    position_covariance_m2: Array
    heading_rad: Array
    clock_m: Array
    hidden: Array

    @property
    def level_covariance_m2(self) -> Array:
        """(k, 3, 3) that of east and north alone, for a bubble on a street."""
        level = np.zeros_like(self.position_covariance_m2)
        level[:, :2, :2] = self.position_covariance_m2[:, :2, :2]
        return level


def follow_street(
    ranges: StreetRanges,
    wheels: WheelReadings,
    start: StreetStart,
    frame: TangentFrame,
    errors: StreetErrors | None = None,
) -> StreetTrack:
    """The vehicle at every instant of pseudoranges: an extended Kalman filter with an excess for each satellite.

    Each range is in sight, lies by what it lied before, or by another excess; the three are weighed by how well they
    fit and met by their common mean and covariance, with everything else that is believed. Wheels and gyro carry it
    in between. Raises MeasurementError, TimeOrderError.
    """
    law = StreetErrors() if errors is None else errors
    count = np.size(ranges.times_s)
    times = _ordered("pseudoranges", ranges.times_s, count)
    measured = numbers("measured_m", ranges.measured_m, (count,))
    sigmas = numbers("sigmas_m", ranges.sigmas_m, (count,))
    sight = numbers("sight", np.broadcast_to(ranges.sight, (count,)), (count,))
    sent_m = numbers("satellites_ecef_m", ranges.satellites_ecef_m, (count, 3))
    there = ~np.isnan(measured)
    if not there.any():
        raise MeasurementError("There are no pseudoranges to navigate by.")
    if np.isinf(measured).any() or not np.isfinite(sent_m[there]).all() or not (sigmas[there] > 0.0).all():
        raise MeasurementError("Pseudoranges must be finite or NaN, with finite satellites and sigmas above zero.")
    if not ((sight >= 0.0) & (sight <= 1.0)).all():
        raise MeasurementError("sight must be probabilities from 0 to 1.")
    satellites, satellite = np.unique(np.asarray(ranges.satellite)[there], return_inverse=True)
    systems, system = np.unique(np.asarray(ranges.system)[there], return_inverse=True)
    if len(satellites) > MOST_SATELLITES:
        raise MeasurementError(f"{len(satellites)} satellites are more than the {MOST_SATELLITES} that are followed.")
    epochs_s, first = np.unique(times, return_index=True)
    first = np.searchsorted(np.flatnonzero(there), [*first, count])
    places_m = _places(sent_m[there], frame)
    told = kernel.Pseudoranges(
        first.astype(np.int64),
        measured[there],
        places_m,
        satellite.astype(np.int64),
        system.astype(np.int64),
        law.slow_factor * sigmas[there],
        # a sight of 0 or 1 would rule out what only the model may rule out
        np.clip(sight[there], 1e-6, 1.0),
    )
    alike = _alike(places_m, satellite, law.alike_rad)
    belief = _begun(told, start, law, alike, len(systems))
    size, means = kernel.OFFSETS + len(systems) - 1, len(epochs_s)
    track, covariances = np.zeros((means, size)), np.zeros((means, 3, 3))
    hidden = np.full(count, math.nan)
    lying = np.zeros(int(there.sum()))
    kernel.follow(belief, _driven(wheels, epochs_s), told, _law(law), alike, track, covariances, lying)
    hidden[there] = lying
    return StreetTrack(
        epochs_s,
        track[:, :3].copy(),
        covariances,
        (0.5 * math.pi - track[:, kernel.HEADING]) % (2.0 * math.pi),
        track[:, kernel.CLOCK].copy(),
        hidden,
    )


def _ordered(what: str, times_s: npt.ArrayLike, count: int) -> Array:
    times = numbers("times_s", times_s, (count,))
    if not np.isfinite(times).all():
        raise MeasurementError(f"The times of {what} must be finite.")
    back = np.diff(times) < 0.0
    if back.any():
        first = int(np.argmax(back)) + 1
        raise TimeOrderError(
            f"The {what} go backwards: {times[first]} s follows {times[first - 1]} s at number {first}.", index=first
        )
    return times


def _places(sent_m: Array, frame: TangentFrame) -> Array:
    """(m, 3) satellites in the frame, turned with the body while their signals were under way."""
    place_m = frame.from_centred_m(sent_m)
    turned = frame.body.rate_rad_per_s * np.linalg.norm(place_m, axis=1) / LIGHT_M_PER_S
    cosine, sine = np.cos(turned), np.sin(turned)
    east, north, up = sent_m.T
    return np.ascontiguousarray(
        frame.from_centred_m(np.stack([cosine * east + sine * north, cosine * north - sine * east, up], axis=1))
    )


def _driven(wheels: WheelReadings, epochs_s: Array) -> kernel.Wheels:
    """What wheels and gyro tell of the time between epochs: the mean of their readings there, or the one about it."""
    count = np.size(wheels.times_s)
    times = _ordered("wheels' readings", wheels.times_s, count)
    if count < 1 or not (times[0] <= epochs_s[0] + 1.0 and times[-1] >= epochs_s[-1] - 1.0):
        raise MeasurementError("The wheels' readings do not cover the pseudoranges.")
    seconds = np.diff(epochs_s, prepend=epochs_s[0])
    whole = []
    for name in ("forward_m_per_s", "turns_rad_per_s"):
        readings = numbers(name, getattr(wheels, name), (count,))
        if not np.isfinite(readings).all():
            raise MeasurementError(f"{name} must be finite.")
        # the reading of an instant is of the time before it
        gone = np.concatenate([[0.0], np.cumsum(readings[1:] * np.diff(times))])
        whole.append(np.diff(np.interp(epochs_s, times, gone), prepend=0.0))
        whole[-1][0] = 0.0
    return kernel.Wheels(seconds, whole[0], whole[1])


def _begun(
    told: kernel.Pseudoranges, start: StreetStart, law: StreetErrors, alike: Array, systems: int
) -> kernel.Belief:
    satellites = len(alike)
    size = kernel.OFFSETS + systems - 1
    n = size + 2 * satellites
    mean, sigmas = np.zeros(n), np.zeros(n)
    mean[:3] = start.position_m
    mean[kernel.HEADING] = 0.5 * math.pi - start.heading_rad
    early = slice(0, max(int(told.first[1]), 1))
    # of the first epoch's clocks those in sight are the earliest
    late_m = told.measured_m[early] - np.linalg.norm(told.places_m[early] - mean[:3], axis=1)
    mean[kernel.CLOCK] = np.median(late_m)
    sigmas[: kernel.OFFSETS] = (
        start.position_sigma_m,
        start.position_sigma_m,
        start.height_sigma_m,
        start.heading_sigma_rad,
        start.turn_bias_sigma_rad_per_s,
        CLOCK_SIGMA_M,
        DRIFT_SIGMA_M_PER_S,
    )
    sigmas[kernel.OFFSETS : size] = law.system_offset_m
    share, excess_m = law.hidden_share, law.excess_mean_m
    mean[size : size + satellites] = share * excess_m
    sigmas[size : size + satellites] = excess_m * math.sqrt(2.0 * share - share**2)
    for satellite in range(satellites):
        sigmas[size + satellites + satellite] = told.sigma_m[int(np.argmax(told.satellite == satellite))]
    covariance = np.diag(sigmas**2)
    slow_m = sigmas[size + satellites :]
    covariance[size + satellites :, size + satellites :] = alike * np.outer(slow_m, slow_m)
    return kernel.Belief(mean, covariance, np.full(satellites, share))


def _alike(places_m: Array, satellite: npt.NDArray[np.int64], angle_rad: float) -> Array:
    """(s, s) how slow errors correlate: the nearer two satellites stand in the sky, the more walls they share."""
    first = np.unique(satellite, return_index=True)[1]
    towards = places_m[first] / np.linalg.norm(places_m[first], axis=1, keepdims=True)
    apart = np.arccos(np.clip(towards @ towards.T, -1.0, 1.0))
    alike: Array = np.exp(-apart / angle_rad)
    np.fill_diagonal(alike, 1.0)
    return alike


def _law(law: StreetErrors) -> kernel.Law:
    return kernel.Law(
        law.hidden_share,
        law.excess_mean_m,
        law.hidden_lasting_s,
        law.excess_steady_s,
        law.slow_s,
        law.white_m,
        law.along_m_per_sqrt_s,
        law.upwards_m_per_sqrt_s,
        law.turning_rad_per_sqrt_s,
        law.turn_walk_rad_per_s_sqrt_s,
        law.clock_m_per_sqrt_s,
        law.drift_m_per_s_sqrt_s,
    )
