"""Lists that come page by page."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, Field

__all__ = ["Limit", "Offset", "Page"]

Limit = Annotated[int, Field(ge=1, le=200, description="At most so many entries in one answer.")]
Offset = Annotated[int, Field(ge=0, le=1_000_000_000, description="Leave out so many entries from the start.")]


class Page(BaseModel):
    """Where in the whole list this page is."""

    total: int = Field(description="Entries in the whole list.")
    limit: int = Field(description="At most so many entries are in this page.")
    offset: int = Field(description="So many entries come before this page.")
