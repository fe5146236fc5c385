"""Results that an older Sightline stored: told as they are, for fields that came later cannot be made up."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar, cast

from pydantic import BaseModel, ConfigDict, Field

__all__ = ["OlderResult", "OrOlder", "or_older"]

Summary = TypeVar("Summary", bound=BaseModel)


class OlderResult(BaseModel):
    """What an older Sightline stored; fields that were added since are missing. Ask again for a result with all."""

    model_config = ConfigDict(extra="allow")

    version: str = Field(description="Version of Sightline that calculated it.")


# left to right, because any result would do as an older one
OrOlder = Annotated[Summary | OlderResult | None, Field(union_mode="left_to_right")]


def or_older(answer: Any) -> Any:
    """The type of a field for an answer whose model is known at run time only."""
    return cast(Any, OrOlder)[answer]
