"""YUMA almanac files: one labelled value per line, angles in radians, the inclination absolute."""

from __future__ import annotations

import re
from datetime import date

from gnss.almanac import Almanac, AlmanacEntry, gps_number
from gnss.errors import AlmanacError, AlmanacFileError, GnssError
from gnss.gps_time import GpsTime, full_week
from gnss.passed_over import PassedOver, system_of_number
from gnss.text_files import is_comment, real, whole

__all__ = ["HEADING", "parse_yuma"]

# of each record; a letter before the number is the system's, as in RINEX
HEADING = re.compile(r"^\*+\s*Week.*?(?:PRN|SVN?|SAT)-?\s*([A-Z]?)(\d+)", re.IGNORECASE)
SYSTEM_LETTERS = {"": "GPS", "G": "GPS", "R": "GLONASS", "E": "Galileo", "C": "BeiDou", "J": "QZSS", "S": "SBAS"}
# the labels as far as all writers of these files agree, without blanks and case
LABELS = {
    "id": "ID",
    "health": "Health",
    "eccentricity": "Eccentricity",
    "timeofapplicability": "Time of Applicability",
    "orbitalinclination": "Orbital Inclination",
    "rateofrightascen": "Rate of Right Ascen",
    "sqrt(a)": "SQRT(A)",
    "rightascenatweek": "Right Ascen at Week",
    "argumentofperigee": "Argument of Perigee",
    "meananom": "Mean Anom",
    "af0": "Af0",
    "af1": "Af1",
    "week": "week",
}


def parse_yuma(text: str, source: str, reference: date | None = None) -> Almanac:
    """The almanac in a YUMA file's text; a file cut between two records cannot be told from a whole one.

    Records of other systems, short ones between others and those without an orbit are passed over and told in the
    warnings; lines that begin with # or the like are comments.
    source: its name in messages. reference: a date near its weeks, where those are counted modulo 1024.
    Raises AlmanacFileError for a truncated file, a missing field or a number out of range, AlmanacError for a week
    without reference.
    """
    passed, records = PassedOver(), _records(text, source)
    if not records:
        raise AlmanacFileError(f"{source} is no YUMA almanac: no record begins with ******** Week … PRN-….")
    entries: list[AlmanacEntry] = []
    for number, (system, where, values) in enumerate(records, 1):
        missing = [name for name in LABELS.values() if name not in values]
        if system != "GPS":
            passed.foreign[system] += 1
        elif missing:
            lacks = f"{where} lacks {', '.join(missing)}; a field is missing"
            if number == len(records):
                raise AlmanacFileError(f"{lacks} or the file is truncated.")
            passed.useless.append(f"{lacks}. It was passed over.")
        elif _has_no_orbit(where, values):
            passed.useless.append(f"{where} is marked healthy but has no orbit, only zeros. It was passed over.")
        else:
            entries.append(_entry(where, values, reference))
    if not entries:
        raise passed.nothing_left(f"{source} has no GPS satellite in it.")
    return Almanac(tuple(entries), source, passed.warnings())


def _records(text: str, source: str) -> list[tuple[str, str, dict[str, str]]]:
    """System, name in messages and values by label of each record; of other systems no values."""
    records: list[tuple[str, str, dict[str, str]]] = []
    for line in text.splitlines():
        heading = HEADING.match(line.strip())
        if heading:
            number = int(heading[2][:9])
            letter = heading[1].upper()
            system = SYSTEM_LETTERS.get(letter, f"system {letter}")
            if system == "GPS" and not gps_number(number):
                system = system_of_number(number)
            records.append((system, f"{source}: the record of PRN {letter}{number}", {}))
        elif line.strip() and not is_comment(line) and (not records or records[-1][0] == "GPS"):
            _take(line, source, [(where, values) for _, where, values in records[-1:]])
    return records


def _has_no_orbit(where: str, values: dict[str, str]) -> bool:
    """Whether a record that is marked healthy is empty all the same."""
    healthy = whole(values["Health"], f"{where}: Health") == 0
    return healthy and real(values["SQRT(A)"], f"{where}: SQRT(A)") == 0.0


def _take(line: str, source: str, records: list[tuple[str, dict[str, str]]]) -> None:
    label, colon, value = line.partition(":")
    shortened = "".join(label.lower().split())
    name = next((name for start, name in LABELS.items() if shortened.startswith(start)), None)
    if not records or not colon or name is None:
        raise AlmanacFileError(f"{source} has a line that no YUMA almanac has: {line.strip()!r:.60}.")
    where, values = records[-1]
    if name in values:
        raise AlmanacFileError(f"{where} tells {name} twice.")
    values[name] = value


def _entry(where: str, values: dict[str, str], reference: date | None) -> AlmanacEntry:
    def number(name: str) -> float:
        return real(values[name], f"{where}: {name}")

    week = whole(values["week"], f"{where}: week")
    try:
        applicable = GpsTime(full_week(week, reference), number("Time of Applicability"))
    except AlmanacFileError:
        raise
    except GnssError as error:
        raise AlmanacError(f"{where}: {error}") from error
    try:
        return AlmanacEntry(
            prn=whole(values["ID"].strip().upper().removeprefix("G"), f"{where}: ID"),
            applicable=applicable,
            eccentricity=number("Eccentricity"),
            inclination_rad=number("Orbital Inclination"),
            node_rate_rad_per_s=number("Rate of Right Ascen"),
            sqrt_semi_major_axis_sqrt_m=number("SQRT(A)"),
            node_longitude_rad=number("Right Ascen at Week"),
            argument_of_perigee_rad=number("Argument of Perigee"),
            mean_anomaly_rad=number("Mean Anom"),
            clock_bias_s=number("Af0"),
            clock_drift_s_per_s=number("Af1"),
            health=whole(values["Health"], f"{where}: Health"),
        )
    except AlmanacFileError:
        raise
    except AlmanacError as error:
        raise AlmanacFileError(f"{where}: {error}") from error
