"""Sums of correlators in closed form, of which long drives are simulated, are those of samples; sigmas hold."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from gnss import GnssInputError
from gnss.receiver import BitSums, Samples, correlate_bits, measure_sums
from tests.reference import correlator_sums, gps_signals

RATE_HZ = 2.5e6
TIMES_S = np.linspace(0.0, 0.5, 51)


def true_delays(t):
    return 0.0712345 - 1.7e-6 * t + 0.5 * 3e-9 * t**2


def foretold(chips, hertz):
    return true_delays(TIMES_S) - chips / gps_signals.CHIP_RATE_HZ + hertz / gps_signals.L1_HZ * (TIMES_S - 0.25)


@pytest.mark.parametrize(("chips", "hertz"), [(0.1, 0.5), (-0.45, 7.0), (0.6, -1.5)])
def test_sums_of_samples_are_the_closed_form(chips, hertz):
    t = np.arange(round(0.5 * RATE_HZ)) / RATE_HZ
    bits = np.random.default_rng(3).choice([-1, 1], 64)
    values = gps_signals.signal(14, true_delays(t), RATE_HZ, 40.0, bits, 0.9)
    found = correlate_bits(Samples(values, RATE_HZ), 14, TIMES_S, foretold(chips, hertz))
    # without noise the samples have the signal's power alone
    scale = np.sqrt(np.mean(np.abs(values) ** 2))
    off_s = true_delays(found.edges_s) - np.interp(found.edges_s, TIMES_S, found.delays_s)
    first = round((found.edges_s[0] - true_delays(found.edges_s[0])) / 0.02)
    sent = bits[(first + np.arange(len(found))) % 64]
    told = correlator_sums.sums(off_s, 40.0, sent, 0.9 / (2.0 * np.pi))
    assert np.abs(found.sums * scale - told).max() < 0.04 * np.abs(told).max()


def test_noise_of_samples_correlates_over_delays_as_the_closed_form_has_it():
    rng = np.random.default_rng(5)
    values = gps_signals.noise(rng, round(6.0 * RATE_HZ))
    times = np.linspace(0.0, 6.0, 301)
    found = correlate_bits(Samples(values, RATE_HZ), 3, times, 0.07 + 1.3e-6 * times).sums
    covariance = (found.conj().T @ found).real / len(found)
    expected = correlator_sums.peak(correlator_sums.TAPS[:, None] - correlator_sums.TAPS)
    # 299 sums: a variance of 1 is known to 6 %
    assert np.abs(covariance - expected).max() < 4.0 / np.sqrt(len(found))
    drawn = correlator_sums.sums(np.zeros(20_001), -300.0, np.ones(20_000), rng=rng)
    assert np.abs((drawn.conj().T @ drawn).real / 20_000 - expected).max() < 0.03


@pytest.mark.parametrize("cn0_db_hz", [24.0, 32.0, 40.0])
def test_delay_frequency_and_phase_err_by_their_sigmas(cn0_db_hz):
    rng, errors, sigmas = np.random.default_rng(6), [], []
    edges = np.arange(51) * 0.02
    for _ in range(300):
        chips, hertz = rng.uniform(-0.4, 0.4), rng.uniform(-1.5, 1.5)
        off_s = chips / gps_signals.CHIP_RATE_HZ - hertz / gps_signals.L1_HZ * (edges - 0.5)
        made = correlator_sums.sums(off_s, cn0_db_hz, rng.choice([-1, 1], 50), rng=rng)
        found = measure_sums(BitSums(1, made, edges, np.array([0.0, 1.0]), np.zeros(2)))
        assert found.detected
        half = np.mod(found.phase_rad + 2.0 * np.pi * gps_signals.L1_HZ * off_s.mean() + np.pi / 2.0, np.pi)
        errors.append((found.delay_s - off_s.mean(), found.frequency_offset_hz - hertz, half - np.pi / 2.0))
        sigmas.append((found.delay_sigma_s, found.frequency_sigma_hz, found.phase_sigma_rad))
    ratios = np.std(errors, axis=0) / np.sqrt(np.mean(np.square(sigmas), axis=0))
    # at 24 dB-Hz a twentieth of the bits is wrong, which phase and frequency feel
    assert np.all((ratios > 0.85) & (ratios < (1.35 if cn0_db_hz < 30.0 else 1.2))), ratios


def test_one_bit_tells_no_frequency_and_none_no_measurement():
    made = correlator_sums.sums(np.zeros(2), 45.0, np.ones(1))
    one = BitSums(1, made, np.array([0.0, 0.02]), np.array([0.0, 1.0]), np.zeros(2))
    found = measure_sums(one)
    assert (found.detected, found.frequency_offset_hz, found.frequency_sigma_hz) == (True, 0.0, np.inf)
    assert found.carrier_cycles == pytest.approx(0.0, abs=1e-9)
    with pytest.raises(GnssInputError, match="one bit at least"):
        measure_sums(dataclasses.replace(one, sums=made[:0]))
