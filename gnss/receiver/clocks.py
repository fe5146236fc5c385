"""The receiver's clock, found in a recording: what delays and Dopplers of acquired satellites have in common."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from gnss.errors import SamplesError
from gnss.gps_time import ReceiverClock

from .acquisition import Acquired, Search, acquire
from .channel import PERIOD_S, correlate_periods
from .codes import CHIP_RATE_HZ, L1_HZ
from .samples import Samples
from .tracking import Aiding

__all__ = ["find_clock"]

AGREE_S = 1.5 / CHIP_RATE_HZ  # cells of an acquisition, and places that are a hundred metres off
LEAST = 2  # satellites: one may be noise, or somebody else's code
MOST_S = 0.1
PADDED = 8


def find_clock(
    samples: Samples, aiding: Aiding, prns: Sequence[int], search: Search | None = None
) -> tuple[ReceiverClock, tuple[Acquired, ...]]:
    """(the receiver's clock within half a millisecond of its start, the satellites that agree on it).

    The start that was stated must be right to that, as codes repeat each millisecond. The drift is that of their
    carriers, squared so that data bits go, over up to 0.1 s of the samples. Raises SamplesError where fewer than two of
    prns are acquired and agree.
    """
    asked = search or Search(duration_s=min(0.02, math.floor(samples.duration_s * 1e3) * 1e-3))
    late = []
    for one in acquire(samples, asked, prns).found:
        at_s = np.array([one.code_start_sample / samples.rate_hz, one.code_start_sample / samples.rate_hz + 1e-3])
        delays_s = aiding.delays_s(one.prn, at_s)
        sent_s = at_s[0] + aiding.start.second_of_week % PERIOD_S - delays_s[0]
        offset_s = math.remainder(sent_s, PERIOD_S)
        drift = -one.doppler_hz / L1_HZ - float(np.diff(delays_s)[0]) * 1e3
        late.append((one, offset_s, drift))
    groups = [
        [other for other in late if abs(math.remainder(other[1] - offset_s, PERIOD_S)) < AGREE_S]
        for _, offset_s, _ in late
    ]
    agreed = max(groups, key=len, default=[])
    if len(agreed) < LEAST:
        raise SamplesError(
            f"{len(late)} of the {len(prns)} satellites that should be there were found, and no {LEAST} of them agree "
            "on the receiver's clock; are start, place, rate and type right?"
        )
    first_s = agreed[0][1]
    offset_s = first_s + float(np.median([math.remainder(other - first_s, PERIOD_S) for _, other, _ in agreed]))
    rough = ReceiverClock(offset_s, float(np.median([drift for _, _, drift in agreed])))
    held = dataclasses.replace(aiding, clock=rough)
    drift = rough.drift - float(np.median([_carrier_hz(samples, held, one.prn) for one, _, _ in agreed])) / L1_HZ
    return ReceiverClock(offset_s, drift), tuple(one for one, _, _ in agreed)


def _carrier_hz(samples: Samples, aiding: Aiding, prn: int) -> float:
    """By how much a satellite's carrier is above the replica's, within 250 Hz to either side."""
    count = math.floor(min(samples.duration_s, MOST_S) * samples.rate_hz)
    part = dataclasses.replace(samples, values=samples.values[:count], warnings=())
    times_s = np.linspace(0.0, part.duration_s, 12)
    told = times_s, aiding.delays_s(prn, times_s)
    sums, _, _ = correlate_periods(part, prn, told, aiding.start.second_of_week % PERIOD_S, 1)
    best = sums[:, int(np.argmax((np.abs(sums) ** 2).sum(axis=0)))]
    size = PADDED * len(best)
    powers = np.abs(np.fft.fft(best**2, size))
    top = int(powers.argmax())
    before, at, after = powers[(top - 1) % size], powers[top], powers[(top + 1) % size]
    bend = before - 2.0 * at + after
    place = top + (0.5 * float((before - after) / bend) if bend < 0.0 else 0.0)
    return math.remainder(place / size, 1.0) / (2.0 * PERIOD_S)
