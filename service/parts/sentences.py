"""Sentences about requests: what does not validate, and places named in the frame in which the request does."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Concatenate, ParamSpec, TypeVar

from pydantic import BaseModel, ValidationError

from terrain import ElevationGrid, places_told

__all__ = ["MOST_FIELDS", "counted", "fields_of", "place_of", "sentence_of", "sentence_of_detail", "told_as_asked"]

MOST_FIELDS = 100
# Tags of unions appear in pydantic's locations but not in the request.
UNION_TAGS = frozenset({"word", "numbers"})
# what pydantic says by the type of an error, in words for whoever asked
OTHERWISE = {
    "extra_forbidden": "this field is not known here",
    "model_type": "Input should be an object",
    "timezone_aware": "a time needs its zone: add Z for UTC",
}
P = ParamSpec("P")
Asked = TypeVar("Asked", bound=BaseModel)
Answer = TypeVar("Answer")
# whoever ranges to anchors given in degrees may still ask about places in metres
BESIDES = frozenset({"anchors", "tracks", "morphing_map", "no_go", "keep_in"})


def sentence_of(error: ValidationError) -> str:
    """The first thing wrong, with its place in the request: ``anchors[0].east_m: Input should be a valid number.``"""
    details = error.errors(include_url=False, include_context=False, include_input=False)
    return sentence_of_detail(details)


def sentence_of_detail(details: Sequence[Mapping[str, Any]]) -> str:
    """The same from pydantic's (or FastAPI's) list of error details; says how many more there are."""
    first = details[0]
    place = place_of(first["loc"])
    message = str(first["msg"]).removeprefix("Value error, ").rstrip(".")
    message = OTHERWISE.get(first["type"], message).replace(" after validation", "")
    if first["type"] == "value_error":
        # our own validators name the thing themselves, except a point, which has no id
        place = place if message.startswith("Point: ") else ""
        message = message.removeprefix("Point: ")
    more = len(details) - 1
    also = f" (and {more} more)" if more else ""
    return f"{place}: {message}{also}." if place else f"{message}{also}."


def counted(number: int, thing: str) -> str:
    """So many of a thing whose plural ends in s: ``1 anchor``, ``2 anchors``."""
    return f"{number:,} {thing}" if number == 1 else f"{number:,} {thing}s"


def fields_of(error: ValidationError) -> list[dict[str, str]]:
    """What is wrong with which field, of the first hundred."""
    details = error.errors(include_url=False, include_context=False, include_input=False)[:MOST_FIELDS]
    return [
        {"field": place_of(detail["loc"]), "detail": str(detail["msg"]).removeprefix("Value error, ")}
        for detail in details
    ]


def place_of(loc: Sequence[str | int]) -> str:
    """A place in the request as people write it: ``anchors[0].east_m``."""
    place = ""
    for part in loc:
        if part in UNION_TAGS or (part == "body" and not place):
            continue
        place += f"[{part}]" if isinstance(part, int) else f".{part}" if place else str(part)
    return place


def told_as_asked(
    function: Callable[Concatenate[ElevationGrid, Asked, P], Answer],
) -> Callable[Concatenate[ElevationGrid, Asked, P], Answer]:
    """The function, within which sentences name places in metres, degrees or both, as its request does."""

    @functools.wraps(function)
    def told(grid: ElevationGrid, asked: Asked, /, *args: P.args, **kwargs: P.kwargs) -> Answer:
        frames = set(_frames(asked, BESIDES)) or set(_frames(asked, frozenset()))
        degrees = "degrees" in frames and grid.crs is not None
        with places_told(in_metres="metres" in frames or not degrees, in_degrees=degrees):
            return function(grid, asked, *args, **kwargs)

    return told


def _frames(thing: Any, besides: frozenset[str]) -> Iterator[str]:
    """In which frames the places of a request are given."""
    if isinstance(thing, BaseModel):
        names = type(thing).model_fields
        if getattr(thing, "lon_deg", None) is not None or "coordinates" in names:
            yield "degrees"
        elif getattr(thing, "east_m", None) is not None:
            yield "metres"
        else:
            for name in names:
                if name not in besides:
                    yield from _frames(getattr(thing, name), besides)
    elif isinstance(thing, list | tuple):
        for one in thing:
            yield from _frames(one, besides)
