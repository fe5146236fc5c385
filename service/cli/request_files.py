"""A whole request in a JSON file, as it would be sent over HTTP, and maps that other commands wrote.

What a request names of a service has no meaning here, and one rule for it holds in all commands: the DEM and, with
--map, the map are those of the command line; what the file says is passed over, and that is told on standard error.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, JsonValue, ValidationError

from service.errors import RequestError
from service.parts.maps_for_paths import MAP_KINDS, kind_of_summary
from service.parts.older_names import notes_on_older_names
from service.parts.sentences import sentence_of
from service.products import Given

__all__ = ["given", "given_map", "request_from_file", "request_of_fields"]

Request = TypeVar("Request", bound=BaseModel)
Value = TypeVar("Value")
FILES_OF_MAPS = {"visibility-map": "visibility.json", "dop-map": "dop.json", "morphing-map": "morph.json"}


def request_from_file(file: Path, kind: type[Request], *, instead: Collection[str] = ()) -> Request:
    """The request that a file holds. Raises RequestError.

    instead: further fields that name things of a service, for which the command line gives something else.
    """
    document = _document(file, "request")
    for name in ("dem_id", *instead):
        if document.pop(name, None) is not None:
            _tell(f"The request {file.name} names a {name} of a service; it is passed over for the command line's.")
    if "map_id" in document:
        raise RequestError(f"The request {file.name} names a map of a service by its map_id; give its file with --map.")
    try:
        asked = kind.model_validate_json(json.dumps(document))
    except ValidationError as error:
        raise RequestError(f"The request {file.name}: {sentence_of(error)}") from error
    for note in notes_on_older_names(asked):
        _tell(f"The request {file.name}: {note}")
    return asked


def request_of_fields(fields: Mapping[str, object], kind: type[Request]) -> Request:
    """The request that options make. Raises RequestError."""
    try:
        return kind.model_validate(fields)
    except ValidationError as error:
        raise RequestError(sentence_of(error)) from error


def given_map(file: Path, kinds: Collection[str] = MAP_KINDS) -> Given:
    """The kind and the parameters of a map that a command wrote, from its summary. Raises RequestError."""
    summary = _document(file, "map")
    try:
        kind = kind_of_summary(summary)
    except RequestError:
        kind = ""
    if kind not in kinds:
        *names, last = [FILES_OF_MAPS[one] for one in kinds]
        told = f"{', '.join(names)} or {last}" if names else last
        raise RequestError(f"The map {file.name}: it is no {told} that Sightline wrote.")
    parameters = summary["parameters"]
    assert isinstance(parameters, dict), "kind_of_summary has looked"
    return Given(map_kind=kind, map_parameters=parameters)


def given(fields: Mapping[str, Value | None]) -> dict[str, Value]:
    """Without the options that were left out."""
    return {name: value for name, value in fields.items() if value is not None}


def _document(file: Path, what: str) -> dict[str, JsonValue]:
    try:
        document = json.loads(file.read_text(encoding="utf-8-sig"))
    except UnicodeDecodeError as error:
        raise RequestError(f"The {what} {file.name} is not UTF-8 text.") from error
    except OSError as error:
        raise RequestError(f"The {what} {str(file)!r} cannot be read: {error.strerror}.") from error
    except (json.JSONDecodeError, RecursionError) as error:
        raise RequestError(f"The {what} {file.name} is not JSON: {error}.") from error
    if not isinstance(document, dict):
        raise RequestError(f"The {what} {file.name} holds no JSON object.")
    return document


def _tell(sentence: str) -> None:
    print(f"Warning: {sentence}", file=sys.stderr)
