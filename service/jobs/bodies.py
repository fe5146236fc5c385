"""A body in JSON as a model: lists that are too long are refused before anything in them is looked at."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import from_json

from service.errors import NotJsonError, NotValidError
from service.parts.sentences import fields_of, sentence_of

__all__ = ["model_of", "validated"]

Body = TypeVar("Body", bound=BaseModel)


def model_of(model: type[Body], data: str | bytes, refuse_long: Callable[[Any], None]) -> Body:
    """The body as a model. refuse_long: raises LimitError. Raises NotJsonError, NotValidError besides."""
    try:
        fields = from_json(data)
    except ValueError as error:
        raise NotJsonError("The body is not valid JSON.") from error
    refuse_long(fields)
    return validated(model, fields)


def validated(model: type[Body], fields: Any) -> Body:
    """The fields as a model. Raises NotValidError."""
    try:
        return model.model_validate(fields)
    except ValidationError as error:
        raise NotValidError(sentence_of(error), fields_of(error)) from error
