"""A whole request in a JSON file, as it would be sent over HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from service.errors import RequestError
from service.parts.sentences import sentence_of

__all__ = ["given", "request_from_file"]

Request = TypeVar("Request", bound=BaseModel)


def request_from_file(file: Path, kind: type[Request]) -> Request:
    """The request that a file holds. Raises RequestError."""
    try:
        return kind.model_validate_json(file.read_bytes())
    except OSError as error:
        raise RequestError(f"The request {str(file)!r} cannot be read: {error.strerror}.") from error
    except ValidationError as error:
        raise RequestError(f"The request {file.name}: {sentence_of(error)}") from error


def given(fields: dict[str, Any]) -> dict[str, Any]:
    """Without the options that were left out."""
    return {name: value for name, value in fields.items() if value is not None}
