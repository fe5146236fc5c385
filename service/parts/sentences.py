"""Requests between coming in and being checked: older names, what a map fills in, and sentences on what is wrong."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, ClassVar, Concatenate, ParamSpec, Self, TypeVar

from pydantic import (
    BaseModel,
    GetJsonSchemaHandler,
    JsonValue,
    ModelWrapValidatorHandler,
    PrivateAttr,
    ValidationError,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from service.errors import RequestError
from terrain import ElevationGrid, places_told

from .points import StrictModel

__all__ = [
    "MAP_KINDS",
    "MOST_FIELDS",
    "WithOlderNames",
    "counted",
    "fields_of",
    "kind_of_summary",
    "notes_on_older_names",
    "on_morphing_map",
    "place_of",
    "sentence_of",
    "sentence_of_detail",
    "told_as_asked",
    "with_map",
]

OF_GROUND = ("area", "cover")
SIGHT = (*OF_GROUND, "anchors", "satellites", "sight", "unknown", "curvature", "doubts")
MAP_KINDS = ("visibility-map", "dop-map", "morphing-map")
# fields of summaries by which their kinds are told apart
TELLING = {"states": "morphing-map", "dop_quantiles": "dop-map", "count_histogram": "visibility-map"}
MOST_FIELDS = 100
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


class WithOlderNames(StrictModel):
    """A request part some of whose fields had other names: ``older_names`` maps those to today's."""

    older_names: ClassVar[Mapping[str, str]] = {}
    _used: tuple[str, ...] = PrivateAttr(())

    @model_validator(mode="wrap")
    @classmethod
    def _take_older_names(cls, given: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        used: tuple[str, ...] = ()
        if isinstance(given, dict):
            used = tuple(old for old in cls.older_names if old in given)
            for old in used:
                if cls.older_names[old] in given:
                    raise ValueError(f"{old} is the older name of {cls.older_names[old]}; give only the new one.")
            given = {cls.older_names.get(name, name): value for name, value in given.items()}
        model = handler(given)
        if used:
            model._used = used
        return model

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        schema = handler.resolve_ref_schema(handler(core))
        properties = schema.get("properties", {})
        for old, new in cls.older_names.items():
            properties[old] = {
                **properties[new],
                "deprecated": True,
                "description": f"Older name of {new}: {properties[new].get('description', '')}",
            }
        return schema

    def notes(self) -> Iterator[str]:
        """A sentence for each older name that was used."""
        for old in self._used:
            yield f"{old} is called {self.older_names[old]} now; the older name will not be taken for ever."


def notes_on_older_names(asked: object) -> list[str]:
    """What to tell whoever asked this, everything within it included."""
    if isinstance(asked, BaseModel):
        own = list(asked.notes()) if isinstance(asked, WithOlderNames) else []
        return own + [note for name in type(asked).model_fields for note in notes_on_older_names(getattr(asked, name))]
    if isinstance(asked, (list, tuple)) and asked and isinstance(asked[0], (BaseModel, list, tuple)):
        return [note for one in asked for note in notes_on_older_names(one)]
    return []


def with_map(fields: Mapping[str, Any], kind: str, asked: Mapping[str, Any]) -> dict[str, JsonValue]:
    """The fields of a path's request with what the parameters of a finished map add; what the request says wins.

    A visibility map gives anchors and how sight lines are taken; a DOP map satellites and its limits as well; a
    morphing map takes the place of anchors. Raises RequestError.
    """
    if kind not in MAP_KINDS:
        raise RequestError(f"A path is planned on a visibility map, a DOP map or a morphing map, not on a {kind}.")
    if any(fields.get(name) for name in ("anchors", "tracks", "satellites", "morphing_map")):
        raise RequestError("A map brings its own anchors along; give the map, or anchors and satellites.")
    if kind == "morphing-map":
        return on_morphing_map(fields, asked)
    found = {name: asked[name] for name in SIGHT if asked.get(name)}
    found = {**found, **{name: value for name, value in fields.items() if name != "anchors" or value}}
    if kind == "dop-map":
        limits = {"dop_limit": asked["dop_limit"], "min_anchors": asked.get("min_anchors") or 0}
        limits |= {name: asked[name] for name in ("kind", "measure", "on_surface") if name in asked}
        found["limits"] = {**limits, **(fields.get("limits") or {})}
    height_m = asked.get("receiver_above_ground_m")
    if height_m is not None:
        found["rover"] = {"receiver_above_ground_m": height_m, **(fields.get("rover") or {})}
    return found


def on_morphing_map(fields: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, JsonValue]:
    """The fields of a plan's request with the parameters of a finished morphing map.

    Its area and what stands on its ground are the plan's too.
    """
    ground = {name: asked[name] for name in OF_GROUND if asked.get(name) is not None}
    return {**ground, **fields, "morphing_map": {name: value for name, value in asked.items() if name not in OF_GROUND}}


def kind_of_summary(summary: Mapping[str, Any]) -> str:
    """The kind of the map that a summary (visibility.json, dop.json, morph.json) is of. Raises RequestError."""
    for field, kind in TELLING.items():
        if field in summary and isinstance(summary.get("parameters"), Mapping):
            return kind
    raise RequestError("it is no visibility.json, dop.json or morph.json that Sightline wrote.")


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
    """A place in the request as people write it: ``anchors[0].east_m``.

    Tags of unions stand in pydantic's locations but not in the request; ours are all called ``<so>``.
    """
    place = ""
    for part in loc:
        if (part == "body" and not place) or (isinstance(part, str) and part.startswith("<")):
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
