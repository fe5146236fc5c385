"""What maps of every kind are answered with."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from service.parts.job_answers import JobOut
from service.parts.older_results import OrOlder

__all__ = ["DEM_ID", "BoundsOfPosts", "DemId", "Ground", "LayerLink", "MapOut", "MapSummary", "running_example"]

DEM_ID = "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11"
JOB_ID = "9b2d4c55f0c94f5c8f3d0d3d7f7e6a01"

DemId = Annotated[str, Field(min_length=1, max_length=64, description="The DEM, as POST /dems named it.")]


class BoundsOfPosts(BaseModel):
    """The outermost posts, metres in the DEM's frame."""

    west: float = Field(description="East of the westmost posts, metres.")
    south: float = Field(description="North of the southmost posts, metres.")
    east: float = Field(description="East of the eastmost posts, metres.")
    north: float = Field(description="North of the northmost posts, metres.")


class Ground(BaseModel):
    """Which ground it was: name, digest, size, place and what was converted."""

    name: str = Field(description="What the DEM is called.")
    sha256: str = Field(description="Digest of heights and geometry, hexadecimal digits.")
    rows: int = Field(description="Rows of posts.")
    cols: int = Field(description="Columns of posts.")
    cell_east_m: float = Field(description="Distance of the posts from west to east, metres.")
    cell_north_m: float = Field(description="Distance of the posts from north to south, metres.")
    bounds_of_posts_m: BoundsOfPosts
    crs: str | None = Field(description="The metric CRS; null for a local frame.")
    crs_name: str = Field(description="How people call it.")
    body: str | None = Field(None, description="The celestial body it lies on; null for a local frame.")
    grid_north_deg: float | None = Field(
        None, description="True azimuth of the grid's north at its middle, degrees; null for a local frame."
    )
    vertical_datum: str | None = Field(description="What heights count from, where that is known.")
    heights_count_from: str = Field("unknown", description="What heights count from: sea level, ellipsoid, or unknown.")
    unknown_posts: int = Field(description="Posts without a known height.")
    conversions: list[str] = Field(description="What was converted when it was read, in sentences.")


class MapSummary(BaseModel):
    """How far to trust a map, and what it was made from."""

    model_config = ConfigDict(extra="allow")

    version: str = Field(description="Version of Sightline that calculated it.")
    mode: str = Field(description="fast or exact.")
    error_statement: str = Field(description="Measured error of that mode.")
    curvature: str = Field(description="Curvature and refraction that were used.")
    unknown: str = Field(description="What a sight line over unknown ground was taken as.")
    dem: Ground
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    parameters: dict[str, JsonValue] = Field(description="What was asked, defaults filled in.")


class LayerLink(BaseModel):
    """A file that the map can be downloaded as."""

    name: str = Field(description="File name of the layer.")
    href: str = Field(description="Path to download it from.")
    media_type: str = Field(description="Its type.")
    description: str = Field(description="What it holds, with units.")


class MapOut(JobOut):
    """A map: how its calculation stands, and its result when it has one."""

    request: dict[str, JsonValue] = Field(description="What was asked, defaults filled in.")
    result: OrOlder[MapSummary] = Field(description="What the map says; null until it succeeded.")
    layers: list[LayerLink] = Field(description="What can be downloaded; empty until it succeeded.")


def running_example(path: str, request: dict[str, JsonValue]) -> dict[str, Any]:
    """A map that is being calculated, as an example for OpenAPI."""
    return {
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
        "links": {"self": f"{path}/{JOB_ID}", "dem": f"/dems/{DEM_ID}"},
        "request": request,
        "result": None,
        "layers": [],
    }
