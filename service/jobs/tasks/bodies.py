"""Bodies of requests that are too big to be read in the process that answers HTTP."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from service.errors import NotJsonError, NotValidError
from service.schemas import sentence_of

__all__ = ["read_body"]

Body = TypeVar("Body", bound=BaseModel)


def read_body(model: type[Body], path: Path) -> Body:
    """The body at a path as a model; raises NotJsonError, NotValidError."""
    try:
        return model.model_validate_json(path.read_bytes())
    except ValidationError as error:
        if error.errors(include_url=False, include_input=False)[0]["type"] == "json_invalid":
            raise NotJsonError("The body is not valid JSON.") from error
        raise NotValidError(sentence_of(error)) from error
