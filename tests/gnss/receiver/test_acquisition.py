"""Acquisition: the recorded sample of gnss-sdr, satellites made up, the rate of false alarms, and near beside far."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gnss import GnssInputError, SamplesError
from gnss.receiver import PRNS, Samples, Search, acquire, correlation_powers, noise_limit, read_samples
from tests.house.repository import ROOT
from tests.reference import gps_signals

RECORDED = ROOT / "../shared/data/if/GPS_L1_CA_ID_1_Fs_4Msps_2ms.dat"


def made_up(satellites, rate_hz=4e6, duration_s=0.004, seed=1, intermediate_hz=0.0):
    """Samples of satellites (prn, Doppler, delay of the first chip in samples, C/N0)."""
    t = np.arange(round(duration_s * rate_hz)) / rate_hz
    values = gps_signals.noise(np.random.default_rng(seed), len(t))
    for prn, doppler_hz, start, cn0_db_hz in satellites:
        delays_s = start / rate_hz - doppler_hz / gps_signals.L1_HZ * t
        values += gps_signals.signal(prn, delays_s, rate_hz, cn0_db_hz)
    return Samples(values * np.exp(2j * np.pi * intermediate_hz * t), rate_hz, intermediate_hz)


@pytest.mark.skipif(not RECORDED.exists(), reason="the recorded samples of ../shared are not here")
@pytest.mark.parametrize("coherent_ms", [1, 2])
def test_the_sample_of_gnss_sdr_has_prn_1_at_its_place_and_nobody_else(coherent_ms):
    samples = read_samples(RECORDED, 4e6)
    found = acquire(samples, Search(coherent_ms=coherent_ms, duration_s=0.002, false_alarm=1e-3))
    assert [one.prn for one in found.found] == [1]
    first = found.satellites[0]
    assert abs(first.doppler_hz - 1680.0) <= 250.0
    assert abs(first.code_start_sample - 523) <= 1
    assert len(found.satellites) == len(PRNS)


@pytest.mark.skipif(not RECORDED.exists(), reason="the recorded samples of ../shared are not here")
def test_whoever_is_asked_for_alone_is_not_found_by_the_code_of_another():
    samples = read_samples(RECORDED, 4e6)
    assert acquire(samples, Search(duration_s=0.002), [7, 8]).found == ()


@pytest.mark.parametrize(
    ("rate_hz", "intermediate_hz"), [(4e6, 0.0), (2.5e6, 0.0), (5.456e6, 1.364e6), (4.1304e6, -1e5)]
)
def test_satellites_are_found_where_they_are(rate_hz, intermediate_hz):
    truth = [(3, 1500.0, 700, 48.0), (19, -2750.0, 1999, 45.0), (32, 250.0, 3, 47.0)]
    found = acquire(made_up(truth, rate_hz, 0.01, intermediate_hz=intermediate_hz), Search(duration_s=0.01))
    assert {one.prn for one in found.found} == {3, 19, 32}
    for prn, doppler_hz, start, cn0_db_hz in truth:
        one = next(one for one in found.found if one.prn == prn)
        assert abs(one.doppler_hz - doppler_hz) <= 250.0
        assert abs(one.code_start_sample - start) <= 1
        assert abs(one.cn0_db_hz - cn0_db_hz) < 2.0


def test_the_code_is_told_from_the_samples_beginning_whatever_the_start():
    samples = made_up([(9, 0.0, 1234, 50.0)], duration_s=0.012)
    found = acquire(samples, Search(start_s=0.0051, duration_s=0.004), [9]).found[0]
    assert found.code_start_sample % 4000 in range(1233, 1236)
    assert 20_400 <= found.code_start_sample < 24_400


def test_a_far_satellite_is_found_beside_a_near_one_and_none_is_made_of_its_code():
    samples = made_up([(6, 1100.0, 555, 68.0), (21, -800.0, 3100, 46.0)], duration_s=0.01)
    found = acquire(samples, Search(duration_s=0.01, false_alarm=1e-5))
    assert {one.prn for one in found.found} == {6, 21}


def test_noise_alarms_no_more_often_than_it_was_told_to():
    rng, draws = np.random.default_rng(4), 250
    search = Search(doppler_max_hz=750.0, false_alarm=0.1)
    alarms = sum(
        len(acquire(Samples(gps_signals.noise(rng, 16_000), 4e6), search, [3, 17]).found) for _ in range(draws)
    )
    rate, sigma = alarms / (2 * draws), math.sqrt(0.1 * 0.9 / (2 * draws))
    # neighbouring cells share noise, which may make alarms rarer, but not by much
    assert 0.04 < rate < 0.1 + 3.0 * sigma


def test_the_limit_is_that_of_a_single_exponential_power():
    assert noise_limit(1e-3, 1, 1) == pytest.approx(-math.log(1e-3))
    # chi-square of four degrees of freedom exceeds 18.467 with 0.001, scipy.stats.chi2.isf(1e-3, 4)
    assert noise_limit(1e-3, 1, 2) == pytest.approx(18.466827 / 4.0, rel=1e-6)


def test_the_map_of_a_search_has_its_peak_where_the_satellite_is():
    powers = correlation_powers(made_up([(12, -500.0, 80, 52.0)]), 12, Search(doppler_max_hz=1000.0))
    row, col = np.unravel_index(powers.argmax(), powers.shape)
    assert powers.shape == (9, 4000)
    assert (row, abs(col - 80) <= 1) == (2, True)


BAD_SEARCHES = [
    ({"doppler_step_hz": 0.0}, "Dopplers reach"),
    ({"false_alarm": 0.0}, "between 0 and 1"),
    ({"coherent_ms": 21}, "1 to 20 of them coherently"),
    ({"duration_s": 1.0}, "1 to 100 ms"),
    ({"start_s": -1.0}, "no start before 0"),
]


@pytest.mark.parametrize(("fields", "sentence"), BAD_SEARCHES)
def test_a_search_that_makes_no_sense_is_refused(fields, sentence):
    with pytest.raises(SamplesError, match=sentence):
        Search(**fields)


def test_searches_that_samples_cannot_answer_are_refused():
    samples = made_up([])
    with pytest.raises(SamplesError, match=r"There are 4 ms in the samples; a search of 4 ms from 1 ms on needs more"):
        acquire(samples, Search(start_s=0.001))
    with pytest.raises(SamplesError, match="8 ms cannot be summed within 4 ms"):
        acquire(samples, Search(coherent_ms=8))
    with pytest.raises(SamplesError, match="No satellite was named"):
        acquire(samples, prns=[])
    with pytest.raises(GnssInputError, match="PRN of 1 to 32, not 40"):
        acquire(samples, prns=[40])


def written(tmp_path: Path, values, kind: str) -> Path:
    path = tmp_path / "samples.bin"
    path.write_bytes(np.asarray(values).astype(kind).tobytes())
    return path


@pytest.mark.parametrize("kind", ["<f4", "<i2", "i1"])
def test_samples_of_every_type_are_read_as_they_were_written(tmp_path, kind):
    rng = np.random.default_rng(2)
    parts = np.rint(rng.normal(scale=20.0, size=16_000)).clip(-100, 100)
    names = {"<f4": "complex64", "<i2": "int16", "i1": "int8"}
    read = read_samples(written(tmp_path, parts, kind), 4e6, names[kind])
    assert np.array_equal(read.values.view(np.float32), parts.astype(np.float32))
    later = read_samples(tmp_path / "samples.bin", 4e6, names[kind], start_s=0.0005, duration_s=0.001)
    assert np.array_equal(later.values, read.values[2000:6000])


def test_files_of_another_type_or_length_and_clipped_ones_are_refused(tmp_path):
    rng = np.random.default_rng(3)
    parts = rng.normal(scale=300.0, size=16_000)
    as_floats, as_words = written(tmp_path, parts, "<f4").rename(tmp_path / "f"), written(tmp_path, parts, "<i2")
    for path, kind, sentence in (
        (as_floats, "int16", "are the samples of another type"),
        (as_floats, "int8", "are the samples of another type"),
        (as_words, "complex64", "are the samples of another type"),
        (as_words, "int8", "are the samples of another type"),
        (as_words, "float64", "Samples are of complex64, int16, int8"),
        (tmp_path / "gone", "int8", "cannot be read: No such file"),
    ):
        with pytest.raises(SamplesError, match=sentence):
            read_samples(path, 4e6, kind)
    with pytest.raises(SamplesError, match=r"truncated: from 0 s on it holds 2 ms, 5 ms were asked for"):
        read_samples(as_floats, 4e6, duration_s=0.005)
    with pytest.raises(SamplesError, match=r"There are 0\.2 ms in samples\.bin"):
        read_samples(as_words, 40e6, "int16")
    with pytest.raises(SamplesError, match="A C/A signal needs"):
        read_samples(as_words, 1e6, "int16")
    with pytest.raises(SamplesError, match="zero or more"):
        read_samples(as_words, 4e6, "int16", start_s=-1.0)
    loud = written(tmp_path, np.clip(1000.0 * parts, -32768, 32767), "<i2")
    with pytest.raises(SamplesError, match=r"is clipped: \d+ % of its numbers lie at a limit"):
        read_samples(loud, 4e6, "int16")
    with pytest.raises(SamplesError, match="are zero"):
        read_samples(written(tmp_path, np.zeros(16_000), "i1"), 4e6, "int8")


def test_slight_clipping_and_a_cut_sample_are_told(tmp_path):
    rng = np.random.default_rng(3)
    path = written(tmp_path, np.clip(rng.normal(scale=60.0, size=16_001), -128, 127), "i1")
    told = read_samples(path, 4e6, "int8").warnings
    assert len(told) == 2
    assert told[0] == "samples.bin ends in the middle of a sample; its last bytes are left out."
    assert "% of the numbers of samples.bin are clipped" in told[1]


@pytest.mark.parametrize("kind", ["<f4", "<i2"])
def test_numbers_cut_at_a_converters_own_limit_are_clipped_and_those_of_few_bits_are_not(tmp_path, kind):
    rng, names = np.random.default_rng(3), {"<f4": "complex64", "<i2": "int16"}
    noise = rng.normal(size=16_000)
    for loud, heard in ((0.5, "% of the numbers of samples.bin are clipped"), (3.0, "is clipped: ")):
        path = written(tmp_path, np.rint(2047.0 * np.clip(loud * noise, -1.0, 1.0)), kind)
        if loud == 0.5:
            assert heard in read_samples(path, 4e6, names[kind]).warnings[0]
        else:
            with pytest.raises(SamplesError, match=heard):
                read_samples(path, 4e6, names[kind])
    two_bits = np.select([np.abs(noise) < 0.98], [np.sign(noise)], 3.0 * np.sign(noise))
    assert read_samples(written(tmp_path, two_bits, kind), 4e6, names[kind]).warnings == ()
    assert read_samples(written(tmp_path, np.rint(300.0 * noise), kind), 4e6, names[kind]).warnings == ()


@pytest.mark.parametrize(
    ("values", "rate_hz", "sentence"),
    [
        (np.full(8000, np.nan, np.complex64), 4e6, "not finite"),
        (np.concatenate([np.ones(7999), [1e9]]), 4e6, "times their median"),
        (np.ones((2, 8000)), 4e6, "one code period"),
        (np.ones(8000), 1e9, "A C/A signal needs"),
    ],
)
def test_samples_that_no_receiver_records_are_refused(values, rate_hz, sentence):
    with pytest.raises(SamplesError, match=sentence):
        Samples(values, rate_hz)
    with pytest.raises(SamplesError, match="half of the sampling rate"):
        Samples(np.ones(8000), 4e6, 3e6)
