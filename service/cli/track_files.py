"""Anchors on tracks in files: JSON as in requests, or CSV with a row for each point of each track."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.files.read_tables import read_table
from service.parts.frames import TrackIn, TrackPointIn
from service.parts.sentences import sentence_of

from .height_words import height_field

__all__ = ["frames_fields", "tracks_from_file"]

# cells are numbers
POINT_COLUMNS = tuple(field for field in TrackPointIn.model_fields if field not in ("body", "altitude_datum"))


def tracks_from_file(path: Path) -> list[TrackIn]:
    """The tracks of a .json or .csv file. Raises RequestError."""
    entries = _of_json(path) if path.suffix.lower() == ".json" else _of_csv(path)
    if not entries:
        raise RequestError(f"The track file {path.name} holds no tracks.")
    try:
        return [TrackIn.model_validate(entry) for entry in entries]
    except ValidationError as error:
        raise RequestError(f"The track file {path.name}: {sentence_of(error)}") from error


def frames_fields(frames: str | None, available_at: str | None) -> dict[str, float | str] | None:
    """--frames and --available-at as the ``frames`` of a request; None without. Raises RequestError."""
    if frames is None:
        if available_at is not None:
            raise RequestError("--available-at needs --frames FROM,TO,STEP.")
        return None
    try:
        from_s, to_s, step_s = (float(part) for part in frames.split(","))
    except ValueError as error:
        raise RequestError(f"--frames {frames!r} is not of the form FROM,TO,STEP in seconds.") from error
    fields: dict[str, float | str] = {"from_s": from_s, "to_s": to_s, "step_s": step_s}
    if available_at is None:
        return fields
    form = f"--available-at {available_at!r} is not of the form 60agl (above ground) or 1500msl (altitude)."
    return {**fields, **height_field(available_at, form)}


def _of_json(path: Path) -> list[Any]:
    name = path.name
    try:
        document = json.loads(path.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The track file {name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The track file {str(path)!r} cannot be read: {error.strerror}.") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The track file {name} is not JSON: {error}.") from error
    entries = document.get("tracks") if isinstance(document, dict) else document
    if not isinstance(entries, list):
        raise RequestError(f"The track file {name} must hold a list of tracks, or an object with a list 'tracks'.")
    return entries


def _of_csv(path: Path) -> list[Any]:
    table = read_table(path, "The track file")
    strange = [column for column in table.header if column not in ("id", *POINT_COLUMNS)]
    if strange or "id" not in table.header:
        wrong = f"the unknown column {strange[0]!r}" if strange else "no column 'id'"
        raise RequestError(
            f"The track file {path.name} has {wrong}; its first line names id and columns out of "
            f"{', '.join(POINT_COLUMNS)}."
        )
    points: dict[str, list[dict[str, float]]] = {}
    for line, cells in table.rows:
        point = table.numbers(line, {column: cell for column, cell in cells.items() if column != "id"})
        points.setdefault(cells.get("id", ""), []).append(point)
    return [{"id": id, "points": listed} for id, listed in points.items()]
