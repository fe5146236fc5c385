"""Aided channels through a recording: satellite by satellite, interval by interval, what a trajectory foretells."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gnss.broadcast_ephemeris import Ephemerides
from gnss.errors import GnssInputError, SamplesError
from gnss.gps_time import GpsTime, ReceiverClock

from .aiding import foretold_delays_s
from .bits import BIT_S
from .channel import BitSums, ChannelMeasurement, correlate_bits, measure_sums
from .codes import L1_HZ
from .samples import Samples

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

__all__ = ["INTERVAL_S", "Aiding", "track"]

Array = npt.NDArray[np.float64]
INTERVAL_S = 1.0  # the longest that is summed; what is read at a time
STEP_S = 0.02  # of the aiding: within it the farthest pull leaves half a millimetre to a straight line
AHEAD_S = 0.03  # the last bit of an interval ends in the next
WHOLE_S = 1e-6


@dataclass(frozen=True, eq=False)
class Aiding:
    """What foretells the replicas: ephemerides, where the antenna was, and the receiver's clock.

    start: of sample 0 by the receiver's clock. times_s: (k,) after it, rising. antennas_ecef_m: (k, 3), the trajectory
    with its lever arm turned and added; between its times a cubic spline, of two or three straight lines. One place
    stands still. Raises GnssInputError.
    """

    ephemerides: Ephemerides
    start: GpsTime
    times_s: npt.ArrayLike
    antennas_ecef_m: npt.ArrayLike
    clock: ReceiverClock = field(default_factory=ReceiverClock)

    def __post_init__(self) -> None:
        times, places = np.array(self.times_s, np.float64), np.array(self.antennas_ecef_m, np.float64)
        if times.ndim != 1 or not len(times) or places.shape != (len(times), 3):
            raise GnssInputError("A trajectory needs as many places (k, 3) as times, one at least.")
        if not (np.isfinite(times).all() and np.isfinite(places).all() and (np.diff(times) > 0.0).all()):
            raise GnssInputError("A trajectory needs finite places at times that rise.")
        object.__setattr__(self, "times_s", times)
        object.__setattr__(self, "antennas_ecef_m", places)

    def antennas_m(self, times_s: Array) -> Array:
        """(n, 3) ECEF at times after the first sample. Raises GnssInputError beyond the trajectory's ends."""
        known, places = np.asarray(self.times_s), np.asarray(self.antennas_ecef_m)
        if len(known) == 1:
            return np.repeat(places, len(times_s), axis=0)
        if times_s[0] < known[0] or times_s[-1] > known[-1]:
            raise GnssInputError(
                f"The trajectory reaches from {known[0]:g} to {known[-1]:g} s, the samples from {times_s[0]:.3f} to "
                f"{times_s[-1]:.3f} s."
            )
        if len(known) < 4:
            return np.stack([np.interp(times_s, known, axis) for axis in places.T], axis=1)
        ahead: Array = self._spline(times_s)
        return ahead

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline  # loads half of scipy

        return CubicSpline(self.times_s, self.antennas_ecef_m)

    def delays_s(self, prn: int, times_s: Array) -> Array:
        """(n,) from satellite to sample. Raises GnssInputError, AlmanacError."""
        places, ahead = self.antennas_m(times_s), self.clock.ahead_s(times_s)
        return foretold_delays_s(self.ephemerides, f"G{prn:02d}", self.start, times_s, places, clock_s=ahead)

    def sums(self, samples: Samples, begin_s: float, prn: int) -> BitSums:
        """A satellite's bits in samples that begin so long after sample 0; times count from there. Raises SamplesError.

        The aiding reaches over the samples.
        """
        steps = math.ceil(samples.duration_s / STEP_S) + 1
        times = np.linspace(0.0, samples.duration_s, steps)
        delays = self.delays_s(prn, begin_s + times)
        return correlate_bits(samples, prn, times, delays, self.start.second_of_week % BIT_S + begin_s)


def track(
    read: Callable[[float, float], Samples],
    aiding: Aiding,
    prns: Sequence[int],
    duration_s: float,
    *,
    integrations_s: Mapping[int, float] | None = None,
    reach_hz: float = 2.0,
    false_alarm: float = 1e-3,
) -> Iterator[tuple[tuple[ChannelMeasurement, ...], Aiding]]:
    """For each second: what its channels tell, by time and then in order of prns; and what aided them.

    read(start_s, duration_s): samples. integrations_s: of each satellite, whole bits of 20 ms up to a second (one
    second where it is not named). Channels are independent of one another, except that the receiver's clock is foretold
    from the median of those detected in the second before. middle_s counts from the first sample. The last second may
    be a shorter one. Raises SamplesError, GnssInputError, AlmanacError.
    """
    asked_s = {prn: (integrations_s or {}).get(prn, INTERVAL_S) for prn in prns}
    bits = {prn: round(each_s / BIT_S) if math.isfinite(each_s) else 0 for prn, each_s in asked_s.items()}
    whole = round(INTERVAL_S / BIT_S)
    wrong = [
        prn for prn, count in bits.items() if not 1 <= count <= whole or abs(asked_s[prn] - count * BIT_S) > WHOLE_S
    ]
    if wrong or not prns:
        raise SamplesError("Channels sum whole bits of 20 ms, 1 to 50 of them, of one satellite at least.")
    begin_s = 0.0
    with ThreadPoolExecutor() as pool:
        while begin_s + BIT_S + AHEAD_S <= duration_s + 1e-9:
            span_s = min(INTERVAL_S + AHEAD_S, duration_s - begin_s)
            samples = read(begin_s, span_s)
            at_s = round(begin_s * samples.rate_hz) / samples.rate_hz
            held = aiding
            sums = pool.map(lambda prn, at_s=at_s, samples=samples, held=held: held.sums(samples, at_s, prn), prns)
            parts = []
            for prn, found in zip(prns, sums, strict=True):
                count = min(bits[prn], len(found))
                firsts = range(0, min(len(found), whole) - count + 1, count)
                parts += [(first, found.part(first, count)) for first in firsts]
            told = [
                _since_start(
                    measure_sums(part, reach_hz=reach_hz, false_alarm=false_alarm), at_s, samples.intermediate_hz
                )
                for _, part in sorted(parts, key=lambda one: one[0])
            ]
            yield tuple(told), aiding
            aiding = dataclasses.replace(aiding, clock=_followed(aiding.clock, told))
            begin_s += INTERVAL_S


def _since_start(one: ChannelMeasurement, at_s: float, intermediate_hz: float) -> ChannelMeasurement:
    """With times, and the phase of the intermediate frequency, from the recording's first sample on."""
    turns = intermediate_hz * at_s % 1.0
    phase_rad = math.remainder(one.phase_rad - 2.0 * math.pi * turns, 2.0 * math.pi)
    return dataclasses.replace(one, middle_s=one.middle_s + at_s, phase_rad=phase_rad)


def _followed(clock: ReceiverClock, told: Sequence[ChannelMeasurement]) -> ReceiverClock:
    """The clock as the satellites that were detected have it in the middle: half of them may be wrong."""
    seen = [one for one in told if one.detected]
    if not seen:
        return clock
    at_s = float(np.median([one.middle_s for one in seen]))
    late_s = float(np.median([one.delay_s - one.replica_delay_s for one in seen]))
    offsets_hz = [one.frequency_offset_hz for one in seen if math.isfinite(one.frequency_sigma_hz)]
    drift = clock.drift - (float(np.median(offsets_hz)) / L1_HZ if offsets_hz else 0.0)
    return ReceiverClock(float(clock.ahead_s(at_s)) + late_s, drift, at_s)
