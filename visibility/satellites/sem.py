"""SEM almanac files: eight lines per satellite, angles in semicircles (De Vivo et al., table I)."""

from __future__ import annotations

import math
from datetime import date

from ..errors import AlmanacError, AlmanacFileError, VisibilityError
from .almanac import REFERENCE_INCLINATION_RAD, Almanac, AlmanacEntry
from .gps_time import GpsTime, full_week
from .text_files import real, whole

__all__ = ["parse_sem"]

LINES = (
    ("PRN number",),
    ("SVN",),
    ("URA number",),
    ("eccentricity", "inclination offset", "rate of right ascension"),
    ("square root of semi-major axis", "longitude of orbital plane", "argument of perigee"),
    ("mean anomaly", "clock correction", "clock drift"),
    ("health",),
    ("configuration",),
)


def parse_sem(text: str, source: str, reference: date | None = None) -> Almanac:
    """The almanac in a SEM file's text.

    source: its name in messages. reference: a date near its week, where that is counted modulo 1024.
    Raises AlmanacFileError for a truncated file, a missing field or a number out of range, AlmanacError for a week
    without reference.
    """
    lines = [line.split() for line in text.splitlines() if line.strip()]
    if not lines or not lines[0][0].isdecimal():
        raise AlmanacFileError(f"{source} is no SEM almanac: its first line must begin with the number of satellites.")
    declared = whole(lines[0][0], f"{source}: the number of satellites")
    if len(lines) < 2 or len(lines[1]) != 2:
        raise AlmanacFileError(f"{source}: the second line must hold the week and the time of applicability.")
    week = whole(lines[1][0], f"{source}: the week")
    second = real(lines[1][1], f"{source}: the time of applicability")
    try:
        applicable = GpsTime(full_week(week, reference), second)
    except VisibilityError as error:
        raise AlmanacError(f"{source}: {error}") from error

    records = lines[2:]
    entries = [
        _entry(records[first : first + len(LINES)], f"{source}: record {first // len(LINES) + 1}", applicable)
        for first in range(0, len(records), len(LINES))
    ]
    if len(entries) != declared:
        raise AlmanacFileError(
            f"{source} declares {declared} satellites but holds {len(entries)}; it is truncated or damaged."
        )
    return Almanac(tuple(entries), source)


def _entry(lines: list[list[str]], where: str, applicable: GpsTime) -> AlmanacEntry:
    values: dict[str, str] = {}
    for names, words in zip(LINES, lines, strict=False):
        if len(words) != len(names):
            raise AlmanacFileError(
                f"{_named(where, values)} holds {len(words)} numbers in place of {len(names)} ({', '.join(names)}); "
                "a field is missing or the file is truncated."
            )
        values.update(zip(names, words, strict=True))
    if len(lines) < len(LINES):
        raise AlmanacFileError(
            f"{_named(where, values)} ends before its {LINES[len(lines)][0]}: the file is truncated."
        )
    where = _named(where, values)

    def semicircles_in_rad(name: str) -> float:
        return real(values[name], f"{where}: the {name}") * math.pi

    try:
        return AlmanacEntry(
            prn=whole(values["PRN number"], f"{where}: the PRN number"),
            applicable=applicable,
            eccentricity=real(values["eccentricity"], f"{where}: the eccentricity"),
            inclination_rad=REFERENCE_INCLINATION_RAD + semicircles_in_rad("inclination offset"),
            node_rate_rad_per_s=semicircles_in_rad("rate of right ascension"),
            sqrt_semi_major_axis_sqrt_m=real(
                values["square root of semi-major axis"], f"{where}: the square root of semi-major axis"
            ),
            node_longitude_rad=semicircles_in_rad("longitude of orbital plane"),
            argument_of_perigee_rad=semicircles_in_rad("argument of perigee"),
            mean_anomaly_rad=semicircles_in_rad("mean anomaly"),
            clock_bias_s=real(values["clock correction"], f"{where}: the clock correction"),
            clock_drift_s_per_s=real(values["clock drift"], f"{where}: the clock drift"),
            health=whole(values["health"], f"{where}: the health"),
            svn=whole(values["SVN"], f"{where}: the SVN"),
            ura=whole(values["URA number"], f"{where}: the URA number"),
            configuration=whole(values["configuration"], f"{where}: the configuration"),
        )
    except AlmanacFileError:
        raise
    except AlmanacError as error:
        raise AlmanacFileError(f"{where}: {error}") from error


def _named(where: str, values: dict[str, str]) -> str:
    return f"{where} (PRN {values['PRN number']})" if "PRN number" in values else where
