"""One satellite over up to a second, without loops: where the sums of an aided replica are greatest."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import GnssInputError, SamplesError

from .bits import BIT_S, energy_limit, search_bits
from .codes import CHIP_RATE_HZ, CHIPS, L1_HZ, SPEED_OF_LIGHT_M_PER_S, ca_code
from .kernels.correlate import QUARTERS, Periods, correlate
from .samples import Samples

__all__ = ["BitSums", "ChannelMeasurement", "correlate_bits", "correlate_periods", "measure_channel", "measure_sums"]

Array = npt.NDArray[np.float64]
TAPS = np.arange(-4, 5)  # quarters of a chip, later than the replica
MOST_REACH_HZ = 0.5 / BIT_S  # a carrier so far off turns every second bit round
APART = 1  # taps from the greatest to early and late: a quarter of a chip
PERIOD_S = CHIPS / CHIP_RATE_HZ


@dataclass(frozen=True, eq=False)
class BitSums:
    """A satellite's samples times its aided replica, summed over data bits; noise has unit power in each sum.

    sums: (b, 9) by bit, and by quarters of a chip that the code comes later than foretold, -4 to 4. edges_s: (b + 1,)
    where the bits begin and end. times_s, delays_s: (k,) the aiding, from satellite to sample, clocks included.
    """

    prn: int
    sums: npt.NDArray[np.complex128]
    edges_s: Array
    times_s: Array
    delays_s: Array

    def __len__(self) -> int:
        return len(self.sums)

    def part(self, first: int, count: int) -> BitSums:
        """Those of some bits."""
        edges_s = self.edges_s[first : first + count + 1]
        return dataclasses.replace(self, sums=self.sums[first : first + count], edges_s=edges_s)


@dataclass(frozen=True, eq=False)
class ChannelMeasurement:
    """What one interval says of one satellite.

    detected: the total is above what noise reaches at the rate of false alarms, over all cells of code and frequency.
    middle_s: time of the samples that it is of; duration_s: how long was summed. delay_s: of the code there;
    replica_delay_s: what was foretold there; replica_rate: its mean change, seconds per second.
    frequency_offset_hz: of the carrier from the replica's, 0 for a single bit, which tells none. phase_rad: of the
    carrier there from the replica's, right up to half a cycle. bits: +-1, right up to the sign of all. cn0_db_hz: -inf
    where the bits have no more power than noise; sigmas follow from it, inf where it tells nothing.
    """

    prn: int
    detected: bool
    middle_s: float
    duration_s: float
    delay_s: float
    delay_sigma_s: float
    replica_delay_s: float
    replica_rate: float
    frequency_offset_hz: float
    frequency_sigma_hz: float
    phase_rad: float
    phase_sigma_rad: float
    cn0_db_hz: float
    bits: npt.NDArray[np.int8]
    amplitude: float
    limit: float

    @property
    def pseudorange_m(self) -> float:
        """The code's delay as a range, receiver's clock less satellite's included."""
        return SPEED_OF_LIGHT_M_PER_S * self.delay_s

    @property
    def pseudorange_sigma_m(self) -> float:
        """One sigma of it by noise."""
        return SPEED_OF_LIGHT_M_PER_S * self.delay_sigma_s

    @property
    def doppler_hz(self) -> float:
        """Of the carrier from L1, the mean over the interval; positive where the satellite comes nearer."""
        return self.frequency_offset_hz - L1_HZ * self.replica_rate

    @property
    def carrier_cycles(self) -> float:
        """The carrier's phase, growing with the range, right up to a constant and half cycles."""
        return L1_HZ * self.replica_delay_s - self.phase_rad / (2.0 * math.pi)


def measure_channel(
    samples: Samples,
    prn: int,
    times_s: npt.ArrayLike,
    delays_s: npt.ArrayLike,
    *,
    reach_hz: float = 2.0,
    false_alarm: float = 1e-3,
) -> ChannelMeasurement:
    """Measure a satellite whose delay is foretold to a chip, and its rate to reach_hz of the carrier.

    All whole bits of the samples are used: ``correlate_bits`` and then ``measure_sums``, which raise. Whole bits begin
    where what was sent, time less delay, is a multiple of 20 ms.
    """
    return measure_sums(correlate_bits(samples, prn, times_s, delays_s), reach_hz=reach_hz, false_alarm=false_alarm)


def correlate_bits(
    samples: Samples, prn: int, times_s: npt.ArrayLike, delays_s: npt.ArrayLike, start_s: float = 0.0
) -> BitSums:
    """The sums of all whole bits of the samples.

    times_s, delays_s: (k,) from satellite to sample as the aiding foretells them, clocks included, with times that
    increase over all samples, close enough for straight lines between them. start_s: of sample 0 by the receiver's
    clock; whole bits begin where what was sent, start and time less delay, is a multiple of 20 ms. Raises SamplesError,
    GnssInputError.
    """
    each = round(BIT_S / PERIOD_S)
    sums, edges_s, aiding = correlate_periods(samples, prn, (times_s, delays_s), start_s, each)
    return BitSums(prn, sums, edges_s, *aiding)


def correlate_periods(
    samples: Samples, prn: int, aiding: tuple[npt.ArrayLike, npt.ArrayLike], start_s: float, each: int
) -> tuple[npt.NDArray[np.complex128], Array, tuple[Array, Array]]:
    """(sums (n, 9) of so many code periods each, (n + 1,) their edges, the aiding as arrays), as ``correlate_bits``."""
    times_s, delays_s = aiding
    times, delays = np.asarray(times_s, np.float64), np.asarray(delays_s, np.float64)
    if times.ndim != 1 or times.shape != delays.shape or len(times) < 2 or not np.isfinite([times, delays]).all():
        raise SamplesError("Aiding needs as many finite delays as times, two at least.")
    if (np.diff(times) <= 0.0).any() or times[0] > 0.0 or times[-1] < samples.duration_s:
        raise SamplesError("The times of the aiding must increase and reach over all samples.")
    sent, rate, span_s = times - delays + start_s % BIT_S, samples.rate_hz, each * PERIOD_S
    if (np.diff(sent) <= 0.0).any():
        raise SamplesError("The delays of the aiding grow faster than time.")
    begin = math.ceil(float(np.interp(0.0, times, sent)) / span_s)
    end = math.floor(float(np.interp(samples.duration_s, times, sent)) / span_s)
    if end <= begin:
        whole = "data bit" if each == round(BIT_S / PERIOD_S) else "code period"
        raise SamplesError(f"There is no whole {whole} in the {1e3 * samples.duration_s:.3g} ms of the samples.")
    edges_s = np.interp(np.arange(begin * each, end * each + 1) * PERIOD_S, sent, times)
    first = np.ceil(edges_s * rate - 1e-9).astype(np.int64)
    at_s = first / rate
    told = np.interp(at_s, times, delays)
    turns = samples.intermediate_hz * at_s - L1_HZ * told
    spans = np.diff(first)
    chips_per_sample = CHIP_RATE_HZ * np.diff(at_s - told) / spans
    periods = Periods(
        first,
        (at_s - edges_s)[:-1] * rate * chips_per_sample,
        chips_per_sample,
        turns[:-1] % 1.0,
        np.diff(turns) / spans,
    )
    sums = np.zeros((end - begin, len(TAPS)), np.complex128)
    correlate(samples.values, ca_code(prn), periods, TAPS, sums)
    power = float(np.mean(np.abs(samples.values[first[0] : first[-1]]) ** 2))
    sums /= math.sqrt(power * span_s * rate)
    return sums, edges_s[::each], (times, delays)


def measure_sums(found: BitSums, *, reach_hz: float = 2.0, false_alarm: float = 1e-3) -> ChannelMeasurement:
    """Delay, frequency, phase and bits where the sums' total over unknown bits is greatest.

    Coarse: the greatest of all taps and frequencies within reach_hz; fine: a parabola over frequency, early and late
    over delay. Raises GnssInputError.
    """
    sums, count = found.sums, len(found)
    if count == 0 or not 0.0 <= reach_hz <= MOST_REACH_HZ:
        raise GnssInputError(
            f"A measurement needs the sums of one bit at least, and a reach of 0 to {MOST_REACH_HZ:g} Hz, beyond which "
            "bits tell no frequency."
        )
    middle_s = 0.5 * float(found.edges_s[0] + found.edges_s[-1])
    at_s = 0.5 * (found.edges_s[1:] + found.edges_s[:-1]) - middle_s
    step_hz = 0.25 / (count * BIT_S)
    steps = math.ceil(reach_hz / step_hz) if count > 1 else 0
    offsets_hz = step_hz * np.arange(-steps, steps + 1)
    turning = np.exp(-2j * np.pi * offsets_hz[:, None] * at_s)
    cells = (turning[:, None] * sums.T).reshape(-1, count)
    heights = search_bits(cells).amplitude.reshape(len(offsets_hz), len(TAPS))
    row, col = np.unravel_index(int(heights.argmax()), heights.shape)
    offset_hz = float(offsets_hz[row])
    if 0 < row < len(offsets_hz) - 1:
        before, top, after = heights[row - 1 : row + 2, col] ** 2
        offset_hz += 0.5 * step_hz * float((before - after) / (before - 2.0 * top + after))
    centre = min(max(int(col), APART), len(TAPS) - 1 - APART)
    wiped = sums * np.exp(-2j * np.pi * offset_hz * at_s)[:, None]
    best = search_bits(wiped[:, centre])
    early, late = (abs(complex(best.bits[0] @ wiped[:, centre + side])) for side in (-APART, APART))
    # the peak falls by 1 - |d|/chip to either side; early and late are on its flanks while it is within a tap
    slope_chips = 1.0 - APART / QUARTERS
    later_chips = TAPS[centre] / QUARTERS + slope_chips * (late - early) / max(late + early, 1e-300)
    density = (float(np.mean(np.abs(wiped[:, centre]) ** 2)) - 1.0) / BIT_S
    energy = max(density, 0.0) * count * BIT_S
    delay_sigma_chips = math.sqrt(0.5 * APART / QUARTERS / energy) if energy > 0.0 else math.inf
    spread_s2 = BIT_S**2 * (count**2 - 1) / 6.0  # twice the variance of the bits' times
    limit = energy_limit(false_alarm, count, heights.size)
    edges_s = found.edges_s[[0, -1]]
    replica_s = float(np.interp(middle_s, found.times_s, found.delays_s))
    replica_rate = float(np.diff(np.interp(edges_s, found.times_s, found.delays_s))[0] / np.diff(edges_s)[0])
    return ChannelMeasurement(
        found.prn,
        bool(heights[row, col] > limit),
        middle_s,
        count * BIT_S,
        replica_s + float(later_chips) / CHIP_RATE_HZ,
        delay_sigma_chips / CHIP_RATE_HZ,
        replica_s,
        replica_rate,
        offset_hz,
        1.0 / (2.0 * math.pi * math.sqrt(energy * spread_s2)) if energy * spread_s2 > 0.0 else math.inf,
        float(np.angle(best.total[0])),
        1.0 / math.sqrt(2.0 * energy) if energy > 0.0 else math.inf,
        10.0 * math.log10(density) if density > 0.0 else -math.inf,
        best.bits[0],
        float(heights[row, col]),
        limit,
    )
