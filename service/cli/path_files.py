"""A trajectory in a CSV file, its columns named as in requests: the points, and what is known at each."""

from __future__ import annotations

from pathlib import Path

from pydantic import ValidationError

from service.errors import RequestError
from service.files.read_tables import read_table
from service.parts.points import PointIn
from service.parts.sentences import sentence_of

__all__ = ["path_from_file", "points_and_columns"]

# cells are numbers
COLUMNS = tuple(field for field in PointIn.model_fields if field not in ("body", "altitude_datum"))


def path_from_file(path: Path) -> list[PointIn]:
    """The points of a .csv file. Raises RequestError."""
    return points_and_columns(path)[0]


def points_and_columns(path: Path, more: tuple[str, ...] = ()) -> tuple[list[PointIn], dict[str, list[float]]]:
    """The points of a .csv file, and those of the columns ``more`` that it has. Raises RequestError."""
    table = read_table(path, "The path file")
    columns = table.header
    strange = [column for column in columns if column not in (*COLUMNS, *more)]
    if strange or not columns:
        wrong = f"the unknown column {strange[0]!r}" if strange else "no header"
        raise RequestError(
            f"The path file {path.name} has {wrong}; its first line names columns out of "
            f"{', '.join((*COLUMNS, *more))}."
        )
    read = [(line, table.numbers(line, cells)) for line, cells in table.rows]
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
