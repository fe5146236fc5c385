"""Visibility maps as the service tells about them: what is asked in POST, how the job stands, what came out."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from .jobs import JobOut
from .pages import Page
from .visibility_maps import VisibilityMapParameters

__all__ = ["LayerLink", "VisibilityMapIn", "VisibilityMapList", "VisibilityMapOut", "VisibilityMapSummary"]

DEM_ID = "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11"
JOB_ID = "9b2d4c55f0c94f5c8f3d0d3d7f7e6a01"
ANCHORS: list[Any] = [
    {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
    {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "altitude_m": 1612.0},
]
REQUEST: dict[str, Any] = {"dem_id": DEM_ID, "anchors": ANCHORS, "receiver_above_ground_m": 1.5, "mode": "fast"}

DemId = Annotated[str, Field(min_length=1, max_length=64, description="The DEM, as POST /dems named it.")]


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


class VisibilityMapSummary(BaseModel):
    """What the map says in numbers, and how far to trust it."""

    model_config = ConfigDict(extra="allow")

    version: str = Field(description="Version of Sightline that calculated it.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="Measured error of that mode.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    unknown: str = Field(description="What a sight line over unknown ground was taken as.")
    receiver: dict[str, float | None] = Field(
        description="Height of the receiver: above_ground_m or altitude_m, metres."
    )
    dem: dict[str, Any] = Field(description="The DEM that was used; lengths in metres.")
    anchors: list[AnchorSummary]
    count_histogram: list[CountShare]
    undecided_posts: int = Field(
        description="Known posts where nobody is surely visible but somebody may be; 0 visible_anchors counts them too."
    )
    posts_with_unknown_anchors: int = Field(description="Posts where the sight of at least one anchor is unknown.")
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    parameters: dict[str, Any] = Field(description="What was asked, defaults filled in.")


class LayerLink(BaseModel):
    """A file that the map can be downloaded as."""

    name: str = Field(description="File name of the layer.")
    href: str = Field(description="Path to download it from.")
    media_type: str = Field(description="Its type.")
    description: str = Field(description="What it holds, with units.")


class VisibilityMapOut(JobOut):
    """A visibility map: how its calculation stands, and its result when it has one."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "id": JOB_ID,
                    "status": "running",
                    "progress": 0.45,
                    "dem_id": DEM_ID,
                    "created_at": "2026-05-01T12:00:00Z",
                    "started_at": "2026-05-01T12:00:00Z",
                    "finished_at": None,
                    "run_s": None,
                    "attempts": 1,
                    "problem": None,
                    "links": {"self": f"/visibility-maps/{JOB_ID}", "dem": f"/dems/{DEM_ID}"},
                    "request": REQUEST,
                    "result": None,
                    "layers": [],
                }
            ]
        }
    )

    request: dict[str, Any] = Field(description="What was asked, defaults filled in.")
    result: VisibilityMapSummary | None = Field(description="What the map says; null until it succeeded.")
    layers: list[LayerLink] = Field(description="What can be downloaded; empty until it succeeded.")


class VisibilityMapList(Page):
    """One page of visibility maps, newest first."""

    visibility_maps: list[VisibilityMapOut]
