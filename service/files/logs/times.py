"""Times of a table: seconds out of numbers in any unit, dates of several orders, and the clock of one day."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from service.errors import RequestError
from service.files.csv_table import Numbers, holds_nothing

from .form import TIMES_S

__all__ = ["TimeReader", "date_order_of", "epoch_unit_of"]

# seconds since 1970 lie between 1973 and 2286; so do these, in their units
SINCE_1970 = (1e8, 1e10)
DATE = re.compile(r"(\d{1,2})([/.\-])(\d{1,2})\2(\d{4})[ T,]*(.*)")
CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}(?:[.,]\d*)?))?")
HALF_A_DAY_S = 43200.0


def epoch_unit_of(number: float) -> str | None:
    """The unit in which a number is a time since 1970; None for one that is not."""
    least, most = SINCE_1970
    return next((unit for unit, second in TIMES_S.items() if least <= number * second < most), None)


def date_order_of(table: str, cells: Iterable[str], given: str | None) -> str | None:
    """Which of day and month comes first in dates like 03/04/2024; None where no cell is one.

    Dots always have the day first. Raises RequestError where all dates may be read either way.
    """
    found, either, dated = set[str](), "", False
    for cell in cells:
        match = DATE.fullmatch(cell)
        if match is None:
            continue
        dated = True
        first, second = int(match[1]), int(match[3])
        if match[2] == "." or first > 12:
            found.add("dmy")
        elif second > 12:
            found.add("mdy")
        elif first != second:
            either = cell
    if given is not None or not dated:
        return given
    if len(found) > 1:
        raise RequestError(f"In the log {table} some dates have the day first and some the month.")
    if not found and either:
        raise RequestError(
            f"In the log {table} dates like {either!r} may begin with day or month: say --date-order dmy or mdy."
        )
    return next(iter(found), "dmy")


@dataclass(slots=True)
class TimeReader:
    """Seconds of the times in one table, which are all numbers, all dates, or all of the clock.

    unit: of numbers; None: of the first of them, seconds unless it counts from 1970 in another unit.
    """

    numbers: Numbers
    unit: str | None
    order: str | None
    kinds: set[str] = field(default_factory=set)
    days: int = 0
    last_s: float = -1.0

    def seconds(self, where: str, column: str, cell: str, nanoseconds: str = "", date: str = "") -> float:
        """The time in a cell, with its nanoseconds and its day where those are in cells of their own."""
        text = f"{date} {cell}".strip()
        moment = self._date(text)
        clock = CLOCK.fullmatch(text) if moment is None else None
        self.kinds.add("a date" if moment is not None else "a clock" if clock is not None else "a number")
        if len(self.kinds) > 1:
            raise RequestError(f"{where}: {column} is {cell[:40]!r}; times are all numbers or all dates.")
        if moment is not None:
            return (moment if moment.tzinfo else moment.replace(tzinfo=datetime.UTC)).timestamp()
        if clock is not None:
            return self._of_the_day(clock)
        number = self.numbers.number(where, column, cell)
        if self.unit is None:
            self.unit = epoch_unit_of(number) or "s"
        more_s = 0.0 if holds_nothing(nanoseconds) else 1e-9 * self.numbers.number(where, column, nanoseconds)
        return TIMES_S[self.unit] * number + more_s

    def _date(self, text: str) -> datetime.datetime | None:
        iso = text
        match = DATE.fullmatch(text)
        if match is not None:
            day, month = (match[1], match[3]) if self.order == "dmy" else (match[3], match[1])
            iso = f"{match[4]}-{month:0>2}-{day:0>2}" + (f"T{match[5].replace(',', '.')}" if match[5] else "")
        elif not (len(text) >= 10 and text[4:5] in "-W"):
            return None
        try:
            return datetime.datetime.fromisoformat(iso)
        except ValueError:
            return None

    def _of_the_day(self, clock: re.Match[str]) -> float:
        second = float((clock[3] or "0").replace(",", "."))
        of_day_s = 3600.0 * int(clock[1]) + 60.0 * int(clock[2]) + second
        if of_day_s < self.last_s - HALF_A_DAY_S:
            self.days += 1  # midnight
        self.last_s = of_day_s
        return 86400.0 * self.days + of_day_s
