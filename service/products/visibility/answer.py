"""Visibility maps as the service tells about them."""

from __future__ import annotations

from pydantic import BaseModel, Field

from service.parts.map_facts import MapSummary

__all__ = ["AnchorSummary", "CountShare", "ReceiverHeight", "VisibilityMapSummary"]


class AnchorSummary(BaseModel):
    """One anchor in the DEM's frame, and what part of the known ground sees it."""

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


class ReceiverHeight(BaseModel):
    """Height of the receiver: one of both."""

    above_ground_m: float | None = Field(description="Above the ground of each post, metres.")
    altitude_m: float | None = Field(description="One altitude everywhere, metres.")


class VisibilityMapSummary(MapSummary):
    """What the map says in numbers, and how far to trust it."""

    receiver: ReceiverHeight
    anchors: list[AnchorSummary]
    count_histogram: list[CountShare]
    undecided_posts: int = Field(
        description="Known posts where nobody is surely visible but somebody may be; 0 visible_anchors counts them too."
    )
    posts_with_unknown_anchors: int = Field(description="Posts where the sight of at least one anchor is unknown.")
