"""A trajectory in a CSV file, its columns named as in requests."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from pydantic import ValidationError

from service.errors import RequestError
from service.schemas import PointIn, sentence_of

__all__ = ["path_from_file"]

COLUMNS = tuple(PointIn.model_fields)


def path_from_file(path: Path) -> list[PointIn]:
    """The points of a .csv file. Raises RequestError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"The path file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The path file {str(path)!r} cannot be read: {error.strerror}.") from error
    try:
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True, strict=True)
        strange = [column for column in rows.fieldnames or [""] if column not in COLUMNS]
        if strange:
            raise RequestError(
                f"The path file {path.name} has the unknown column {strange[0]!r}; its first line names columns out of "
                f"{', '.join(COLUMNS)}."
            )
        points = [_point(path.name, rows.line_num, row) for row in rows]
    except csv.Error as error:
        raise RequestError(f"The path file {path.name} is not CSV: {error}.") from error
    if not points:
        raise RequestError(f"The path file {path.name} holds no points.")
    return points


def _point(name: str, line: int, row: dict[str, str]) -> PointIn:
    try:
        return PointIn.model_validate({column: float(cell) for column, cell in row.items() if cell and cell.strip()})
    except ValidationError as error:
        raise RequestError(f"{name}, line {line}: {sentence_of(error)}") from error
    except (ValueError, TypeError, AttributeError) as error:
        raise RequestError(f"{name}, line {line}: its cells must be numbers, one for each column.") from error
