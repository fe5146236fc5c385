"""GPS time: weeks and seconds, UTC with its leap seconds, and week numbers that were counted modulo 1024."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta

import numpy as np
import numpy.typing as npt

from gnss.errors import AlmanacError, GnssInputError

__all__ = [
    "WEEK_S",
    "GpsTime",
    "Instants",
    "Moment",
    "Moments",
    "ReceiverClock",
    "full_week",
    "instants",
    "leap_seconds_at",
]

WEEK_S = 604_800
LIGHT_M_PER_S = 299_792_458.0
WEEKS_PER_ROLLOVER = 1024
# the year 2363: whatever lies beyond is no week number
LAST_WEEK = 20_000
EPOCH = datetime(1980, 1, 6, tzinfo=UTC)

# GPS minus UTC from the first instant of each day on; none was announced after 2017 (IERS Bulletin C)
LEAP_SECONDS = (
    (date(1980, 1, 6), 0),
    (date(1981, 7, 1), 1),
    (date(1982, 7, 1), 2),
    (date(1983, 7, 1), 3),
    (date(1985, 7, 1), 4),
    (date(1988, 1, 1), 5),
    (date(1990, 1, 1), 6),
    (date(1991, 1, 1), 7),
    (date(1992, 7, 1), 8),
    (date(1993, 7, 1), 9),
    (date(1994, 7, 1), 10),
    (date(1996, 1, 1), 11),
    (date(1997, 7, 1), 12),
    (date(1999, 1, 1), 13),
    (date(2006, 1, 1), 14),
    (date(2009, 1, 1), 15),
    (date(2012, 7, 1), 16),
    (date(2015, 7, 1), 17),
    (date(2017, 1, 1), 18),
)


@dataclass(frozen=True, slots=True, order=True)
class GpsTime:
    """An instant of GPS time, which knows no leap seconds.

    week: full weeks since 1980-01-06, not modulo 1024. second_of_week: 0 <= s < 604800.
    Raises GnssInputError.
    """

    week: int
    second_of_week: float

    def __post_init__(self) -> None:
        if not (0 <= self.week <= LAST_WEEK and 0.0 <= self.second_of_week < WEEK_S):
            raise GnssInputError(
                f"GPS time needs a week in 0…{LAST_WEEK} and a second of the week in 0…604800, not {self.week} and "
                f"{self.second_of_week:g}."
            )

    @classmethod
    def of_utc(cls, utc: datetime, leap_seconds: int | None = None) -> GpsTime:
        """GPS time of an aware datetime; leap_seconds is GPS − UTC, None takes the built-in table's.

        Raises GnssInputError for a datetime without time zone or before 1980-01-06.
        """
        if utc.tzinfo is None:
            raise GnssInputError(f"The time {utc.isoformat()} has no time zone; give an aware datetime (UTC).")
        utc = utc.astimezone(UTC)
        if utc < EPOCH:
            raise GnssInputError(f"The time {utc.isoformat()} lies before GPS time began, 1980-01-06.")
        leap = leap_seconds_at(utc.date()) if leap_seconds is None else leap_seconds
        since = utc - EPOCH + timedelta(seconds=leap)
        week, rest = divmod(since, timedelta(seconds=WEEK_S))
        return cls(week, rest.days * 86_400 + rest.seconds + rest.microseconds * 1e-6)

    def utc(self, leap_seconds: int | None = None) -> datetime:
        """The aware datetime in UTC, to the microsecond; inside a leap second, the second that follows it."""
        gps = EPOCH + timedelta(seconds=self.week * WEEK_S) + timedelta(seconds=self.second_of_week)
        if leap_seconds is not None:
            return gps - timedelta(seconds=leap_seconds)
        # a leap second ends, in GPS time, as many seconds after midnight as there are leap seconds from then on
        leap = next(leap for day, leap in reversed(LEAP_SECONDS) if gps >= _midnight(day) + timedelta(seconds=leap - 1))
        return max(gps - timedelta(seconds=leap), _midnight(_first_day_of(leap)))

    def plus(self, seconds: float) -> GpsTime:
        """The instant so many seconds later."""
        weeks, second = divmod(self.second_of_week + seconds, WEEK_S)
        if second >= WEEK_S:  # a hair before the week's start rounds up to its end
            weeks, second = weeks + 1, 0.0
        return GpsTime(self.week + int(weeks), second)


Moment = datetime | GpsTime
Moments = Moment | Sequence[Moment]


@dataclass(frozen=True, slots=True, eq=False)
class Instants:
    """Many instants of GPS time: full weeks, (n,) int64, and seconds of week, (n,) float64.

    Kept apart, because seconds since 1980 in one float64 would cost a satellite's position half a millimetre.
    """

    week: npt.NDArray[np.int64]
    second_of_week: npt.NDArray[np.float64]

    def since_s(self, week: npt.ArrayLike, second_of_week: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Seconds from a reference to these instants; references broadcast against (n,)."""
        weeks = self.week - np.asarray(week, np.int64)
        seconds: npt.NDArray[np.float64] = weeks * float(WEEK_S) + (self.second_of_week - np.asarray(second_of_week))
        return seconds


@dataclass(frozen=True, slots=True)
class ReceiverClock:
    """By how much a receiver's clock is ahead of GPS: offset_s at at_s, and drift, seconds per second.

    at_s counts as the times do that it is asked for: from the first sample, or as a log's readings. Raises
    GnssInputError.
    """

    offset_s: float = 0.0
    drift: float = 0.0
    at_s: float = 0.0

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.offset_s, self.drift, self.at_s))):
            raise GnssInputError("A receiver's clock needs finite numbers of seconds.")

    @classmethod
    def of_ranges(cls, offset_m: float, drift_m_per_s: float = 0.0, at_s: float = 0.0) -> ReceiverClock:
        """The clock that makes ranges longer by so much."""
        return cls(offset_m / LIGHT_M_PER_S, drift_m_per_s / LIGHT_M_PER_S, at_s)

    def ahead_s(self, times_s: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(k,) seconds at times (k,)."""
        ahead: npt.NDArray[np.float64] = self.offset_s + self.drift * (np.asarray(times_s, np.float64) - self.at_s)
        return ahead

    def ranges_m(self, times_s: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """(k,) metres by which ranges are longer at times (k,)."""
        return LIGHT_M_PER_S * self.ahead_s(times_s)

    @property
    def drift_m_per_s(self) -> float:
        """By how much ranges grow longer in a second."""
        return LIGHT_M_PER_S * self.drift


def instants(times: Moments, leap_seconds: int | None = None) -> Instants:
    """One instant or many: aware datetimes and GPS times may be mixed.

    leap_seconds: GPS − UTC for the datetimes; None takes the built-in table's.
    Raises GnssInputError for no time at all, and for datetimes that are no instants.
    """
    listed = [times] if isinstance(times, datetime | GpsTime) else list(times)
    if not listed:
        raise GnssInputError("At least one time is needed.")
    gps = [time if isinstance(time, GpsTime) else GpsTime.of_utc(time, leap_seconds) for time in listed]
    return Instants(np.array([t.week for t in gps], np.int64), np.array([t.second_of_week for t in gps], np.float64))


def leap_seconds_at(day: date) -> int:
    """GPS − UTC in seconds on a UTC day since 1980; after the table's end, 2017, still 18."""
    return next((leap for start, leap in reversed(LEAP_SECONDS) if day >= start), 0)


def full_week(week: int, reference: date | None) -> int:
    """The full week of a number counted modulo 1024: the one next to a reference date, at most 9.8 years from it.

    Numbers from 1024 on are full weeks already. Raises AlmanacError where the reference is needed and missing.
    """
    if week < 0:
        raise AlmanacError(f"A GPS week number cannot be {week}.")
    if week >= WEEKS_PER_ROLLOVER:
        return week
    if reference is None:
        raise AlmanacError(
            f"Week {week} is counted modulo 1024 and comes round every 19.6 years; give reference, a date near it."
        )
    reference_week = (date(reference.year, reference.month, reference.day) - EPOCH.date()).days // 7
    rollovers = math.floor((reference_week - week) / WEEKS_PER_ROLLOVER + 0.5)
    return week + WEEKS_PER_ROLLOVER * max(rollovers, 0)


def _midnight(day: date) -> datetime:
    return datetime(day.year, day.month, day.day, tzinfo=UTC)


def _first_day_of(leap: int) -> date:
    return next(day for day, value in LEAP_SECONDS if value == leap)
