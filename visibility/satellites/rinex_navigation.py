"""RINEX navigation files, versions 2 and 3: the broadcast ephemerides of the GPS satellites in them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from datetime import date
from pathlib import Path

from ..errors import AlmanacFileError, VisibilityError
from .broadcast_ephemeris import BroadcastEphemeris, Ephemerides
from .gps_time import GpsTime, full_week
from .text_files import read_text, real, whole

__all__ = ["parse_rinex_navigation", "read_rinex_navigation"]

MOST_BYTES = 100_000_000
FIELD_WIDTH = 19
# how many lines a record of another system takes
LINES_PER_RECORD = {"G": 8, "E": 8, "C": 8, "J": 8, "I": 8, "R": 4, "S": 4}
# the broadcast orbit lines (RINEX 3.05, table A6), left to right; "" is not needed here
ORBIT_FIELDS = (
    ("", "radius_sin_m", "mean_motion_difference_rad_per_s", "mean_anomaly_rad"),
    ("latitude_cos_rad", "eccentricity", "latitude_sin_rad", "sqrt_semi_major_axis_sqrt_m"),
    ("toe_s", "inclination_cos_rad", "node_longitude_rad", "inclination_sin_rad"),
    ("inclination_rad", "radius_cos_m", "argument_of_perigee_rad", "node_rate_rad_per_s"),
    ("inclination_rate_rad_per_s", "", "week"),
    ("", "health"),
)


def read_rinex_navigation(path: str | os.PathLike[str]) -> Ephemerides:
    """Read a RINEX navigation file. Raises AlmanacFileError for one that is missing, truncated or of no use."""
    return parse_rinex_navigation(read_text(path, "RINEX navigation", MOST_BYTES), Path(path).name)


def parse_rinex_navigation(text: str, source: str = "navigation file") -> Ephemerides:
    """The GPS ephemerides in a navigation file's text; other systems are passed over and counted in the warnings.

    Raises AlmanacFileError.
    """
    lines = text.splitlines()
    version = _version(lines, source)
    end = next((number for number, line in enumerate(lines) if line[60:].startswith("END OF HEADER")), None)
    if end is None:
        raise AlmanacFileError(f"{source} has no END OF HEADER: it is truncated.")
    sets: list[BroadcastEphemeris] = []
    others: Counter[str] = Counter()
    for first, record in _records(lines, end + 1, version, source):
        system = "G" if version < 3.0 else record[0][0]
        if system == "G":
            sets.append(_ephemeris(record, version, f"{source}: the record at line {first + 1}"))
        else:
            others[system] += 1
    if not sets:
        raise AlmanacFileError(f"{source} has no GPS ephemeris in it.")
    warnings = (f"{n} records of system {system} were passed over; only GPS is read." for system, n in others.items())
    return Ephemerides(tuple(sets), source, tuple(warnings))


def _version(lines: list[str], source: str) -> float:
    first = lines[0] if lines else ""
    if not first[60:].startswith("RINEX VERSION") or first[20:21] != "N":
        raise AlmanacFileError(f"{source} is no RINEX navigation file: its first line does not say so.")
    version = real(first[:9], f"{source}: the RINEX version")
    if not 2.0 <= version < 4.0:
        raise AlmanacFileError(f"{source} is RINEX {version:g}; versions 2 and 3 are read.")
    return version


def _records(lines: list[str], first: int, version: float, source: str) -> Iterator[tuple[int, list[str]]]:
    """Index of its first line and the lines of each record."""
    while first < len(lines):
        if not lines[first].strip():
            first += 1
            continue
        system = "G" if version < 3.0 else lines[first][0]
        length = LINES_PER_RECORD.get(system)
        if length is None:
            raise AlmanacFileError(f"{source}: line {first + 1} begins no record: {lines[first].strip()!r:.40}.")
        record = lines[first : first + length]
        if len(record) < length:
            raise AlmanacFileError(
                f"{source}: the record at line {first + 1} has {len(record)} of {length} lines: the file is truncated."
            )
        yield first, record
        first += length


def _ephemeris(record: list[str], version: float, where: str) -> BroadcastEphemeris:
    name, clock_time = (record[0][:2], record[0][2:22]) if version < 3.0 else (record[0][1:3], record[0][3:23])
    prn = whole(name, f"{where}: the satellite number")
    where = f"{where} (G{prn:02d})"
    margin = 3 if version < 3.0 else 4
    values: dict[str, str] = {}
    for names, line in zip(ORBIT_FIELDS, record[1:], strict=False):
        for column, field in enumerate(names):
            start = margin + column * FIELD_WIDTH
            if field:
                values[field] = line[start : start + FIELD_WIDTH]
                if not values[field].strip():
                    raise AlmanacFileError(f"{where} lacks its {field}; a field is missing or the file is damaged.")
    try:
        toe = GpsTime(
            full_week(whole(values.pop("week"), f"{where}: week"), _day(clock_time, where)),
            real(values.pop("toe_s"), f"{where}: toe_s"),
        )
        health = whole(values.pop("health"), f"{where}: health")
        numbers = {field: real(text, f"{where}: {field}") for field, text in values.items()}
        return BroadcastEphemeris(prn=prn, toe=toe, health=health, **numbers)
    except AlmanacFileError:
        raise
    except VisibilityError as error:
        raise AlmanacFileError(f"{where}: {error}") from error


def _day(clock_time: str, where: str) -> date:
    """The day of a record's epoch; two-digit years from 80 on are of the last century."""
    words = clock_time.split()
    if len(words) != 6:
        raise AlmanacFileError(
            f"{where}: its epoch must be year, month, day, hour, minute, second, not {clock_time!r}."
        )
    year, month, day = (whole(word, f"{where}: the epoch") for word in words[:3])
    if year < 100:
        year += 1900 if year >= 80 else 2000
    try:
        return date(year, month, day)
    except (ValueError, OverflowError) as error:
        raise AlmanacFileError(f"{where}: its epoch {clock_time.strip()!r} is no date.") from error
