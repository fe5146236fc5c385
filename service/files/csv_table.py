"""CSV: as other programs write it, read and what was passed over told; written so that spreadsheets run nothing.

Byte-order marks, UTF-16, commas, semicolons or tabs, decimal commas, comment lines, a separator at the end of each
line, cells that say NULL.
"""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from service.errors import RequestError

from .written import written_number

__all__ = [
    "CsvTable",
    "Numbers",
    "TableWriter",
    "cell_of",
    "check_columns",
    "holds_nothing",
    "read_csv_table",
    "text_of",
    "text_of_cell",
]

# What spreadsheets take for the beginning of a formula, full-width forms included. A quote before it makes it text,
# and one quote more tells a text that has both by itself.
FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")
DELIMITERS = ",;\t"
COMMENT = "#"
# What databases, spreadsheets and programs write into a cell that holds nothing.
NOTHING = frozenset({"null", "none", "na", "n/a", "#n/a", "nil", "\\n", "-"})
DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?|[+-]?\d+,")
DECIMAL_POINT = re.compile(r"[+-]?\d*\.\d*([eE][+-]?\d+)?")
THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+")
QUOTED = re.compile(r'"[^"]*"')
# as Excel announces its separator
SEPARATOR = re.compile(r'"?sep=(.)"?', re.IGNORECASE)


def cell_of(value: Any) -> Any:
    """The value as a cell: a text that a spreadsheet would calculate gets a quote before it, numbers stay."""
    if not isinstance(value, str) or not FORMULA.match(value) or _is_number(value):
        return value
    return f"'{value}"


def text_of_cell(cell: str) -> str:
    """The text that ``cell_of`` made the cell from."""
    return cell[1:] if cell.startswith("'") and FORMULA.match(cell) else cell


class TableWriter:
    """Writes rows of safe cells. end: of each line."""

    def __init__(self, file: IO[str], end: str = "\n") -> None:
        self._writer = csv.writer(file, lineterminator=end)

    def row(self, cells: Iterable[Any]) -> None:
        """One row."""
        self._writer.writerow([cell_of(cell) for cell in cells])

    def rows(self, names: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
        """A row of names, then of each mapping what the names name, empty where it has nothing."""
        self.row(names)
        for row in rows:
            self.row(row.get(name, "") for name in names)


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A table: its columns, its separator, and its lines as (where one stands, its cells by column).

    Lines are read as they are taken, once. A column that a line does not reach to is "" in it.
    """

    name: str
    columns: tuple[str, ...]
    delimiter: str
    lines: Iterator[tuple[str, dict[str, str]]]


@dataclass(slots=True)
class Numbers:
    """Reads the numbers of one table; points or commas mark decimals, but not both in one table.

    A comma does so where commas do not separate, or in a quoted cell that cannot be a number with thousands.
    """

    delimiter: str
    marks: dict[str, tuple[str, str, str]] = field(default_factory=dict)

    def number(self, where: str, column: str, cell: str) -> float:
        """The number in a cell. Raises RequestError."""
        text = cell
        if DECIMAL_COMMA.fullmatch(cell) and not (self.delimiter == "," and THOUSANDS.fullmatch(cell)):
            self.marks.setdefault(",", (where, column, cell))
            text = cell.replace(",", ".")
        elif DECIMAL_POINT.fullmatch(cell):
            self.marks.setdefault(".", (where, column, cell))
        if len(self.marks) > 1:
            (_, first, comma), (_, second, point) = self.marks[","], self.marks["."]
            raise RequestError(
                f"{where}: {column} is {cell[:40]!r}; other numbers there mark decimals otherwise, and of decimal "
                f"commas ({first} {comma[:40]!r}) and decimal points ({second} {point[:40]!r}) it is not clear "
                "which group thousands."
            )
        try:
            return written_number(text)
        except ValueError as error:
            raise RequestError(f"{where}: {column} is {cell[:40]!r}, not a number.") from error

    def row(self, where: str, cells: Mapping[str, str]) -> dict[str, float]:
        """A row whose cells are all numbers; empty ones are left out. Raises RequestError."""
        found = {}
        for column, cell in cells.items():
            if not cell:
                continue
            try:
                found[column] = self.number(where, column, cell)
            except RequestError as error:
                if isinstance(error.__cause__, ValueError):
                    raise RequestError(
                        f"{where}: its cells must be numbers, one for each column; {column} is {cell[:40]!r}."
                    ) from error
                raise
        return found


def text_of(path: Path, what: str) -> str:
    """The text of a file in UTF-8 or, with a byte-order mark, UTF-16; line ends as they are. Raises RequestError.

    what: how a sentence names it, as in "log".
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RequestError(f"The {what} {str(path)!r} cannot be read: {error.strerror}.") from error
    utf_16 = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    try:
        return data.decode("utf-16" if utf_16 else "utf-8-sig")
    except UnicodeDecodeError as error:
        kind = "UTF-16" if utf_16 else "UTF-8"
        raise RequestError(f"The {what} {path.name} is not {kind} text.") from error


def holds_nothing(cell: str) -> bool:
    """Whether a cell is empty, or says NULL in any of its spellings."""
    return not cell or cell.casefold() in NOTHING


def read_csv_table(path: Path, what: str, *, comments_within: bool = True, nameless: bool = False) -> CsvTable:
    """A table whose first line, after comments, names its columns. Raises RequestError, also while lines are taken.

    comments_within: lines that begin with # are comments below that line too, and no cells. nameless: where that line
    holds numbers, columns are called 1, 2, 3 …
    """
    name = path.name
    numbered = _without_comments(text_of(path, what), comments_within)
    comment, number, first = next(numbered, ("", 0, ""))
    announced = SEPARATOR.fullmatch(first.strip())
    if announced is not None:
        comment, number, first = next(numbered, ("", number, ""))
    delimiter = announced[1] if announced is not None else max(DELIMITERS, key=QUOTED.sub("", first).count)
    if delimiter not in DELIMITERS:
        raise RequestError(f"The {what} {name} is separated by {delimiter!r}; take commas, semicolons or tabs.")
    lines = numbered
    try:
        header = _header(first, delimiter)
        if header and _is_number(header[0]) and len(_header(comment, delimiter)) == len(header):
            # as numpy writes it, the names are in a comment and the first line holds numbers
            header, lines = _header(comment, delimiter), itertools.chain([("", number, first)], numbered)
        elif nameless and sum(map(_is_number, header)) > len(header) / 2:
            columns = [str(place) for place in range(1, len(header) + 1)]
            header, lines = columns, itertools.chain([("", number, first)], numbered)
    except csv.Error as error:
        raise RequestError(f"The {what} {name} is not CSV: {error}.") from error
    return CsvTable(name, tuple(header), delimiter, _lines(name, what, header, delimiter, lines))


def check_columns(table: CsvTable, what: str, known: Collection[str], needed: Collection[str] = ()) -> None:
    """Raises RequestError where a table has other columns than the known ones, one twice, or lacks a needed one."""
    columns = table.columns
    twice = [column for column in columns if columns.count(column) > 1]
    if twice:
        raise RequestError(f"The {what} {table.name} has the column {twice[0]!r} twice.")
    strange = [column for column in columns if column not in known]
    missing = [column for column in needed if column not in columns]
    if strange or missing or not columns:
        wrong = f"the unknown column {strange[0][:40]!r}" if strange else "no header"
        wrong = f"no column {missing[0]!r}" if missing and not strange else wrong
        raise RequestError(
            f"The {what} {table.name} has {wrong}; its first line names columns out of {', '.join(known)}."
        )


def _header(line: str, delimiter: str) -> list[str]:
    header = [column.strip() for column in next(csv.reader([line], delimiter=delimiter, strict=True), [])]
    while header and not header[-1]:
        header.pop()
    return header


def _is_number(cell: str) -> bool:
    try:
        written_number(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _lines(
    name: str, what: str, header: Sequence[str], delimiter: str, numbered: Iterable[tuple[str, int, str]]
) -> Iterator[tuple[str, dict[str, str]]]:
    at = [0]

    def texts() -> Iterator[str]:
        for _, at[0], line in numbered:
            yield line

    try:
        for row in csv.reader(texts(), delimiter=delimiter, skipinitialspace=True, strict=True):
            cells = [text_of_cell(cell.strip()) for cell in row]
            if not any(cells):
                continue
            where = f"{name}, line {at[0]}"
            if any(cells[len(header) :]):
                raise RequestError(f"{where}: more cells than columns.")
            yield where, dict(zip(header, cells + [""] * (len(header) - len(cells)), strict=False))
    except csv.Error as error:
        raise RequestError(f"The {what} {name} is not CSV: {error}.") from error


def _without_comments(text: str, within: bool) -> Iterator[tuple[str, int, str]]:
    """(the comment before it, number, line) of each line that is none; so are empty lines before the first."""
    begun, comment = False, ""
    for number, line in enumerate(io.StringIO(text, newline=""), 1):
        if (within or not begun) and line.lstrip().startswith(COMMENT):
            comment = line.strip().lstrip(COMMENT)
        elif begun or line.strip():
            begun = True
            yield comment, number, line
            comment = ""
