"""Anchors on tracks in files: JSON as in requests, or CSV with a row for each point of each track."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from service.errors import RequestError
from service.schemas import sentence_of
from service.schemas.frames import TrackIn, TrackPointIn
from service.tables import text_of

from .anchor_texts import HEIGHT

__all__ = ["frames_fields", "tracks_from_file"]

POINT_COLUMNS = tuple(TrackPointIn.model_fields)


def tracks_from_file(path: Path) -> list[TrackIn]:
    """The tracks of a .json or .csv file. Raises RequestError."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise RequestError(f"The track file {path.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The track file {str(path)!r} cannot be read: {error.strerror}.") from error
    entries = _of_json(path.name, text) if path.suffix.lower() == ".json" else _of_csv(path.name, text)
    if not entries:
        raise RequestError(f"The track file {path.name} holds no tracks.")
    try:
        return [TrackIn.model_validate(entry) for entry in entries]
    except ValidationError as error:
        raise RequestError(f"The track file {path.name}: {sentence_of(error)}") from error


def frames_fields(frames: str | None, available_at: str | None) -> dict[str, float] | None:
    """--frames and --available-at as the ``frames`` of a request; None without. Raises RequestError."""
    if frames is None:
        if available_at is not None:
            raise RequestError("--available-at needs --frames FROM,TO,STEP.")
        return None
    try:
        from_s, to_s, step_s = (float(part) for part in frames.split(","))
    except ValueError as error:
        raise RequestError(f"--frames {frames!r} is not of the form FROM,TO,STEP in seconds.") from error
    fields = {"from_s": from_s, "to_s": to_s, "step_s": step_s}
    if available_at is None:
        return fields
    height = HEIGHT.fullmatch(available_at.strip())
    form = f"--available-at {available_at!r} is not of the form 60agl (above ground) or 1500msl (altitude)."
    if height is None:
        raise RequestError(form)
    try:
        metres = float(height["metres"])
    except ValueError as error:
        raise RequestError(form) from error
    return {**fields, "above_ground_m" if height["above"].lower() == "agl" else "altitude_m": metres}


def _of_json(name: str, text: str) -> list[Any]:
    try:
        document = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The track file {name} is not JSON: {error}.") from error
    entries = document.get("tracks") if isinstance(document, dict) else document
    if not isinstance(entries, list):
        raise RequestError(f"The track file {name} must hold a list of tracks, or an object with a list 'tracks'.")
    return entries


def _of_csv(name: str, text: str) -> list[Any]:
    points: dict[str, list[dict[str, float]]] = {}
    try:
        rows = csv.DictReader(io.StringIO(text), skipinitialspace=True, strict=True)
        strange = [column for column in rows.fieldnames or [""] if column not in ("id", *POINT_COLUMNS)]
        if strange or "id" not in (rows.fieldnames or []):
            wrong = f"the unknown column {strange[0]!r}" if strange else "no column 'id'"
            raise RequestError(
                f"The track file {name} has {wrong}; its first line names id and columns out of "
                f"{', '.join(POINT_COLUMNS)}."
            )
        for row in rows:
            points.setdefault(text_of(row["id"] or ""), []).append(_point(name, rows.line_num, row))
    except csv.Error as error:
        raise RequestError(f"The track file {name} is not CSV: {error}.") from error
    return [{"id": id, "points": listed} for id, listed in points.items()]


def _point(name: str, line: int, row: dict[str, str]) -> dict[str, float]:
    try:
        return {column: float(cell) for column, cell in row.items() if column != "id" and cell and cell.strip()}
    except (ValueError, TypeError, AttributeError) as error:
        raise RequestError(f"{name}, line {line}: its cells must be numbers, one for each column.") from error
