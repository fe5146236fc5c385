"""RINEX navigation files, versions 2 to 4: the broadcast ephemerides (LNAV) of the GPS satellites in them."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from gnss.almanac import gps_number
from gnss.broadcast_ephemeris import BroadcastEphemeris, Ephemerides
from gnss.errors import AlmanacFileError, GnssError
from gnss.gps_time import WEEK_S, GpsTime, full_week
from gnss.passed_over import PassedOver, system_of_number
from gnss.text_files import read_text, real, whole

__all__ = ["parse_rinex_navigation", "read_rinex_navigation"]

MOST_BYTES = 100_000_000
FIELD_WIDTH = 19
# how a record of version 3 begins, and the line before one of version 4
BEGINNING = re.compile(r"[GREJCIS][ \d]\d")
FRAME = re.compile(r"> (\w+) +([A-Z])[ \d]\d *(\w*)")
# of a file of version 2 (the letter where version 3 has N for all): what it holds besides GPS
OTHER_FILES = {"G": "GLONASS", "H": "geostationary satellites", "E": "Galileo", "O": "observations", "M": "weather"}
RECORD_LINES = 8
# the broadcast orbit lines (RINEX 3.05, table A6), left to right; "" is not needed here
ORBIT_FIELDS = (
    ("", "radius_sin_m", "mean_motion_difference_rad_per_s", "mean_anomaly_rad"),
    ("latitude_cos_rad", "eccentricity", "latitude_sin_rad", "sqrt_semi_major_axis_sqrt_m"),
    ("toe_s", "inclination_cos_rad", "node_longitude_rad", "inclination_sin_rad"),
    ("inclination_rad", "radius_cos_m", "argument_of_perigee_rad", "node_rate_rad_per_s"),
    ("inclination_rate_rad_per_s", "", "week"),
    ("", "health", "group_delay_s"),
)
CLOCK_FIELDS = ("clock_bias_s", "clock_drift_s_per_s", "clock_ageing_s_per_s2")


def read_rinex_navigation(path: str | os.PathLike[str]) -> Ephemerides:
    """Read a RINEX navigation file. Raises AlmanacFileError for one that is missing, truncated or of no use."""
    return parse_rinex_navigation(read_text(path, "RINEX navigation", MOST_BYTES), Path(path).name)


@dataclass(frozen=True, slots=True)
class _Record:
    """Lines of one record; where it begins, and whose it is: "GPS", or the words for who else's."""

    first: int
    whose: str
    lines: list[str]


def parse_rinex_navigation(text: str, source: str = "navigation file") -> Ephemerides:
    """The GPS ephemerides in a navigation file's text; what else there is is passed over and told in the warnings.

    A record ends where the next begins, however many lines its system has. Remarks and the headers of files that were
    joined may stand anywhere. Raises AlmanacFileError.
    """
    lines = text.splitlines()
    version = _version(lines, source)
    end = next((number for number, line in enumerate(lines) if line[60:].startswith("END OF HEADER")), None)
    if end is None:
        raise AlmanacFileError(f"{source} has no END OF HEADER: it is truncated.")
    passed = PassedOver()
    sets: list[BroadcastEphemeris] = []
    records = list(_records(lines, end + 1, version, source))
    for record in records:
        where = f"{source}: the record at line {record.first + 1}"
        if record.whose != "GPS":
            passed.foreign[record.whose] += 1
        elif len(record.lines) < RECORD_LINES and record is records[-1]:
            raise AlmanacFileError(f"{where} has {len(record.lines)} of {RECORD_LINES} lines: the file is truncated.")
        elif len(record.lines) <= len(ORBIT_FIELDS):
            passed.useless.append(f"{where} has {len(record.lines)} of {RECORD_LINES} lines. It was passed over.")
        else:
            found = _ephemeris(record.lines, version, where)
            if isinstance(found, BroadcastEphemeris):
                sets.append(found)
            else:
                passed.useless.append(f"{where} {found}. It was passed over.")
    if not sets:
        raise passed.nothing_left(f"{source} has no GPS ephemeris in it.")
    return Ephemerides(tuple(sets), source, passed.warnings())


def _version(lines: list[str], source: str) -> float:
    first = lines[0] if lines else ""
    if not first[60:].startswith("RINEX VERSION"):
        raise AlmanacFileError(f"{source} is no RINEX navigation file: its first line does not say so.")
    kind = first[20:21]
    if kind != "N":
        of = f"a RINEX file of {OTHER_FILES[kind]}" if kind in OTHER_FILES else "a RINEX file"
        raise AlmanacFileError(f"{source} is {of}, no RINEX navigation file of GPS.")
    version = real(first[:9], f"{source}: the RINEX version")
    if not 2.0 <= version < 5.0:
        raise AlmanacFileError(f"{source} is RINEX {version:g}; versions 2 to 4 are read.")
    return version


def _records(lines: list[str], first: int, version: float, source: str) -> Iterator[_Record]:
    """The records below the header, in the file's order."""
    record: _Record | None = None
    in_header = False
    for number in range(first, len(lines)):
        line = lines[number].rstrip()
        label = line[60:]
        in_header = in_header or label.startswith("RINEX VERSION")
        if in_header or label[:1].isalpha() or not line:
            # remarks, and headers of files that were joined to this one
            in_header = in_header and not label.startswith("END OF HEADER")
            continue
        whose = _whose(line, version)
        if whose is not None:
            if record is not None:
                yield record
            record = _Record(number, whose, [])
            if line.startswith(">"):
                continue
        elif record is None or not (line.startswith(" ") or record.whose != "GPS" or not record.lines):
            raise AlmanacFileError(f"{source}: line {number + 1} begins no record: {line.strip()!r:.40}.")
        record.lines.append(line)
    if record is not None:
        yield record


def _whose(line: str, version: float) -> str | None:
    """Whose record begins with a line: "GPS", or the words for another's; None where none does."""
    if version >= 4.0:
        # what follows depends on the kind of message, so the line before it tells
        frame = FRAME.match(line)
        if frame is None:
            return None
        kind, system, message = frame.groups()
        if kind == "EPH" and system == "G":
            return "GPS" if message == "LNAV" else f"GPS {message}"
        return f"system {system}" if kind == "EPH" else f"kind {kind}"
    if version >= 3.0:
        if BEGINNING.match(line) is None:
            return None
        return "GPS" if line[0] == "G" else f"system {line[0]}"
    if not line[:3].strip():
        return None
    number = line[:2].strip()
    return system_of_number(int(number)) if number.isdecimal() and not gps_number(int(number)) else "GPS"


def _ephemeris(record: list[str], version: float, where: str) -> BroadcastEphemeris | str:
    """The set of a GPS record, or why one that is marked healthy is of no use."""
    name, clock_time = (record[0][:2], record[0][2:22]) if version < 3.0 else (record[0][1:3], record[0][3:23])
    prn = whole(name, f"{where}: the satellite number")
    where = f"{where} (G{prn:02d})"
    margin = 3 if version < 3.0 else 4
    values = {
        field: line[margin + column * FIELD_WIDTH :][:FIELD_WIDTH]
        for names, line in zip(ORBIT_FIELDS, record[1:], strict=False)
        for column, field in enumerate(names)
        if field
    }
    for column, field in enumerate(CLOCK_FIELDS):
        values[field] = record[0][margin + (column + 1) * FIELD_WIDTH :][:FIELD_WIDTH]
    healthy = values["health"].strip() == "" or whole(values["health"], f"{where}: health") == 0
    for field, text in values.items():
        if not text.strip():
            if healthy or field == "week":
                raise AlmanacFileError(f"{where} lacks its {field}; a field is missing or the file is damaged.")
            values[field] = "0"  # the orbit of an unhealthy satellite is never used
    epoch = _epoch(clock_time, where)
    try:
        health = whole(values.pop("health"), f"{where}: health")
        week = full_week(whole(values.pop("week"), f"{where}: week"), epoch.date())
        said = GpsTime(week, real(values.pop("toe_s"), f"{where}: toe_s"))
        toe = _turned_over(said, GpsTime.of_utc(epoch, leap_seconds=0))
        numbers = {field: real(text, f"{where}: {field}") for field, text in values.items()}
        no_orbit = numbers["sqrt_semi_major_axis_sqrt_m"] == 0.0
        if no_orbit or toe is None:
            if health == 0:
                wrong = "has no orbit, only zeros" if no_orbit else f"of week {week}, far from its epoch"
                return f"is marked healthy but {wrong}"
            # its time is of no use either, but it is unhealthy from its epoch on
            toe = GpsTime.of_utc(epoch, leap_seconds=0)
        toc = GpsTime.of_utc(epoch, leap_seconds=0).plus(real(clock_time.split()[-1], f"{where}: the epoch"))
        return BroadcastEphemeris(prn=prn, toe=toe, health=health, toc=toc, **numbers)
    except AlmanacFileError:
        raise
    except GnssError as error:
        raise AlmanacFileError(f"{where}: {error}") from error


def _turned_over(toe: GpsTime, epoch: GpsTime) -> GpsTime | None:
    """The time of ephemeris in the week that puts it next to the record's epoch; None where that is no neighbour.

    Around the turn of a week some receivers write the week of the transmission, not that of the time of ephemeris.
    """
    weeks = round(((toe.week - epoch.week) * WEEK_S + toe.second_of_week - epoch.second_of_week) / WEEK_S)
    return GpsTime(toe.week - weeks, toe.second_of_week) if abs(weeks) <= 1 else None


def _epoch(clock_time: str, where: str) -> datetime:
    """A record's epoch, in GPS time; two-digit years from 80 on are of the last century."""
    words = clock_time.split()
    if len(words) != 6:
        raise AlmanacFileError(
            f"{where}: its epoch must be year, month, day, hour, minute, second, not {clock_time!r}."
        )
    year, month, day, hour, minute = (whole(word, f"{where}: the epoch") for word in words[:5])
    if year < 100:
        year += 1900 if year >= 80 else 2000
    try:
        return datetime(year, month, day, hour, minute, tzinfo=UTC)
    except (ValueError, OverflowError) as error:
        raise AlmanacFileError(f"{where}: its epoch {clock_time.strip()!r} is no date.") from error
