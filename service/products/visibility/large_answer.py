"""Maps over rasters larger than memory, as the service tells about them."""

from __future__ import annotations

from pydantic import BaseModel, Field

from .calculate import ReceiverHeight

__all__ = ["AnchorInReach", "LargeGround", "LargeMapSummary"]


class LargeGround(BaseModel):
    """Which raster this is; its heights are never all in memory."""

    name: str = Field(description="File name.")
    rows: int = Field(description="Rows of posts.")
    cols: int = Field(description="Columns of posts.")
    cell_east_m: float = Field(description="From post to post eastward, metres.")
    cell_north_m: float = Field(description="From post to post northward, metres.")
    crs: str | None = Field(description="Metric CRS; null for a local frame.")
    vertical_datum: str | None = Field(description="What heights count from, where that is known.")
    heights_count_from: str = Field(description="What that is: sea level, ellipsoid or unknown.")


class AnchorInReach(BaseModel):
    """One anchor, and what of the ground in its reach sees it."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    max_range_m: float = Field(description="Longest slant range, metres.")
    posts_in_reach: int = Field(description="Posts no further from it on the map than its range.")
    visible_posts: int = Field(description="Those from which it is in sight, within its antenna's limits.")
    hidden_posts: int = Field(description="Those from which it is not.")
    unknown_posts: int = Field(description="Those where unknown ground leaves it open.")


class LargeMapSummary(BaseModel):
    """What a map by windows says in numbers, and how far to trust it."""

    version: str = Field(description="Of Sightline.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="What the map may be off by, for the anchor where that is most.")
    curvature: str = Field(description="How the ground curved.")
    unknown: str = Field(description="What a line over unknown ground is.")
    receiver: ReceiverHeight
    dem: LargeGround
    anchors: list[AnchorInReach]
    posts_in_reach: int = Field(description="Posts in reach of anchors, once for each anchor.")
    read_by: str = Field(description="Who read the ground: this process, or workers of a Dask scheduler.")
    warnings: list[str] = Field(description="What to know about ground, anchors and altitudes.")
    timing: dict[str, float] = Field(description="Seconds of wall clock: calculation_s, files_s.")
