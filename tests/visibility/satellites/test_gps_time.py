"""GPS time, leap seconds and week numbers that come round every 19.6 years."""

import math
from datetime import UTC, date, datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gnss import GpsTime, full_week, instants, leap_seconds_at
from gnss.errors import AlmanacError, GnssInputError


@pytest.mark.parametrize(
    ("utc", "week", "second_of_week"),
    [
        (datetime(1980, 1, 6, tzinfo=UTC), 0, 0.0),
        (datetime(2015, 12, 31, 11, 59, 43, tzinfo=UTC), 1877, 388_800.0),  # 17 leap seconds
        (datetime(2009, 3, 31, 23, 59, 45, tzinfo=UTC), 1525, 259_200.0),  # 15, as RINEX files of that day say
        (datetime(2019, 4, 6, 23, 59, 42, tzinfo=UTC), 2048, 0.0),  # the second rollover
    ],
)
def test_known_instants_of_both_clocks_agree(utc, week, second_of_week):
    assert GpsTime.of_utc(utc) == GpsTime(week, second_of_week)
    assert GpsTime(week, second_of_week).utc() == utc


def test_gps_time_goes_on_over_a_leap_second():
    before = GpsTime.of_utc(datetime(2016, 12, 31, 23, 59, 59, tzinfo=UTC))
    after = GpsTime.of_utc(datetime(2017, 1, 1, tzinfo=UTC))
    assert after == before.plus(2.0)
    assert before.plus(1.0).utc() == after.utc() == datetime(2017, 1, 1, tzinfo=UTC)


def test_leap_seconds_may_be_given_in_place_of_the_table():
    noon = datetime(2040, 1, 1, 12, tzinfo=UTC)
    assert GpsTime.of_utc(noon, leap_seconds=20) == GpsTime.of_utc(noon).plus(2.0)
    assert GpsTime.of_utc(noon, leap_seconds=20).utc(leap_seconds=20) == noon


def test_the_table_grows_by_one_at_a_time():
    days = [date(1980, 1, 6) + timedelta(days=n) for n in range(0, 18_000, 20)]
    grown = np.diff([leap_seconds_at(day) for day in days])
    assert set(grown) <= {0, 1}
    assert leap_seconds_at(date(1979, 1, 1)) == 0


def test_a_time_zone_changes_nothing_but_the_clock_face():
    zone = timezone(timedelta(hours=-9, minutes=-30))
    utc = datetime(2020, 5, 5, 3, 4, 5, 678_901, tzinfo=UTC)
    assert GpsTime.of_utc(utc.astimezone(zone)) == GpsTime.of_utc(utc)


@given(st.datetimes(datetime(1980, 1, 7), datetime(2100, 1, 1), timezones=st.just(UTC)))
def test_utc_comes_back_to_the_microsecond(utc):
    assert abs(GpsTime.of_utc(utc).utc() - utc) <= timedelta(microseconds=1)


@given(st.integers(1, 4000), st.floats(0, 604_799), st.floats(-604_800, 604_800))
def test_later_and_earlier_by_the_same_is_where_it_was(week, second, step):
    start = GpsTime(week, second)
    assert instants(start.plus(step)).since_s(week, second)[0] == pytest.approx(step, abs=1e-9)


def test_many_times_of_both_kinds_become_one_series():
    when = instants([datetime(2019, 4, 6, 23, 59, 42, tzinfo=UTC), GpsTime(2047, 604_799.5)])
    np.testing.assert_array_equal(when.week, [2048, 2047])
    np.testing.assert_array_equal(when.second_of_week, [0.0, 604_799.5])


@pytest.mark.parametrize(
    ("times", "words"),
    [
        ([], "At least one time"),
        (datetime(2020, 1, 1), "has no time zone; give an aware datetime"),
        (datetime(1979, 12, 31, tzinfo=UTC), "before GPS time began"),
    ],
)
def test_times_that_are_no_instants_are_refused(times, words):
    with pytest.raises(GnssInputError, match=words):
        instants(times)


@pytest.mark.parametrize("numbers", [(-1, 0.0), (5, -1.0), (5, 604_800.0), (5, math.nan), (20_001, 0.0)])
def test_gps_times_out_of_range_are_refused(numbers):
    with pytest.raises(GnssInputError, match="GPS time needs a week"):
        GpsTime(*numbers)


@pytest.mark.parametrize(
    ("week", "reference", "full"),
    [
        (387, date(1987, 6, 10), 387),
        (387, date(2007, 1, 22), 1411),
        (387, date(2026, 9, 9), 2435),
        (1023, date(2019, 4, 7), 2047),
        (0, date(2019, 4, 6), 2048),
        (387, date(1980, 1, 6), 387),  # nothing is before week 0
        (1411, None, 1411),
        (1411, date(2026, 9, 9), 1411),
    ],
)
def test_a_week_modulo_1024_is_the_one_next_to_the_reference(week, reference, full):
    assert full_week(week, reference) == full


@given(st.integers(1600, 5000), st.integers(-3500, 3500))
def test_a_reference_within_nine_years_finds_the_week(week, days_off):
    reference = date(1980, 1, 6) + timedelta(weeks=week, days=days_off)
    assert full_week(week % 1024, reference) == week or week % 1024 == week


def test_a_week_without_reference_is_not_guessed():
    with pytest.raises(AlmanacError, match="Week 387 is counted modulo 1024"):
        full_week(387, None)
    with pytest.raises(AlmanacError, match="cannot be -3"):
        full_week(-3, date(2020, 1, 1))
