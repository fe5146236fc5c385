"""read_almanac: an almanac from a SEM or a YUMA file, told apart by their first lines."""

from __future__ import annotations

import os
from datetime import date
from pathlib import Path

from gnss.almanac import Almanac
from gnss.errors import AlmanacFileError
from gnss.sem import parse_sem
from gnss.text_files import is_comment, read_text
from gnss.yuma import HEADING, parse_yuma

__all__ = ["parse_almanac", "read_almanac"]

# 63 satellites take 40 kB in YUMA
MOST_BYTES = 1_000_000


def read_almanac(path: str | os.PathLike[str], reference: date | None = None) -> Almanac:
    """Read a SEM or YUMA almanac file.

    reference: a date near the almanac's, at most 9.8 years off; needed where the file counts weeks modulo 1024, as
        nearly all do. A datetime is a date too.
    Raises AlmanacFileError for a file that is missing, truncated or no almanac, AlmanacError for a week without
    reference.
    """
    return parse_almanac(read_text(path, "almanac", MOST_BYTES), Path(path).name, reference)


def parse_almanac(text: str, source: str = "almanac", reference: date | None = None) -> Almanac:
    """The almanac in a SEM or YUMA file's text; otherwise as ``read_almanac``."""
    filled = [line.strip() for line in text.splitlines() if line.strip()]
    if not filled:
        raise AlmanacFileError(f"{source} is empty.")
    first = next((line for line in filled if not is_comment(line)), filled[0])
    if HEADING.match(first):
        return parse_yuma(text, source, reference)
    if first.split()[0].isdecimal():
        return parse_sem(text, source, reference)
    raise AlmanacFileError(f"{source} is neither a SEM nor a YUMA almanac; it begins with {first!r:.60}.")
