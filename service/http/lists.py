"""Lists page by page: what a page is asked with, and how it tells where the next one begins."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Query
from pydantic import AfterValidator, BaseModel, Field

from service.errors import RequestError
from service.jobs.records import Place

__all__ = ["Page", "Turn", "TurnDep"]

CURSOR = r"^[0-9]{1,12}(\.[0-9]{1,9})?-[0-9a-f]{32}$"


def _order(place: Place) -> tuple[float, str]:
    return -place.number, place.id


def _cursor(text: str) -> str:
    """Raises ValueError unless it looks like one."""
    if not re.fullmatch(CURSOR, text):
        raise ValueError(
            f"The cursor {text[:60]!r} is none of this service: give `next` of the page before, or leave it out for "
            "the first page"
        )
    return text


@dataclass(frozen=True, slots=True)
class Turn:
    """One page of a list: at most ``limit`` entries behind a place, or behind so many entries."""

    limit: int
    offset: int
    after: Place | None

    def part_of(self, places: Sequence[Place]) -> list[Place]:
        """Those of a whole list, newest first, that the page has, and one more where there is one."""
        behind = [one for one in places if self.after is None or _order(one) > _order(self.after)]
        return behind[self.offset : self.offset + self.limit + 1]

    def cursor(self, places: Sequence[Place]) -> str | None:
        """The cursor of the page after the one with entries at these places, read with one more than it may have."""
        if len(places) <= self.limit:
            return None
        last = places[self.limit - 1]
        return f"{last.number!r}-{last.id}"


async def _turn(
    limit: Annotated[int, Query(ge=1, le=200, description="At most so many entries in one answer.")] = 50,
    offset: Annotated[
        int,
        Query(
            ge=0,
            le=1_000_000_000,
            deprecated=True,
            description="Leave out so many entries from the start; follow `next` instead, which nothing new shifts.",
        ),
    ] = 0,
    cursor: Annotated[
        str | None,
        AfterValidator(lambda text: text if text is None else _cursor(text)),
        Query(
            description="`next` of the page before.",
            examples=["1777636800.25-9b2d4c55f0c94f5c8f3d0d3d7f7e6a01"],
            json_schema_extra={"pattern": CURSOR},
        ),
    ] = None,
) -> Turn:
    if cursor is None:
        return Turn(limit, offset, None)
    if offset:
        raise RequestError("A page is asked for with `cursor` or with `offset`, not with both; leave out `offset`.")
    number, _, id = cursor.partition("-")
    return Turn(limit, 0, Place(float(number), id))


TurnDep = Annotated[Turn, Depends(_turn)]


class Page(BaseModel):
    """Where in the whole list this page is."""

    total: int = Field(description="Entries in the whole list.")
    limit: int = Field(description="At most so many entries are in this page.")
    offset: int = Field(description="So many entries of the start were left out, as `offset` said.")
    next: str | None = Field(description="Give it as `cursor` for the next page; null on the last one.")
