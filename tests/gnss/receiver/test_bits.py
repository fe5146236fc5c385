"""Data bits: exact against all combinations, alarms at the stated rate, what 15, 17 and 20 dB-Hz give in a second."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from gnss import GnssInputError
from gnss.receiver import energy_limit, search_bits
from tests.reference import gps_signals

WAVELENGTH_MM = 1e3 * gps_signals.C / gps_signals.L1_HZ


def bit_sums(rng, draws, cn0_db_hz, count=50):
    """(sums with noise of unit power, bits, phases) of a second."""
    bits, phases = rng.choice([-1, 1], (draws, count)), rng.uniform(-np.pi, np.pi, draws)
    amplitude = math.sqrt(10.0 ** (cn0_db_hz / 10.0) * 0.02)
    noise = gps_signals.noise(rng, draws * count).reshape(draws, count)
    return amplitude * bits * np.exp(1j * phases)[:, None] + noise, bits, phases


def test_eleven_bits_are_those_of_the_best_of_all_combinations_in_200_draws():
    every = np.array(list(itertools.product([-1, 1], repeat=11)))
    rng = np.random.default_rng(11)
    for draw in range(200):
        sums, *_ = bit_sums(rng, 1, (0.0, 14.0, 25.0)[draw % 3], 11)
        totals = np.abs(every @ sums[0])
        found = search_bits(sums)
        assert found.amplitude[0] == pytest.approx(totals.max(), rel=1e-12)
        assert abs(found.bits[0] @ sums[0]) == pytest.approx(totals.max(), rel=1e-12)
        assert found.total[0] == pytest.approx(found.bits[0] @ sums[0], rel=1e-9, abs=1e-9)


def test_turning_all_sums_or_their_signs_changes_nothing_but_that():
    rng = np.random.default_rng(2)
    sums, *_ = bit_sums(rng, 40, 15.0)
    plain, turned = search_bits(sums), search_bits(sums * np.exp(0.7j))
    assert turned.amplitude == pytest.approx(plain.amplitude)
    assert (np.abs((turned.bits * plain.bits).sum(axis=1)) == 50).all()
    signs = rng.choice([-1, 1], sums.shape)
    assert search_bits(sums * signs).amplitude == pytest.approx(plain.amplitude)


@pytest.mark.parametrize(("rate", "bits"), [(1e-2, 50), (1e-3, 50), (1e-2, 20)])
def test_noise_exceeds_the_limit_as_often_as_was_said(rate, bits):
    rng, draws = np.random.default_rng(3), 60_000
    noise = gps_signals.noise(rng, draws * bits).reshape(draws, bits)
    alarms = np.mean(search_bits(noise).amplitude > energy_limit(rate, bits))
    # with few bits the expansion errs to the safe side
    assert (0.8 if bits == 50 else 0.5) * rate - 3.0 * math.sqrt(rate / draws) < alarms
    assert alarms < 1.1 * rate + 3.0 * math.sqrt(rate / draws)


@pytest.mark.parametrize(
    ("cn0_db_hz", "detected", "wrong_bits", "phase_mm"),
    [(15.0, 0.87, 0.14, 6.0), (17.0, 0.998, 0.085, 4.0), (20.0, 1.0, 0.025, 2.5)],
)
def test_a_second_of_a_weak_signal_gives_detection_bits_and_phase(cn0_db_hz, detected, wrong_bits, phase_mm):
    sums, bits, phases = bit_sums(np.random.default_rng(4), 4000, cn0_db_hz)
    found = search_bits(sums)
    seen = found.amplitude > energy_limit(1e-3, 50)
    assert seen.mean() >= detected
    same = np.sign((found.bits * bits).sum(axis=1))
    assert np.mean(found.bits != bits * same[:, None]) <= wrong_bits
    off = np.angle(found.total * same * np.exp(-1j * phases))
    assert np.std(off[seen]) * WAVELENGTH_MM / (2.0 * np.pi) <= phase_mm


def test_what_is_no_sum_of_bits_is_refused():
    for sums in (np.empty((2, 0)), [1.0, math.nan], np.ones((2, 2, 2))):
        with pytest.raises(GnssInputError, match="Sums of bits must be finite"):
            search_bits(sums)
    for question in ((0.0, 50), (1e-3, 0), (1e-3, 50, 0)):
        with pytest.raises(GnssInputError, match="A limit needs"):
            energy_limit(*question)
