"""The loop: each second the filter foretells, channels measure beside that, and what they measure corrects it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
import numpy.typing as npt

from gnss import Ephemerides, GpsTime, Instants, ReceiverClock, enu_to_ecef_m, ephemeris_positions_ecef_m
from gnss.receiver import BIT_S, BitSums, foretold_delays_s
from gnss.sky import Place, R_ecef_to_enu

from ..errors import MeasurementError
from ..inertial import (
    ImuLog,
    ImuNoise,
    InertialStart,
    InertialTrack,
    Measurements,
    TangentFrame,
    coordinates,
    join,
    matrices_of,
    navigate,
    rates_along,
)
from .channels import LIGHT_M_PER_S, WAVELENGTH_M, Heard, heard
from .judging import Judged, judge

__all__ = ["Correlator", "DeepRules", "DeepTrack", "integrate"]

Array = npt.NDArray[np.float64]
# (satellite, when the interval begins, times (k,) from there on, foretold delays (k,)) to the sums of its bits
Correlator = Callable[[int, float, Array, Array], BitSums]
SECOND_S, BEYOND_S = 1.0, 0.04  # the last bits of an interval end within its next 20 ms
STEP_S = 0.02
CODE_SHARE = 0.3  # of a second's noisy ranges that moves the clock
SURE = 2.0  # sigmas of a frequency within a quarter of a wave: half waves are settled
LEAST = 2  # phases, as one by itself says nothing beside a clock
WANDER_M_PER_S = 0.05  # of the clock from second to second


@dataclass(frozen=True, slots=True)
class DeepRules:
    """How channels sum and what is believed.

    bits: summed at a time, 1 to 50 of 20 ms. monitored: parity and foresight judge before the filter is corrected.
    range_floor_m, phase_floor_m: sigmas of what noise does not explain (air, reflections). limit_sigma: of foresight.
    Raises MeasurementError.
    """

    bits: int = 50
    monitored: bool = True
    reach_hz: float = 2.0
    false_alarm: float = 1e-3
    range_floor_m: float = 0.5
    phase_floor_m: float = 0.003
    limit_sigma: float = 3.5

    def __post_init__(self) -> None:
        if not 1 <= self.bits <= 50 or not min(self.range_floor_m, self.phase_floor_m, self.limit_sigma) > 0.0:
            raise MeasurementError("Channels sum 1 to 50 bits; floors and limit_sigma must be above zero.")


@dataclass(frozen=True, eq=False)
class DeepTrack:
    """What is believed at the end of each of e seconds, and of which satellites.

    position_m: (e, 3) of the unit, east, north, up; position_covariance_m2: (e, 3, 3). detected, used, carried: (e,)
    satellites above the threshold, whose ranges, and whose carriers corrected the filter. end: the belief at the end.
    """

    times_s: Array
    position_m: Array
    position_covariance_m2: Array
    detected: npt.NDArray[np.int64]
    used: npt.NDArray[np.int64]
    carried: npt.NDArray[np.int64]
    heard: tuple[tuple[Heard, ...], ...]
    end: InertialStart
    clock: ReceiverClock


def integrate(
    correlate: Correlator,
    log: ImuLog,
    start: InertialStart,
    noise: ImuNoise,
    frame: TangentFrame,
    ephemerides: Ephemerides,
    begin: GpsTime,
    prns: Sequence[int],
    clock: ReceiverClock,
    rules: DeepRules | None = None,
) -> DeepTrack:
    """Go through a log second by second.

    begin: the log's first reading by the receiver's clock; times count from there. clock: its first guess, good to a
    chip and a few hertz. frame: of the Earth. A second's phases are compared with those of the second before it, what
    the filter foretold between them taken out, so that only an error of its velocity is left (seed 002, eqs. 2.1-2.5,
    with all satellites' differences to their common clock in place of a clock state). Raises MeasurementError,
    StateError, and what correlate raises.
    """
    asked = rules or DeepRules()
    sky = _Sky(ephemerides, begin, frame, tuple(prns), tuple(f"G{prn:02d}" for prn in prns))
    times = log.times_s - log.times_s[0]
    seconds = math.floor(float(times[-1]) - BEYOND_S + 1e-9)
    if seconds < 1:
        raise MeasurementError("A log of readings must last a second and 40 ms at least.")
    belief, before = start, _Before({}, np.zeros(3))
    rows: list[tuple[float, Array, Array, int, int, int]] = []
    told = []
    for second in range(seconds):
        first, last, far = np.searchsorted(times, [second - 1e-9, second + SECOND_S - 1e-9, second + 1.0 + BEYOND_S])
        ahead = navigate(_part(log, first, far + 1), belief, join(), noise, frame)
        epoch = _Epoch(ahead, float(log.times_s[0]) + second, log.rates_rad_per_s[first + 1])
        units = sky.towards(second + 0.5, epoch)
        measured = _listen(correlate, sky, epoch, float(second), clock, asked)
        measurements, ranges, phases = _corrections(epoch, units, measured, before, asked)
        track = navigate(_part(log, first, last + 1), belief, measurements, noise, frame)
        moved_m = _antenna(track)[epoch.middle] - epoch.antenna_m[epoch.middle]
        clock = _clock(clock, float(second), measured, ranges, units @ moved_m)
        before = _Before({one.prn: one for one in measured}, moved_m)
        belief = track.end()
        seen = sum(one.detected > 0 for one in measured)
        place, spread = track.position_m[-1], track.position_covariance_m2[-1]
        rows.append((second + SECOND_S, place, spread, seen, int(ranges.kept.sum()), int(phases.kept.sum())))
        told.append(tuple(measured))
    ends, places, spreads, detected, used, carried = (np.array(column) for column in zip(*rows, strict=True))
    return DeepTrack(ends, places, spreads, detected, used, carried, tuple(told), belief, clock)


@dataclass(frozen=True, eq=False)
class _Sky:
    """Where satellites are, and what their signals take."""

    ephemerides: Ephemerides
    begin: GpsTime
    frame: TangentFrame
    prns: tuple[int, ...]
    names: tuple[str, ...]

    @property
    def origin(self) -> Place:
        frame = self.frame
        return Place(math.degrees(frame.longitude_rad), math.degrees(frame.latitude_rad), frame.altitude_m)

    def towards(self, after_s: float, epoch: _Epoch) -> Array:
        """(m, 3) unit vectors in the frame."""
        at = self.begin.plus(after_s)
        when = Instants(np.array([at.week]), np.array([at.second_of_week]))
        places_m = ephemeris_positions_ecef_m(self.ephemerides, self.names, when)[:, 0]
        away = places_m - enu_to_ecef_m(self.origin, epoch.antenna_m[epoch.middle])
        units: Array = away / np.linalg.norm(away, axis=1, keepdims=True) @ R_ecef_to_enu(self.origin).T
        return units

    def delays_s(self, name: str, second: float, times_s: Array, antenna_m: Array, clock: ReceiverClock) -> Array:
        places_m, ahead = enu_to_ecef_m(self.origin, antenna_m), clock.ahead_s(second + times_s)
        return foretold_delays_s(self.ephemerides, name, self.begin.plus(second), times_s, places_m, clock_s=ahead)


@dataclass(frozen=True, eq=False)
class _Epoch:
    """What the filter foretells of a second, and the turn rate that its second reading tells."""

    ahead: InertialTrack
    begin_s: float
    rate_rad_per_s: Array

    @cached_property
    def middle(self) -> int:
        """Number of the reading in the middle of the satellites' bits."""
        return int(np.searchsorted(self.ahead.times_s, self.begin_s + 0.5 + 0.5 * BIT_S - 1e-9))

    @cached_property
    def antenna_m(self) -> Array:
        """(k, 3) in the frame."""
        return _antenna(self.ahead)

    @property
    def velocity_m_per_s(self) -> Array:
        """(3,) of the antenna at the second reading."""
        ahead = self.ahead
        swing = np.cross(self.rate_rad_per_s - ahead.rate_bias_rad_per_s[1], ahead.lever_arm_m)
        velocity: Array = ahead.velocity_m_per_s[1] + matrices_of(ahead.quaternion[1]) @ swing
        return velocity


@dataclass(frozen=True, eq=False)
class _Before:
    """What the second before heard, and by how much it moved the antenna in its middle."""

    heard: dict[int, Heard]
    moved_m: Array


def _part(log: ImuLog, first: int, end: int) -> ImuLog:
    span = slice(int(first), int(end))
    return ImuLog(log.times_s[span], log.forces_m_per_s2[span], log.rates_rad_per_s[span], log.gaps[span])


def _antenna(track: InertialTrack) -> Array:
    """(k, 3) places of the antenna in the frame."""
    arms: Array = matrices_of(track.quaternion) @ track.lever_arm_m
    return track.position_m + arms


def _listen(
    correlate: Correlator, sky: _Sky, epoch: _Epoch, second: float, clock: ReceiverClock, rules: DeepRules
) -> list[Heard]:
    times = np.linspace(0.0, SECOND_S + BEYOND_S, round((SECOND_S + BEYOND_S) / STEP_S) + 1)
    at_s, known_m = epoch.begin_s + times, epoch.antenna_m
    antenna_m = np.stack([np.interp(at_s, epoch.ahead.times_s, axis) for axis in known_m.T], axis=1)
    whole = round(SECOND_S / BIT_S)
    found = []
    for prn, name in zip(sky.prns, sky.names, strict=True):
        sums = correlate(prn, second, times, sky.delays_s(name, second, times, antenna_m, clock))
        found.append(heard(sums.part(0, min(len(sums), whole)), rules.bits, rules.reach_hz, rules.false_alarm))
    return found


def _corrections(
    epoch: _Epoch, units: Array, measured: Sequence[Heard], before: _Before, rules: DeepRules
) -> tuple[Measurements, Judged, Judged]:
    """What the filter takes in: ranges in the middle of a second, and by the carriers the velocity at its beginning."""
    ahead, middle, rows = epoch.ahead, epoch.middle, -units
    off_m = np.array([one.range_m for one in measured])
    sigmas_m = np.hypot([one.range_sigma_m for one in measured], rules.range_floor_m)
    rule = partial(judge, monitored=rules.monitored, false_alarm=rules.false_alarm, limit_sigma=rules.limit_sigma)
    spread = ahead.position_covariance_m2[middle]
    ranges = rule(rows, off_m, sigmas_m, spread)
    at = np.full(len(ranges.values), ahead.times_s[middle])
    by_code = coordinates(at, ranges.values + ranges.rows @ epoch.antenna_m[middle], ranges.rows, np.ones(len(at)))
    velocity_m2 = np.diag(ahead.sigmas[middle, 3:6] ** 2)
    changes_m, changed_m = _changes(units, measured, before, rules.phase_floor_m)
    phases = rule(rows, changes_m, changed_m, velocity_m2 * SECOND_S**2)
    at = np.full(len(phases.values), ahead.times_s[1])
    rates = phases.rows * SECOND_S
    by_phase = rates_along(at, phases.values + rates @ epoch.velocity_m_per_s, rates, np.ones(len(at)))
    return join(by_phase, by_code), ranges, phases


def _changes(units: Array, measured: Sequence[Heard], before: _Before, floor_m: float) -> tuple[Array, Array]:
    """(m,) how far each went within a second beyond what was foretold, and its sigma, inf = not measured.

    By phases since the second before, where frequencies tell to which half wave these belong; elsewhere by frequencies
    alone. The filter settles no half waves: one taken wrong would hold its velocity wrong for ever. What phases share
    is brought to what frequencies share.
    """
    off_m = SECOND_S * np.array([one.rate_m_per_s for one in measured])
    sigmas_m = np.hypot(SECOND_S * np.array([one.rate_sigma_m_per_s for one in measured]), floor_m)
    half_m = 0.5 * WAVELENGTH_M
    settled, phases_m, surer_m = [], [], []
    for n, one in enumerate(measured):
        last = before.heard.get(one.prn)
        if last is None or math.isinf(last.phase_sigma_m) or SURE * SECOND_S * one.rate_sigma_m_per_s > 0.5 * half_m:
            continue
        settled.append(n)
        phases_m.append(one.phase_m - last.phase_m - float(units[n] @ before.moved_m))
        surer_m.append(math.hypot(one.phase_sigma_m, last.phase_sigma_m, math.sqrt(2.0) * floor_m))
    if len(settled) < LEAST:
        return off_m, sigmas_m
    beyond_m, surer = np.array(phases_m) - off_m[settled], np.array(surer_m)
    turns = np.exp(2j * np.pi * beyond_m / half_m)
    shared_m = half_m * float(np.angle((turns * surer**-2.0).sum())) / (2.0 * np.pi)
    beyond_m -= shared_m
    off_m[settled] += beyond_m - half_m * np.round(beyond_m / half_m)
    sigmas_m[settled] = surer
    return off_m, sigmas_m


def _clock(
    clock: ReceiverClock, second: float, measured: Sequence[Heard], ranges: Judged, shifts_m: Array
) -> ReceiverClock:
    """Where the satellites that are believed have it in the middle of a second, for the next."""
    if not ranges.kept.any():
        return clock
    late_m = ranges.clock + float(np.mean(shifts_m[ranges.kept]))
    rates = np.array([one.rate_m_per_s for one in measured])[ranges.kept]
    weights = np.array([one.rate_sigma_m_per_s for one in measured])[ranges.kept] ** -2.0
    # a good oscillator's frequency wanders by so much at most, which is all that noisy carriers may tell of it
    gained_m_per_s = float(weights @ rates) / (float(weights.sum()) + WANDER_M_PER_S**-2.0)
    at_s = second + 0.5 * SECOND_S
    offset_s = float(clock.ahead_s(at_s)) + CODE_SHARE * late_m / LIGHT_M_PER_S
    return ReceiverClock(offset_s, clock.drift + gained_m_per_s / LIGHT_M_PER_S, at_s)
