"""A channel over simulated samples: delay, frequency, phase, bits and C/N0 of a satellite that moves, or none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gnss import SamplesError
from gnss.receiver import Samples, measure_channel
from tests.reference import gps_signals

RATE_HZ, TIMES_S = 2.5e6, np.linspace(-0.001, 1.05, 1052)


def true_delays(t):
    return 0.0712345 - 1.7e-6 * t + 0.5 * 3e-9 * t**2


def recorded(cn0_db_hz, seed, duration_s=1.03):
    rng, t = np.random.default_rng(seed), np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    bits = rng.choice([-1, 1], 64)
    values = gps_signals.noise(rng, len(t))
    values += gps_signals.signal(14, true_delays(t), RATE_HZ, cn0_db_hz, bits, 0.9)
    return Samples(values, RATE_HZ), bits


def foretold(chips=0.0, hertz=0.0):
    """The truth, so many chips too early and with a Doppler that is so much too low."""
    return true_delays(TIMES_S) - chips / gps_signals.CHIP_RATE_HZ + hertz / gps_signals.L1_HZ * (TIMES_S - 0.515)


@pytest.mark.parametrize(("cn0_db_hz", "chips", "hertz"), [(20.0, 0.3, 0.4), (30.0, -0.4, -1.1), (45.0, 0.1, 1.6)])
def test_delay_frequency_phase_and_bits_are_the_truths(cn0_db_hz, chips, hertz):
    samples, bits = recorded(cn0_db_hz, 7)
    found = measure_channel(samples, 14, TIMES_S, foretold(chips, hertz))
    assert found.detected
    assert found.frequency_offset_hz == pytest.approx(hertz, abs=0.2 if cn0_db_hz < 25.0 else 0.03)
    chip_sigma = math.sqrt(0.5 / 10.0 ** (cn0_db_hz / 10.0))
    off_chips = (found.delay_s - true_delays(found.middle_s)) * gps_signals.CHIP_RATE_HZ
    assert abs(off_chips) < 3.0 * chip_sigma + 0.05
    assert found.cn0_db_hz == pytest.approx(cn0_db_hz, abs=2.0)
    shift = gps_signals.L1_HZ * (
        np.interp(found.middle_s, TIMES_S, foretold(chips, hertz)) - true_delays(found.middle_s)
    )
    off_cycles = ((found.phase_rad - 0.9) / (2.0 * np.pi) - shift) % 0.5
    assert min(off_cycles, 0.5 - off_cycles) * 2.0 * np.pi < 4.0 * found.phase_sigma_rad + 0.02
    first = math.ceil(-true_delays(0.0) / 0.02)
    sent = bits[(first + np.arange(len(found.bits))) % 64]
    agree = np.mean(found.bits == sent)
    assert max(agree, 1.0 - agree) > (0.9 if cn0_db_hz < 25.0 else 0.999)


def test_noise_is_no_satellite():
    samples, _ = recorded(-30.0, 3)
    found = measure_channel(samples, 14, TIMES_S, foretold())
    assert not found.detected
    assert found.amplitude < found.limit


def test_aiding_that_cannot_be_used_is_refused():
    samples, _ = recorded(30.0, 3, 0.05)
    for times, delays, sentence in (
        (TIMES_S, foretold()[:-1], "as many finite delays as times"),
        (TIMES_S[::-1], foretold(), "must increase"),
        ([0.0, 0.01], [0.07, 0.07], "reach over all samples"),
        ([0.0, 1.0], [0.0, 2.0], "grow faster than time"),
    ):
        with pytest.raises(SamplesError, match=sentence):
            measure_channel(samples, 14, times, delays)
    with pytest.raises(SamplesError, match="no whole data bit"):
        measure_channel(recorded(30.0, 3, 0.01)[0], 14, TIMES_S, foretold())
