"""A trajectory in a CSV file, its columns named as in requests: the points, and what is known at each."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from pydantic import ValidationError

from service.errors import RequestError
from service.schemas import PointIn, sentence_of

__all__ = ["path_from_file", "points_and_columns"]

COLUMNS = tuple(PointIn.model_fields)


def path_from_file(path: Path) -> list[PointIn]:
    """The points of a .csv file. Raises RequestError."""
    return points_and_columns(path)[0]


def points_and_columns(path: Path, more: tuple[str, ...] = ()) -> tuple[list[PointIn], dict[str, list[float]]]:
    """The points of a .csv file, and those of the columns ``more`` that it has. Raises RequestError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"The path file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The path file {str(path)!r} cannot be read: {error.strerror}.") from error
    try:
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True, strict=True)
        columns = rows.fieldnames or [""]
        strange = [column for column in columns if column not in (*COLUMNS, *more)]
        if strange:
            raise RequestError(
                f"The path file {path.name} has the unknown column {strange[0]!r}; its first line names columns out of "
                f"{', '.join((*COLUMNS, *more))}."
            )
        read = [(rows.line_num, _numbers(path.name, rows.line_num, row)) for row in rows]
    except csv.Error as error:
        raise RequestError(f"The path file {path.name} is not CSV: {error}.") from error
    if not read:
        raise RequestError(f"The path file {path.name} holds no points.")
    told: dict[str, list[float]] = {column: [] for column in more if column in columns}
    points = []
    for line, numbers in read:
        for column in told:
            if column not in numbers:
                raise RequestError(f"{path.name}, line {line}: {column} is empty.")
            told[column].append(numbers.pop(column))
        points.append(_point(path.name, line, numbers))
    return points, told


def _point(name: str, line: int, numbers: dict[str, float]) -> PointIn:
    try:
        return PointIn.model_validate(numbers)
    except ValidationError as error:
        raise RequestError(f"{name}, line {line}: {sentence_of(error)}") from error


def _numbers(name: str, line: int, row: dict[str, str]) -> dict[str, float]:
    try:
        return {column: float(cell) for column, cell in row.items() if cell and cell.strip()}
    except (ValueError, TypeError, AttributeError) as error:
        raise RequestError(f"{name}, line {line}: its cells must be numbers, one for each column.") from error
