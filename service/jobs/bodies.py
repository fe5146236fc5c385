"""Bodies in JSON as models: lists that are too long are refused before anything in them is looked at."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError
from pydantic_core import from_json

from service.errors import LimitError, NotJsonError, NotValidError
from service.parts.sentences import fields_of, sentence_of
from service.settings import Settings

from .channel import BodyArguments

__all__ = ["body_in", "model_of", "read_body", "validated"]

Body = TypeVar("Body", bound=BaseModel)

# Lists whose length a setting limits, by where they stand; what is longer is refused before any of it is looked at.
LIMITED = {
    ("anchors",): ("max_anchors", "anchors"),
    ("tracks",): ("max_anchors", "anchors on tracks"),
    ("morphing_map", "anchors"): ("max_anchors", "anchors"),
    ("morphing_map", "tracks"): ("max_anchors", "anchors on tracks"),
    ("pairs",): ("max_pairs", "pairs"),
    ("from_points_m",): ("max_pairs", "pairs"),
    ("to_points_m",): ("max_pairs", "pairs"),
    ("points",): ("max_path_points", "points"),
    ("points_m",): ("max_path_points", "points"),
    ("times_s",): ("max_path_points", "times"),
    ("covariances_m2",): ("max_path_points", "covariances"),
}


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


def body_in(arguments: BodyArguments) -> str | bytes:
    """The body that came along, or that lies in a file because it is big."""
    return arguments["body"] if "body" in arguments else Path(arguments["path"]).read_bytes()


def read_body(model: type[Body], data: bytes | str, settings: Settings) -> Body:
    """The body as a model; limits come before work. Raises NotJsonError, LimitError, NotValidError."""

    def refuse_long(fields: Any) -> None:
        for place, (limit_name, what) in LIMITED.items():
            _refuse_long(_at(fields, place), what, limit_name, getattr(settings, limit_name))

    return model_of(model, data, refuse_long)


def _at(fields: Any, place: tuple[str, ...]) -> Any:
    for name in place:
        fields = fields.get(name) if isinstance(fields, dict) else None
    return fields


def _refuse_long(given: Any, what: str, limit_name: str, limit: int) -> None:
    if isinstance(given, list) and len(given) > limit:
        raise LimitError(
            f"{len(given):,} {what} are more than the limit of {limit:,} in one request",
            limit_name=limit_name,
            limit=limit,
            given=len(given),
        )
