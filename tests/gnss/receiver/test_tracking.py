"""Aided channels through a recording: the clock found, ranges and carriers the truths, bits, and what is refused."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from gnss import GnssInputError, ReceiverClock, SamplesError
from gnss.receiver import Aiding, Samples, bits_needed, energy_limit, find_clock, search_bits, track
from tests.gnss.differential import world
from tests.gnss.receiver import recordings
from tests.reference import gps_signals

STRENGTHS = dict(zip(world.in_sight()[:5], (46.0, 45.0, 44.0, 42.0, 28.0), strict=True))
PRNS = [int(name[1:]) for name in STRENGTHS]
DURATION_S = 1.3
TRACK_S = np.arange(-1.0, 4.0, 0.5)


@pytest.fixture(scope="module")
def recording():
    return recordings.recorded(STRENGTHS, DURATION_S)


def aiding(clock=ReceiverClock(), **changes):  # noqa: B008 - frozen
    given = {"times_s": TRACK_S, "antennas_ecef_m": recordings.antenna_m(TRACK_S), **changes}
    return Aiding(world.ORBITS, world.START, clock=clock, **given)


def reading(values):
    def read(start_s, span_s):
        first = round(start_s * recordings.RATE_HZ)
        return Samples(values[first : first + round(span_s * recordings.RATE_HZ)], recordings.RATE_HZ)

    return read


def test_the_clock_is_found_and_every_channel_measures_the_truth(recording):
    values, bits = recording
    read = reading(values)
    clock, agreed = find_clock(read(0.0, 0.1), aiding(), PRNS)
    assert len(agreed) >= 3
    assert clock.offset_s == pytest.approx(recordings.OFFSET_S, abs=0.5 / gps_signals.CHIP_RATE_HZ)
    assert clock.drift * gps_signals.L1_HZ == pytest.approx(recordings.DRIFT * gps_signals.L1_HZ, abs=1.5)
    seconds = list(track(read, aiding(clock), PRNS, DURATION_S))
    assert [len(rows) for rows, _ in seconds] == [5, 5]
    assert all(one.detected for rows, _ in seconds for one in rows[:4])
    for one in seconds[0][0]:
        name = f"G{one.prn:02d}"
        early, at, late = recordings.true_delays(name, one.middle_s + np.array([-0.5, 0.0, 0.5]))
        assert one.detected
        assert abs(one.pseudorange_m - world.LIGHT * at) < 4.0 * one.pseudorange_sigma_m + 1.0
        true_hz = -gps_signals.L1_HZ * (late - early)
        assert one.doppler_hz == pytest.approx(true_hz, abs=5.0 * one.frequency_sigma_hz + 0.01)
        assert one.cn0_db_hz == pytest.approx(STRENGTHS[name], abs=1.5)
        sent = bits[name][(math.ceil(-recordings.true_delays(name, np.zeros(1))[0] / 0.02) + np.arange(50)) % 101]
        assert abs(one.bits @ sent) >= (50 if STRENGTHS[name] > 30.0 else 46)
    # the second interval, of 0.26 s: phases went on by what ranges did, but for half cycles
    for before, after in zip(*(rows for rows, _ in seconds), strict=True):
        at = np.array([before.middle_s, after.middle_s])
        went = gps_signals.L1_HZ * np.diff(recordings.true_delays(f"G{before.prn:02d}", at))[0]
        off = math.remainder(after.carrier_cycles - before.carrier_cycles - went, 0.5)
        assert abs(off) < 0.01 + 5.0 * (before.phase_sigma_rad + after.phase_sigma_rad) / (2.0 * np.pi)
    # and the clock is followed: its code's offset was good to a fifth of a chip
    assert seconds[1][1].clock.drift == pytest.approx(recordings.DRIFT, abs=3e-11)


def test_each_channel_sums_as_long_as_it_is_told(recording):
    clock = ReceiverClock(recordings.OFFSET_S, recordings.DRIFT)
    told = {PRNS[0]: 0.02, PRNS[1]: 0.1}
    rows, _ = next(track(reading(recording[0]), aiding(clock), PRNS[:3], 1.03, integrations_s=told))
    counts = [sum(one.prn == prn for one in rows) for prn in PRNS[:3]]
    assert counts == [50, 10, 1]
    assert {round(one.duration_s, 9) for one in rows} == {0.02, 0.1, 1.0}
    ordered = [one.middle_s - 0.5 * one.duration_s for one in rows]
    # what was sent at one time arrives within 20 ms
    assert all(later > earlier - 0.021 for earlier, later in itertools.pairwise(ordered))
    short = [one for one in rows if one.prn == PRNS[0]]
    assert all(one.detected and one.frequency_offset_hz == 0.0 for one in short)


def test_a_channel_measures_by_itself_whoever_else_is_listened_to(recording):
    clock = ReceiverClock(recordings.OFFSET_S, recordings.DRIFT)
    among, alone = (next(track(reading(recording[0]), aiding(clock), prns, 0.33))[0] for prns in (PRNS[:3], PRNS[1:2]))
    (one,), other = alone, among[1]
    assert (one.prn, one.delay_s, one.frequency_offset_hz, one.phase_rad, one.cn0_db_hz) == (
        other.prn,
        other.delay_s,
        other.frequency_offset_hz,
        other.phase_rad,
        other.cn0_db_hz,
    )
    assert one.bits.tolist() == other.bits.tolist()


def test_a_start_between_bits_and_samples_from_the_middle_make_no_difference(recording):
    values, _ = recording
    clock = ReceiverClock(recordings.OFFSET_S, recordings.DRIFT)
    whole, _ = next(track(reading(values), aiding(clock), PRNS[:2], 1.03))
    cut = round(0.1234 * recordings.RATE_HZ)
    late_s = cut / recordings.RATE_HZ
    later = Aiding(
        world.ORBITS,
        world.START.plus(late_s),
        TRACK_S - late_s,
        recordings.antenna_m(TRACK_S),
        ReceiverClock(recordings.OFFSET_S + recordings.DRIFT * late_s, recordings.DRIFT),
    )
    part, _ = next(track(reading(values[cut:]), later, PRNS[:2], 1.03))
    for one, other in zip(whole, part, strict=True):
        at = np.array([one.middle_s, other.middle_s + late_s])
        went_m = world.LIGHT * np.diff(recordings.true_delays(f"G{one.prn:02d}", at))[0]
        assert other.pseudorange_m - one.pseudorange_m == pytest.approx(went_m, abs=6.0)


def test_a_recording_in_which_nothing_is_known_has_no_clock(recording):
    noise = gps_signals.noise(np.random.default_rng(2), 210_000)
    with pytest.raises(SamplesError, match=r"0 of the 5 satellites .* found, and no 2 of them agree"):
        find_clock(Samples(noise, recordings.RATE_HZ), aiding(), PRNS)
    # an hour off, satellites have moved by kilometres, and do not agree on a clock
    wrong = Aiding(world.ORBITS, world.START.plus(3600.0), TRACK_S, recordings.antenna_m(TRACK_S))
    with pytest.raises(SamplesError, match="are start, place, rate and type right"):
        find_clock(reading(recording[0])(0.0, 0.1), wrong, PRNS)


def test_aiding_that_foretells_nothing_is_refused(recording):
    with pytest.raises(GnssInputError, match="as many places"):
        aiding(times_s=TRACK_S[1:])
    with pytest.raises(GnssInputError, match="times that rise"):
        aiding(times_s=TRACK_S[::-1])
    short = aiding(ReceiverClock(), times_s=TRACK_S / 10.0)
    with pytest.raises(GnssInputError, match=r"trajectory reaches from -0\.1 to 0\.35 s"):
        next(track(reading(recording[0]), short, PRNS, 1.03))
    with pytest.raises(SamplesError, match="whole bits of 20 ms"):
        next(track(reading(recording[0]), aiding(), PRNS, 1.03, integrations_s={PRNS[0]: 2.0}))


def test_as_many_bits_are_summed_as_a_signal_needs():
    assert [bits_needed(cn0) for cn0 in (45.0, 10.0)] == [1, 50]
    rng = np.random.default_rng(8)
    for cn0_db_hz in (19.0, 24.0, 28.0):
        count = bits_needed(cn0_db_hz)
        amplitude = math.sqrt(10.0 ** (cn0_db_hz / 10.0) * 0.02)
        sums = amplitude + gps_signals.noise(rng, 4000 * count).reshape(4000, count)
        seen = np.mean(search_bits(sums).amplitude > energy_limit(1e-3, count))
        assert seen > 0.985
    with pytest.raises(GnssInputError, match="between 0 and 1"):
        bits_needed(30.0, detection=1.0)
