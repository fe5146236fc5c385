"""Small text files, and the numbers in them, with a sentence for each that is not what it should be."""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

from gnss.errors import AlmanacFileError

__all__ = ["is_comment", "read_text", "real", "whole"]

COMMENT = re.compile(r"\s*(?:[#%;!]|//|\*+\s*$)")


def read_text(path: str | os.PathLike[str], what: str, most_bytes: int) -> str:
    """The text of a file, lines ending in any way. Raises AlmanacFileError; ``what`` names it there."""
    file = Path(path)
    if not file.is_file():
        raise AlmanacFileError(f"There is no {what} file {os.fspath(path)!r:.200}.")
    try:
        with file.open("rb") as stream:
            content = stream.read(most_bytes + 1)
    except OSError as error:
        raise AlmanacFileError(f"{file.name} cannot be opened: {error.strerror}.") from error
    if len(content) > most_bytes:
        raise AlmanacFileError(f"{file.name} is longer than {most_bytes} bytes, which no {what} is.")
    if content.startswith((b"\x1f\x8b", b"\x1f\x9d", b"PK")):
        raise AlmanacFileError(f"{file.name} is compressed; unpack it first.")
    if b"\0" in content:
        raise AlmanacFileError(f"{file.name} is not a text file, so no {what}.")
    return content.decode("latin-1")


def is_comment(line: str) -> bool:
    """Whether a line of an almanac is a remark that somebody added, or a rule."""
    return COMMENT.match(line) is not None


def real(text: str, where: str) -> float:
    """A finite number, its exponent marked with E or D. Raises AlmanacFileError."""
    try:
        number = math.nan if "_" in text else float(text.upper().replace("D", "E"))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise AlmanacFileError(f"{where} must be a number, not {text.strip()!r:.40}.")
    return number


def whole(text: str, where: str) -> int:
    """A whole number. Raises AlmanacFileError."""
    number = real(text, where)
    if number != int(number):
        raise AlmanacFileError(f"{where} must be a whole number, not {text.strip()!r:.40}.")
    return int(number)
