"""Visibility maps as the service tells about them: what is asked in POST, how the job stands, what came out."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from service.parts.map_answers import DEM_ID, DemId, MapOut, MapSummary, running_example
from service.parts.older_results import OrOlder
from service.parts.pages import Page
from service.products.visibility.request import VisibilityMapParameters

__all__ = ["VisibilityMapIn", "VisibilityMapList", "VisibilityMapOut", "VisibilityMapSummary"]

ANCHORS: list[Any] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "altitude_m": 1612.0},
]
REQUEST: dict[str, Any] = {"dem_id": DEM_ID, "anchors": ANCHORS, "receiver_above_ground_m": 1.5, "mode": "fast"}


class VisibilityMapIn(VisibilityMapParameters):
    """A DEM, anchors, the receiver's height, and how to calculate."""

    model_config = ConfigDict(json_schema_extra={"examples": [REQUEST]})

    dem_id: DemId


class AnchorSummary(BaseModel):
    """One anchor in the DEM's frame, and what part of the known ground sees it."""

    model_config = ConfigDict(extra="allow")

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")
    visible_share: float | None = Field(description="Part of the known posts where it is visible, 0..1.")
    hidden_share: float | None = Field(description="Part of the known posts where it is hidden, 0..1.")
    unknown_share: float | None = Field(description="Part of the known posts where its sight is unknown, 0..1.")


class CountShare(BaseModel):
    """How many posts see exactly so many anchors."""

    visible_anchors: int = Field(description="Number of anchors surely visible.")
    posts: int = Field(description="Known posts with that number.")
    share: float | None = Field(description="The same as part of all known posts, 0..1.")


class VisibilityMapSummary(MapSummary):
    """What the map says in numbers, and how far to trust it."""

    receiver: dict[str, float | None] = Field(
        description="Height of the receiver: above_ground_m or altitude_m, metres."
    )
    anchors: list[AnchorSummary]
    count_histogram: list[CountShare]
    undecided_posts: int = Field(
        description="Known posts where nobody is surely visible but somebody may be; 0 visible_anchors counts them too."
    )
    posts_with_unknown_anchors: int = Field(description="Posts where the sight of at least one anchor is unknown.")


class VisibilityMapOut(MapOut):
    """A visibility map: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(json_schema_extra={"examples": [running_example("/visibility-maps", REQUEST)]})

    result: OrOlder[VisibilityMapSummary] = Field(description="What the map says; null until it succeeded.")


class VisibilityMapList(Page):
    """One page of visibility maps, newest first."""

    visibility_maps: list[VisibilityMapOut]
