"""SEM almanac files: eight lines per satellite, angles in semicircles (De Vivo et al., table I)."""

from __future__ import annotations

import math
from datetime import date

from gnss.almanac import REFERENCE_INCLINATION_RAD, Almanac, AlmanacEntry, gps_number
from gnss.errors import AlmanacError, AlmanacFileError, GnssError
from gnss.gps_time import GpsTime, full_week
from gnss.passed_over import PassedOver, system_of_number
from gnss.text_files import is_comment, real, whole

__all__ = ["parse_sem"]

Record = list[list[str]]

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

    Records of other systems, short ones between others and those without an orbit are passed over and told in the
    warnings; lines that begin with # or the like are comments.
    source: its name in messages. reference: a date near its week, where that is counted modulo 1024.
    Raises AlmanacFileError for a truncated file, a missing field or a number out of range, AlmanacError for a week
    without reference.
    """
    lines = [line.split() for line in text.splitlines() if not is_comment(line)]
    head = [words for words in lines if words][:2]
    if not head or not head[0][0].isdecimal():
        raise AlmanacFileError(f"{source} is no SEM almanac: its first line must begin with the number of satellites.")
    declared = whole(head[0][0], f"{source}: the number of satellites")
    if len(head) < 2 or len(head[1]) != 2:
        raise AlmanacFileError(f"{source}: the second line must hold the week and the time of applicability.")
    week = whole(head[1][0], f"{source}: the week")
    second = real(head[1][1], f"{source}: the time of applicability")
    try:
        applicable = GpsTime(full_week(week, reference), second)
    except GnssError as error:
        raise AlmanacError(f"{source}: {error}") from error

    records = _records(lines, declared)
    if len(records) != declared:
        raise AlmanacFileError(
            f"{source} declares {declared} satellites but holds {len(records)}; it is truncated or damaged."
        )
    passed = PassedOver()
    entries: list[AlmanacEntry] = []
    for number, record in enumerate(records, 1):
        where, prn = f"{source}: record {number}", record[0][0]
        if prn.isdecimal() and not gps_number(int(prn[:9])):
            passed.foreign[system_of_number(int(prn[:9]))] += 1
        elif len(record) < len(LINES) and number < len(records):
            passed.useless.append(
                f"{where} (PRN {prn}) has {len(record)} lines in place of {len(LINES)}. It was passed over."
            )
        elif _has_no_orbit(record, where):
            passed.useless.append(
                f"{where} (PRN {prn}) is marked healthy but has no orbit, only zeros. It was passed over."
            )
        else:
            entries.append(_entry(record, where, applicable))
    if not entries:
        raise passed.nothing_left(f"{source} has no GPS satellite in it.")
    return Almanac(tuple(entries), source, passed.warnings())


def _records(lines: list[list[str]], declared: int) -> list[Record]:
    """The lines of each record: as many as there must be where that fits, or else what stands between blank lines."""
    filled = [number for number, words in enumerate(lines) if words]
    rest = lines[filled[1] + 1 :]
    solid = [words for words in rest if words]
    if len(solid) == declared * len(LINES):
        return [solid[first : first + len(LINES)] for first in range(0, len(solid), len(LINES))]
    records: list[Record] = [[]]
    for words in rest:
        if words:
            records[-1].append(words)
        elif records[-1]:
            records.append([])
    return [record for record in records if record]


def _has_no_orbit(record: Record, where: str) -> bool:
    """Whether a whole record that is marked healthy is empty all the same."""
    if [len(words) for words in record[: len(LINES)]] != [len(names) for names in LINES]:
        return False
    return whole(record[6][0], f"{where}: the health") == 0 and real(record[4][0], f"{where}: {LINES[4][0]}") == 0.0


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
