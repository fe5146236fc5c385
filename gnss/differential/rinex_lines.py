"""Whether the lines of a RINEX file are all there: readers take one that was cut short for a shorter one."""

from __future__ import annotations

from gnss.errors import AlmanacFileError
from gnss.text_files import real, whole

__all__ = ["check_lines", "check_navigation_lines"]

SATELLITES_A_LINE = 12
OBSERVATIONS_A_LINE = 5  # of version 2
EVENTS = range(2, 6)  # flags of an epoch whose lines are remarks
ORBIT_LINES = {"R": 4, "S": 4}  # of a navigation record, its first line included; 8 of other systems


def check_lines(lines: list[str], source: str) -> int:
    """How many epochs with observations there are. Raises AlmanacFileError for a file that is no whole one."""
    version = _version(lines, source)
    end = next((number for number, line in enumerate(lines) if line[60:].startswith("END OF HEADER")), None)
    if end is None:
        raise AlmanacFileError(f"{source} has no END OF HEADER: it is truncated.")
    kinds = next((line for line in lines[:end] if line[60:].startswith("# / TYPES OF OBSERV")), None)
    if version < 3.0 and kinds is None:
        raise AlmanacFileError(f"{source} does not say which observations it holds (# / TYPES OF OBSERV).")
    lines_each = 1
    if kinds is not None:
        lines_each = -(-_count(kinds[:6], f"{source}: the number of kinds of observations") // OBSERVATIONS_A_LINE)
    number, epochs = end + 1, 0
    while number < len(lines):
        if not lines[number].strip():
            number += 1
            continue
        where = f"{source}: the epoch at line {number + 1}"
        flag, count = _epoch(lines[number], version, where)
        if flag in EVENTS:
            number += 1 + count
            continue
        needed = 1 + count if version >= 3.0 else max(1, -(-count // SATELLITES_A_LINE)) + count * lines_each
        if number + needed > len(lines):
            raise AlmanacFileError(
                f"{where} needs {needed} lines and the file has {len(lines) - number} more: it is truncated."
            )
        number += needed
        epochs += count > 0 and flag <= 1
    if epochs == 0:
        raise AlmanacFileError(f"{source} has no epoch with observations.")
    return epochs


def check_navigation_lines(lines: list[str], source: str) -> None:
    """Whether a navigation file has its header and its last record whole. Raises AlmanacFileError."""
    first = lines[0] if lines else ""
    kind = first[20:21]
    if not first[60:].startswith("RINEX VERSION") or kind not in ("N", "G", "H", "E"):
        raise AlmanacFileError(f"{source} is no RINEX navigation file: its first line does not say so.")
    if not any(line[60:].startswith("END OF HEADER") for line in lines):
        raise AlmanacFileError(f"{source} has no END OF HEADER: it is truncated.")
    records = [line for line in lines if line.strip() and not line[60:61].isalpha()]
    begins = [number for number, line in enumerate(records) if line[:1].isalpha() or line[:2].strip().isdecimal()]
    if not begins:
        raise AlmanacFileError(f"{source} has no ephemeris in it.")
    system = records[begins[-1]][0] if records[begins[-1]][0].isalpha() else {"G": "R", "H": "S"}.get(kind, "G")
    found, needed = len(records) - begins[-1], ORBIT_LINES.get(system, 8)
    if found < needed:
        raise AlmanacFileError(f"{source}: its last record has {found} of {needed} lines: the file is truncated.")


def _version(lines: list[str], source: str) -> float:
    first = lines[0] if lines else ""
    if first[60:].startswith("CRINEX"):
        raise AlmanacFileError(f"{source} is in compact RINEX (Hatanaka); unpack it with CRX2RNX first.")
    if not first[60:].startswith("RINEX VERSION"):
        raise AlmanacFileError(f"{source} is no RINEX observation file: its first line does not say so.")
    if first[20:21] != "O":
        raise AlmanacFileError(f"{source} is a RINEX file of another kind ({first[20:40].strip() or '?'}).")
    version = real(first[:9], f"{source}: the RINEX version")
    if not 2.0 <= version < 4.0:
        raise AlmanacFileError(f"{source} is RINEX {version:g}; observations of versions 2 and 3 are read.")
    return version


def _epoch(line: str, version: float, where: str) -> tuple[int, int]:
    """The flag and the number of satellites, or of lines to pass over, of an epoch's first line."""
    if version >= 3.0:
        if not line.startswith(">"):
            raise AlmanacFileError(f"{where} does not begin with >: the file is damaged.")
        return whole(line[31:32] or "0", f"{where}: the flag"), _count(line[32:35], f"{where}: how many satellites")
    if line[:1].strip() or line[28:29].strip() == "":
        raise AlmanacFileError(f"{where} is none: the file is damaged.")
    return whole(line[28:29], f"{where}: the flag"), _count(line[29:32], f"{where}: how many satellites")


def _count(text: str, where: str) -> int:
    """Raises AlmanacFileError: one below zero would lead back to lines that were read."""
    count = whole(text, where)
    if count < 0:
        raise AlmanacFileError(f"{where} must not be below zero, as {text.strip()!r:.40} is.")
    return count
