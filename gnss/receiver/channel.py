"""One satellite over up to a second, without loops: where the sums of an aided replica are greatest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gnss.errors import SamplesError

from .bits import BIT_S, energy_limit, search_bits
from .codes import CHIP_RATE_HZ, CHIPS, L1_HZ, ca_code
from .kernels.correlate import QUARTERS, Periods, correlate
from .samples import Samples

__all__ = ["ChannelMeasurement", "measure_channel"]

Array = npt.NDArray[np.float64]
TAPS = np.arange(-4, 5)  # quarters of a chip, later than the replica
APART = 2  # taps from the greatest to early and late: half a chip
PERIOD_S = CHIPS / CHIP_RATE_HZ


@dataclass(frozen=True, eq=False)
class ChannelMeasurement:
    """What one interval says of one satellite.

    detected: the total is above what noise reaches at the rate of false alarms, over all cells of code and frequency.
    middle_s: time of the samples that it is of. delay_s: of the code there; frequency_offset_hz: of the carrier from
    the replica's. phase_rad: of the carrier there from the replica's, right up to half a cycle; phase_sigma_rad: by
    C/N0. bits: +-1, right up to the sign of all. cn0_db_hz: -inf where the bits have no more power than noise.
    """

    detected: bool
    middle_s: float
    delay_s: float
    frequency_offset_hz: float
    phase_rad: float
    phase_sigma_rad: float
    cn0_db_hz: float
    bits: npt.NDArray[np.int8]
    amplitude: float
    limit: float


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

    times_s, delays_s: (k,) from satellite to sample as the aiding foretells them, clocks included, with times that
    increase over all samples, close enough for straight lines between them; whole bits begin where what was sent,
    time less delay, is a multiple of 20 ms. All whole bits of the samples are used. Raises SamplesError,
    GnssInputError.
    """
    times, delays = np.asarray(times_s, np.float64), np.asarray(delays_s, np.float64)
    if times.ndim != 1 or times.shape != delays.shape or len(times) < 2 or not np.isfinite([times, delays]).all():
        raise SamplesError("Aiding needs as many finite delays as times, two at least.")
    if (np.diff(times) <= 0.0).any() or times[0] > 0.0 or times[-1] < samples.duration_s:
        raise SamplesError("The times of the aiding must increase and reach over all samples.")
    sent, rate = times - delays, samples.rate_hz
    if (np.diff(sent) <= 0.0).any():
        raise SamplesError("The delays of the aiding grow faster than time.")
    begin_bit = math.ceil(float(np.interp(0.0, times, sent)) / BIT_S)
    end_bit = math.floor(float(np.interp(samples.duration_s, times, sent)) / BIT_S)
    if end_bit <= begin_bit:
        raise SamplesError(f"There is no whole data bit in the {1e3 * samples.duration_s:.3g} ms of the samples.")
    each = round(BIT_S / PERIOD_S)
    edges_s = np.interp(np.arange(begin_bit * each, end_bit * each + 1) * PERIOD_S, sent, times)
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
    sums = np.zeros((end_bit - begin_bit, len(TAPS)), np.complex128)
    correlate(samples.values, ca_code(prn), periods, TAPS, sums)
    power = float(np.mean(np.abs(samples.values[first[0] : first[-1]]) ** 2))
    sums /= math.sqrt(power * BIT_S * rate)
    return _peak(sums, edges_s[::each], (times, delays), reach_hz, false_alarm)


def _peak(
    sums: npt.NDArray[np.complex128], edges_s: Array, aiding: tuple[Array, Array], reach_hz: float, false_alarm: float
) -> ChannelMeasurement:
    """Coarse: the greatest of all taps and frequencies; fine: a parabola over frequency, early and late over delay."""
    count = len(sums)
    middle_s = 0.5 * float(edges_s[0] + edges_s[-1])
    at_s = 0.5 * (edges_s[1:] + edges_s[:-1]) - middle_s
    step_hz = 0.25 / (count * BIT_S)
    steps = math.ceil(reach_hz / step_hz)
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
    found = search_bits(wiped[:, centre])
    early, late = (abs(complex(found.bits[0] @ wiped[:, centre + side])) for side in (-APART, APART))
    later_chips = TAPS[centre] / QUARTERS + 0.5 * (late - early) / max(late + early, 1e-300)
    density = (float(np.mean(np.abs(wiped[:, centre]) ** 2)) - 1.0) / BIT_S
    limit = energy_limit(false_alarm, count, heights.size)
    return ChannelMeasurement(
        bool(heights[row, col] > limit),
        middle_s,
        float(np.interp(middle_s, *aiding)) + float(later_chips) / CHIP_RATE_HZ,
        offset_hz,
        float(np.angle(found.total[0])),
        1.0 / math.sqrt(2.0 * density * count * BIT_S) if density > 0.0 else math.inf,
        10.0 * math.log10(density) if density > 0.0 else -math.inf,
        found.bits[0],
        float(heights[row, col]),
        limit,
    )
