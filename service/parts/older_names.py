"""Fields of a request filled in before it is checked: from their older names, and from a finished map."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from pydantic import BaseModel, GetJsonSchemaHandler, JsonValue, ModelWrapValidatorHandler, PrivateAttr, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from service.errors import RequestError

from .points import StrictModel

__all__ = ["MAP_KINDS", "WithOlderNames", "kind_of_summary", "notes_on_older_names", "with_map"]

SIGHT = ("anchors", "satellites", "unknown", "curvature")
MAP_KINDS = ("visibility-map", "dop-map", "morphing-map")
# fields of summaries by which their kinds are told apart
TELLING = {"states": "morphing-map", "dop_quantiles": "dop-map", "count_histogram": "visibility-map"}


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
        return own + notes_on_older_names([getattr(asked, name) for name in type(asked).model_fields])
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
        return {**fields, "morphing_map": dict(asked)}
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


def kind_of_summary(summary: Mapping[str, Any]) -> str:
    """The kind of the map that a summary (visibility.json, dop.json, morph.json) is of. Raises RequestError."""
    for field, kind in TELLING.items():
        if field in summary and isinstance(summary.get("parameters"), Mapping):
            return kind
    raise RequestError("it is no visibility.json, dop.json or morph.json that Sightline wrote.")
