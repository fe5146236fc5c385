"""How the service tells about DEMs."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, JsonValue

from service.access.callers import rooted
from service.jobs.records import DemRecord
from service.parts.map_facts import BareGround

from .grounds import GroundUnderWay
from .lists import Page

__all__ = ["BoundsDegrees", "DemList", "DemOut", "DemUnderWay", "RasterOut"]

EXAMPLE: dict[str, JsonValue] = {
    "id": "5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11",
    "name": "bigtujunga.tif",
    "created_at": "2026-05-01T12:00:00Z",
    "file_bytes": 1843220,
    "driver": "GTiff",
    "rows": 643,
    "cols": 1197,
    "cells": 769671,
    "cell_east_m": 30.0,
    "cell_north_m": 30.0,
    "bounds_of_posts_m": {"west": 380000.0, "south": 3787000.0, "east": 415880.0, "north": 3806260.0},
    "crs": "EPSG:32611",
    "crs_name": "WGS 84 / UTM zone 11N",
    "crs_wkt": None,
    "crs_proj": "+proj=utm +zone=11 +datum=WGS84 +units=m +no_defs +type=crs",
    "transform": [30.0, 0.0, 379985.0, 0.0, -30.0, 3806275.0],
    "bounds_deg": {"west": -118.304, "south": 34.22, "east": -117.911, "north": 34.397},
    "body": "Earth",
    "grid_north_deg": -0.62,
    "vertical_datum": None,
    "heights_count_from": "unknown",
    "lowest_m": 315.0,
    "highest_m": 2295.0,
    "unknown_posts": 0,
    "conversions": [],
    "warnings": [],
    "sha256": "0f3c2d1e5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d110f3c2d1e5b1f0c3e9f7a4d0c",
    "links": {
        "self": "/dems/5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11",
        "hillshade": "/dems/5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11/hillshade.png",
        "levels": "/dems/5b1f0c3e9f7a4d0c8a3f6f0b6f0e2d11/levels",
    },
}


class BoundsDegrees(BaseModel):
    """Longitudes and latitudes that hold all posts; east runs beyond 180 over the antimeridian."""

    west: float = Field(description="Smallest longitude, degrees.")
    south: float = Field(description="Smallest latitude, degrees.")
    east: float = Field(description="Largest longitude, degrees.")
    north: float = Field(description="Largest latitude, degrees.")


class RasterOut(BaseModel):
    """A raster that stays in its file, which window maps read by windows."""

    name: str = Field(description="Name of the file.")
    rows: int = Field(description="Rows of posts, north to south.")
    cols: int = Field(description="Columns of posts, west to east.")
    cell_east_m: float = Field(description="Distance between neighbouring posts eastwards, metres.")
    cell_north_m: float = Field(description="Distance between neighbouring posts northwards, metres.")


class _Shelved(BaseModel):
    """What a DEM is on the shelf, whatever ground it holds."""

    id: str = Field(description="Names the DEM in requests; the same file read the same way has the same id.")
    created_at: datetime = Field(description="When it was uploaded first.")
    file_bytes: int | None = Field(
        description="Size of the file, or of all tiles, bytes; null for a bundled DEM and for ground of the library."
    )
    driver: str = Field(description="Format that the file was read as.")


class DemOut(BareGround, _Shelved):
    """An uploaded DEM: what was read, what was converted, and every warning.

    Records of older Sightlines told less: what they lack is null, or is called unknown.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [EXAMPLE]})

    cells: int = Field(description="Rows times columns.")
    crs_wkt: str | None = Field(None, description="The CRS as WKT2 (ISO 19162:2019); null for a local frame.")
    crs_proj: str | None = Field(
        None, description="The CRS as a PROJ string, where one can say it; null for a local frame."
    )
    transform: list[float] = Field(
        description="a, b, c, d, e, f of x = a·col + b·row + c and y = d·col + e·row + f, metres, for cell corners.",
    )
    bounds_deg: BoundsDegrees | None = Field(
        None, description="The bounds in longitude and latitude, degrees; null for a local frame."
    )
    lowest_m: float | None = Field(description="Lowest known height, metres; null when all is unknown.")
    highest_m: float | None = Field(description="Highest known height, metres; null when all is unknown.")
    overview_of: RasterOut | None = Field(
        None, description="Of a tile: the raster that this is the overview of, whose posts window maps read."
    )
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    links: dict[str, str] = Field(description="Paths of what belongs to it.")

    @classmethod
    def of(cls, dem: DemRecord) -> Self:
        """The DEM of a record."""
        own = {
            "id": dem.id,
            "name": dem.name,
            "created_at": datetime.fromtimestamp(dem.created_at_s, UTC),
            "links": {
                "self": rooted(f"/dems/{dem.id}"),
                "hillshade": rooted(f"/dems/{dem.id}/hillshade.png"),
                "levels": rooted(f"/dems/{dem.id}/levels"),
            },
        }
        lacking = {"crs_name": dem.summary.get("crs") or "local frame", "transform": [0.0] * 6}
        told = cls.model_validate({**own, **lacking, **dem.summary})
        return told.model_copy(update={"transform": _transform(told)})


def _transform(dem: DemOut) -> list[float]:
    """The transform of any DEM, also of one that an older Sightline read and told less about."""
    east_m, north_m, bounds = dem.cell_east_m, dem.cell_north_m, dem.bounds_of_posts_m
    return [east_m, 0.0, bounds.west - east_m / 2.0, 0.0, -north_m, bounds.north + north_m / 2.0]


class DemUnderWay(BaseModel):
    """A DEM that is being made from the ground library or a source."""

    id: str = Field(description="Names the DEM once it is made, and its making until then.")
    status: Literal["running", "cancelled"] = Field(
        description="running: it waits or is made; cancelled: it was ended."
    )
    progress: float = Field(ge=0.0, le=1.0, description="Finished share, 0..1.")
    created_at: datetime = Field(description="When it was asked for.")
    links: dict[str, str] = Field(description="Paths of what belongs to it; self is the DEM once it is made.")

    @classmethod
    def of(cls, ground: GroundUnderWay) -> Self:
        """How one stands."""
        return cls(
            id=ground.dem_id,
            status="cancelled" if ground.making.cancelled() else "running",
            progress=min(max(ground.progress, 0.0), 1.0),
            created_at=datetime.fromtimestamp(ground.since_s, UTC),
            links={"self": rooted(f"/dems/{ground.dem_id}")},
        )


class DemList(Page):
    """One page of DEMs, newest first."""

    dems: list[DemOut]
