"""CSV that is safe in spreadsheets: no cell that came from outside begins a formula, and reading gives it back."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import IO, Any

__all__ = ["TableWriter", "cell_of", "text_of"]

# What spreadsheets take for the beginning of a formula, full-width forms included. A quote before it makes it text,
# and one quote more tells a text that has both by itself.
FORMULA = re.compile(r"'*[=+\-@\t\r\n＝＋－＠]")


def cell_of(value: Any) -> Any:
    """The value as a cell: a text that a spreadsheet would calculate gets a quote before it, numbers stay."""
    if not isinstance(value, str) or not FORMULA.match(value) or _is_number(value):
        return value
    return f"'{value}"


def text_of(cell: str) -> str:
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


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
