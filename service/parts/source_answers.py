"""Anchors and satellites as answers tell of them."""

from __future__ import annotations

import math
from collections.abc import Iterable

from pydantic import BaseModel, Field

from terrain import ElevationGrid, height_at
from visibility import Anchor, DistantAnchor

__all__ = ["PlacedAnchor", "PlacedSatellite", "placed_anchors", "placed_satellites"]


class PlacedAnchor(BaseModel):
    """An anchor in the DEM's frame."""

    id: str = Field(description="Name of the anchor.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")
    above_ground_m: float | None = Field(description="Height above known ground, metres.")


class PlacedSatellite(BaseModel):
    """A satellite as the middle of the DEM sees it."""

    id: str = Field(description="Name of the satellite.")
    grid_azimuth_deg: float = Field(description="Clockwise from grid north, degrees.")
    elevation_deg: float = Field(description="Above the horizontal, degrees.")
    range_m: float = Field(description="Distance, metres.")


def placed_anchors(grid: ElevationGrid, sources: Iterable[Anchor | DistantAnchor]) -> list[PlacedAnchor]:
    """Where the anchors among the sources are."""
    placed = []
    for source in sources:
        if isinstance(source, DistantAnchor):
            continue
        ground_m = float(height_at(grid, source.east_m, source.north_m))
        placed.append(
            PlacedAnchor(
                id=source.id,
                east_m=source.east_m,
                north_m=source.north_m,
                altitude_m=source.altitude_m,
                above_ground_m=None if math.isnan(ground_m) else source.altitude_m - ground_m,
            )
        )
    return placed


def placed_satellites(sources: Iterable[Anchor | DistantAnchor]) -> list[PlacedSatellite]:
    """Where the satellites among the sources stand."""
    return [
        PlacedSatellite(
            id=source.id,
            grid_azimuth_deg=math.degrees(source.azimuth_rad),
            elevation_deg=math.degrees(source.elevation_rad),
            range_m=source.range_m,
        )
        for source in sources
        if isinstance(source, DistantAnchor)
    ]
