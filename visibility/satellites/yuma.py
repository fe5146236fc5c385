"""YUMA almanac files: one labelled value per line, angles in radians, the inclination absolute."""

from __future__ import annotations

import re
from datetime import date

from ..errors import AlmanacError, AlmanacFileError, VisibilityError
from .almanac import Almanac, AlmanacEntry
from .gps_time import GpsTime, full_week
from .text_files import real, whole

__all__ = ["HEADING", "parse_yuma"]

HEADING = re.compile(r"^\*+\s*Week.*?PRN-?\s*(\d+)", re.IGNORECASE)
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

    source: its name in messages. reference: a date near its weeks, where those are counted modulo 1024.
    Raises AlmanacFileError for a truncated file, a missing field or a number out of range, AlmanacError for a week
    without reference.
    """
    records: list[tuple[str, dict[str, str]]] = []
    for line in text.splitlines():
        heading = HEADING.match(line.strip())
        if heading:
            records.append((f"{source}: the record of PRN {heading[1][:9].lstrip('0')}", {}))
        elif line.strip():
            _take(line, source, records)
    if not records:
        raise AlmanacFileError(f"{source} is no YUMA almanac: no record begins with ******** Week … PRN-….")
    return Almanac(tuple(_entry(where, values, reference) for where, values in records), source)


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
    missing = [name for name in LABELS.values() if name not in values]
    if missing:
        raise AlmanacFileError(f"{where} lacks {', '.join(missing)}; a field is missing or the file is truncated.")

    def number(name: str) -> float:
        return real(values[name], f"{where}: {name}")

    week = whole(values["week"], f"{where}: week")
    try:
        applicable = GpsTime(full_week(week, reference), number("Time of Applicability"))
    except AlmanacFileError:
        raise
    except VisibilityError as error:
        raise AlmanacError(f"{where}: {error}") from error
    try:
        return AlmanacEntry(
            prn=whole(values["ID"], f"{where}: ID"),
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
