"""Fields that were renamed: their older names are taken for one minor version, and whoever uses one is told."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, ClassVar, Self

from pydantic import BaseModel, GetJsonSchemaHandler, ModelWrapValidatorHandler, PrivateAttr, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from .points import StrictModel

__all__ = ["WithOlderNames", "notes_on_older_names"]


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
