"""Tables in text files as spreadsheets and loggers write them: separated by commas, semicolons or tabs."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from service.errors import RequestError
from service.files.tables import text_of

__all__ = ["Table", "read_table"]

SEPARATORS = ",;\t"
# columns whose cells are words
WORDS = {"id", "body"}
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")


@dataclass(frozen=True, slots=True)
class Table:
    """A header, and rows as (line number, cells by column); empty cells are left out.

    called: what error sentences call the file. separator: , ; or a tab. comma: the decimal mark is one.
    """

    called: str
    header: tuple[str, ...]
    rows: tuple[tuple[int, dict[str, str]], ...]
    separator: str
    comma: bool

    def numbers(self, line: int, cells: dict[str, str]) -> dict[str, float]:
        """A row whose cells are all numbers. Raises RequestError."""
        found = {}
        for column, cell in cells.items():
            try:
                found[column] = self.number(line, column, cell)
            except RequestError as error:
                raise RequestError(
                    f"{self.called}, line {line}: its cells must be numbers, one for each column; {column} is "
                    f"{cell[:40]!r}."
                ) from error
        return found

    def number(self, line: int, column: str, cell: str) -> float:
        """The number in a cell. Raises RequestError."""
        text = cell.replace(",", ".") if self.comma and DECIMAL_COMMA.fullmatch(cell) else cell
        try:
            return float(text)
        except ValueError as error:
            raise RequestError(f"{self.called}, line {line}: {column} is {cell[:40]!r}, not a number.") from error


def read_table(path: Path, what: str) -> Table:
    """The table in a file; what: as in "The anchors file". Raises RequestError.

    Lines that begin with # before the header are comments. A decimal comma is one where commas do not separate, or
    where the cell is quoted and cannot be a number with thousands; a file has one decimal mark.
    """
    text = _text_of(path, what)
    called = f"{what} {path.name}"
    lines = text.splitlines(keepends=True)
    skipped = next((n for n, line in enumerate(lines) if line.strip() and not line.startswith("#")), len(lines))
    first = lines[skipped] if skipped < len(lines) else ""
    separator = max(SEPARATORS, key=re.sub(r'"[^"]*"', "", first).count)
    reader = csv.reader(io.StringIO("".join(lines[skipped:])), delimiter=separator, skipinitialspace=True, strict=True)
    try:
        header = [column.strip() for column in next(reader, [])]
        while header and not header[-1]:
            header.pop()
        twice = [column for column in header if header.count(column) > 1]
        if twice:
            raise RequestError(f"{called} has the column {twice[0]!r} twice.")
        rows = tuple(_rows(path.name, reader, header, skipped))
    except csv.Error as error:
        raise RequestError(f"{called} is not CSV: {error}.") from error
    return Table(path.name, tuple(header), rows, separator, _has_decimal_commas(path.name, rows, separator))


def _text_of(path: Path, what: str) -> str:
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"{what} {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"{what} {str(path)!r} cannot be read: {error.strerror}.") from error


def _rows(name: str, reader: Any, header: list[str], skipped: int) -> Iterator[tuple[int, dict[str, str]]]:
    for cells in reader:
        number = skipped + reader.line_num
        stripped = [cell.strip() for cell in cells]
        if any(stripped[len(header) :]):
            raise RequestError(f"{name}, line {number}: more cells than columns.")
        if any(stripped):
            yield number, {column: text_of(cell) for column, cell in zip(header, stripped, strict=False) if cell}


def _has_decimal_commas(name: str, rows: tuple[tuple[int, dict[str, str]], ...], separator: str) -> bool:
    commas = points = None
    for line, cells in rows:
        for column, cell in cells.items():
            if column in WORDS:
                continue
            if DECIMAL_COMMA.fullmatch(cell) and (separator != "," or not THOUSANDS.fullmatch(cell)):
                commas = commas or (line, column, cell)
            elif re.fullmatch(r"[-+]?\d*\.\d*(?:[eE][-+]?\d+)?", cell):
                points = points or (line, column, cell)
    if commas is None or points is None:
        return commas is not None
    raise RequestError(
        f"{name} has decimal commas (line {commas[0]}, {commas[1]} {commas[2]!r}) and decimal points "
        f"(line {points[0]}, {points[1]} {points[2]!r}); which of them groups thousands is not clear."
    )
