"""What a satellite receiver heard on a drive: pseudoranges and changes of phase, and where they begin."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss import ReceiverClock

from ..inertial import ClockNoise, ImuLog, Measurements, phase_changes, pseudoranges
from ..inputs import numbers, positions
from .settings import DriveSettings

__all__ = ["FirstHeard", "Satellites", "first_heard", "satellite_measurements"]

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
UNKNOWNS, ROUNDS = 4, 10
# a velocity from two epochs of phases is one where they are no further apart
LONGEST_STEP_S = 5.0
CLOCK_SIGMA_M, KNOWN_DRIFT_M_PER_S, UNKNOWN_DRIFT_M_PER_S = 100.0, 10.0, 1000.0


@dataclass(frozen=True, eq=False)
class Satellites:
    """What came in, row by row in order of time, each row of one satellite at one epoch.

    times_s: (n,) on the clock of the readings, the same of an epoch. satellite: (n,) whole numbers. positions_m: (n, 3)
    where each was when it sent, in the frame, as that lies when the signal comes in. codes_m, phases_m: (n,) ranges
    with the receiver's clock in them, corrected for the satellites' clocks and the air, NaN = none; phases are off by
    whole cycles. arcs: (n,) whole numbers; where a satellite's changes, cycles were lost. place_m: (3,) about where the
    receiver is at the beginning, in the frame.
    """

    times_s: Array
    satellite: Ints
    positions_m: Array
    codes_m: Array
    phases_m: Array
    arcs: Ints
    place_m: Array


@dataclass(frozen=True, eq=False)
class FirstHeard:
    """What the first codes and phases tell: place_m (3,) and its sigmas, velocity, the receiver's clock and how surely;
    None = neither place nor velocity is told."""

    time_s: float
    place_m: Array | None
    sigmas_m: Array
    velocity_m_per_s: Array | None
    velocity_sigma_m_per_s: float
    clock: ReceiverClock
    clock_noise: ClockNoise


def satellite_measurements(
    heard: Satellites, imu: ImuLog, settings: DriveSettings, sight: Array | None
) -> tuple[Measurements, Measurements, tuple[str, ...]]:
    """(pseudoranges, changes of phase, what was passed over, in sentences); sight: (n,) as a map foretells.

    Of phases an epoch for each reading at most is taken. Raises MeasurementError.
    """
    times = numbers("times_s", heard.times_s, np.shape(heard.times_s))
    inside = (times >= imu.times_s[0]) & (times <= imu.times_s[-1])
    told = []
    if not inside.all():
        outside = len(np.unique(times[~inside]))
        told.append(f"Not used, for they lie outside of the inertial readings: {outside} (of satellites).")
    places = positions("positions_m", heard.positions_m)
    away = places - heard.place_m
    rise = away[:, 2] / np.linalg.norm(away, axis=1)
    seen = np.ones(len(times)) if sight is None else np.where(np.isnan(sight), 1.0, sight)
    high, visible = rise >= math.sin(settings.least_elevation_rad), seen >= settings.least_sight
    kept = inside & high & visible
    if inside.any() and not kept.any():
        least_deg = math.degrees(settings.least_elevation_rad)
        low, hidden = (int((inside & ~ok).sum()) for ok in (high, visible))
        told.append(
            f"Of {int(inside.sum())} measurements to satellites none was used: {low} are lower than the least "
            f"elevation of {least_deg:g}°, {hidden} are hidden as the map tells."
        )
    # the lower a satellite stands, the longer is the way through the air and the stronger what comes by detours
    weaker = 1.0 / np.maximum(rise, 1e-3)
    codes = pseudoranges(
        times[kept],
        places[kept],
        heard.codes_m[kept],
        settings.pseudorange_sigma_m * weaker[kept],
        gate_sigma=settings.gate_sigma,
    )
    if not settings.phase_sigma_m > 0.0:
        return codes, _no_phases(), tuple(told)
    epochs = np.unique(times[kept])
    steps = np.searchsorted(imu.times_s, epochs, side="left")
    one_each = epochs[np.diff(steps, prepend=-1) > 0]
    kept &= np.isin(times, one_each) & ~np.isnan(heard.phases_m)
    phases = phase_changes(
        times[kept],
        heard.satellite[kept],
        places[kept],
        heard.phases_m[kept],
        settings.phase_sigma_m * weaker[kept],
        arcs=heard.arcs[kept],
        gate_sigma=settings.gate_sigma,
    )
    return codes, phases, tuple(told)


def _no_phases() -> Measurements:
    return phase_changes([], np.zeros(0, np.int64), np.empty((0, 3)), [], 1.0)


def first_heard(heard: Satellites, settings: DriveSettings, from_s: float) -> FirstHeard:
    """By least squares of the first epoch with four codes, and of the phases from there to the next."""
    ranged = np.isfinite(heard.codes_m) & (heard.times_s >= from_s)
    epochs, count = np.unique(heard.times_s[ranged], return_counts=True)
    enough = epochs[count >= UNKNOWNS]
    if not len(enough):
        nothing = np.full(3, math.inf), None, settings.velocity_sigma_m_per_s
        return FirstHeard(math.inf, None, *nothing, ReceiverClock(), ClockNoise())
    first_s = float(enough[0])
    now = ranged & (heard.times_s == first_s)
    guess = np.append(heard.place_m, 0.0)
    solved, covariance = _solved(heard.positions_m[now], heard.codes_m[now], settings.pseudorange_sigma_m, guess)
    velocity, sigma, drift = _first_velocity(heard, first_s, solved[:3], settings)
    # a clock runs on from the first reading to that epoch, by a rate that phases tell
    drift_sigma = KNOWN_DRIFT_M_PER_S if velocity is not None else UNKNOWN_DRIFT_M_PER_S
    clock = ReceiverClock.of_ranges(float(solved[3]), drift, first_s)
    noise = ClockNoise(math.hypot(CLOCK_SIGMA_M, drift_sigma * (first_s - from_s)), drift_sigma)
    return FirstHeard(first_s, solved[:3], np.sqrt(np.diag(covariance)[:3]), velocity, sigma, clock, noise)


def _solved(places_m: Array, codes_m: Array, sigma_m: float, guess: Array) -> tuple[Array, Array]:
    """(place and clock (4,), covariance (4, 4))."""
    state = guess.copy()
    state[3] = np.median(codes_m - np.linalg.norm(places_m - state[:3], axis=1))
    rows = np.empty((len(codes_m), UNKNOWNS))
    for _ in range(ROUNDS):
        away = state[:3] - places_m
        length = np.linalg.norm(away, axis=1)
        rows = np.column_stack([away / length[:, None], np.ones(len(away))])
        state = state + np.linalg.lstsq(rows, codes_m - length - state[3], rcond=None)[0]
    return state, np.asarray(sigma_m**2 * np.linalg.pinv(rows.T @ rows), np.float64)


def _first_velocity(
    heard: Satellites, first_s: float, place_m: Array, settings: DriveSettings
) -> tuple[Array | None, float, float]:
    """(velocity or None, its sigma, the clock's drift), by phases of an epoch and the next one."""
    later = heard.times_s[heard.times_s > first_s]
    unknown = None, settings.velocity_sigma_m_per_s, 0.0
    if not len(later) or later[0] - first_s > LONGEST_STEP_S:
        return unknown
    rows: dict[tuple[int, int], list[int]] = {}
    for row in np.flatnonzero(np.isin(heard.times_s, (first_s, later[0])) & np.isfinite(heard.phases_m)):
        rows.setdefault((int(heard.satellite[row]), int(heard.arcs[row])), []).append(int(row))
    both = np.array([pair for pair in rows.values() if len(pair) == 2], np.int64).reshape(-1, 2)
    if len(both) <= UNKNOWNS:
        return unknown
    away = place_m - heard.positions_m[both]
    length = np.linalg.norm(away, axis=2)
    changes = np.diff(heard.phases_m[both] - length, axis=1)[:, 0]
    table = np.column_stack([away[:, 1] / length[:, 1:], np.ones(len(both))])
    moved, *_ = np.linalg.lstsq(table, changes, rcond=None)
    left = changes - table @ moved
    spread = math.sqrt(float(left @ left) / (len(both) - UNKNOWNS))
    step_s = float(later[0] - first_s)
    # one that lost cycles shows in what is left over
    sigma = max(spread * math.sqrt(float(np.linalg.pinv(table.T @ table)[:3, :3].trace())), 0.02) / step_s
    if spread > 10.0 * max(settings.phase_sigma_m, 0.01):
        return unknown
    return moved[:3] / step_s, max(sigma, settings.fix_velocity_sigma_m_per_s), float(moved[3]) / step_s
