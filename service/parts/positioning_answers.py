"""What answers about positioning have in common: anchors and satellites in their places, the limit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from pydantic import BaseModel, Field

from service.parts.map_facts import MapSummary, preamble
from service.parts.positioning import ORBIT_TEXTS, PositioningParameters
from service.parts.ranging_sources import RangingSources
from terrain import ElevationGrid, height_at
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude
from visibility.sight import AnchorTrack

__all__ = [
    "PlacedAnchor",
    "PlacedSatellite",
    "PositioningSummary",
    "placed_anchors",
    "placed_satellites",
    "positioning_summary",
    "range_sigmas_told",
]


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


def range_sigmas_told(sources: Iterable[Anchor | DistantAnchor | AnchorTrack]) -> str:
    """The one-sigma errors that errors in metres stand on: of ranges, and of the anchors' own places.

    Such as ``0.1 m to anchors, 1 m to satellites``; empty without sources.
    """
    near: list[Anchor | AnchorTrack] = []
    far: list[DistantAnchor] = []
    for source in sources:
        if isinstance(source, DistantAnchor):
            far.append(source)
        else:
            near.append(source)
    told = [
        f"{_from_to([one.ranging_sigma_m for one in kind])} to {name}"
        for name, kind in (("anchors", near), ("satellites", far))
        if kind
    ]
    if any(one.pose_covariance_m2 is not None for one in near):
        told.append("anchors' places as their covariances say")
    elif any(one.pose_sigma_m > 0.0 for one in near):
        told.append(f"anchors' places {_from_to([one.pose_sigma_m for one in near])} per axis")
    return ", ".join(told)


def _from_to(sigmas_m: Sequence[float]) -> str:
    least_m, most_m = min(sigmas_m), max(sigmas_m)
    return f"{least_m:g} m" if least_m == most_m else f"{least_m:g} to {most_m:g} m"


class PositioningSummary(MapSummary):
    """What maps of positioning have in common."""

    kind: str = Field(description="What is measured: ranging, pseudorange or tdoa.")
    measure: str = Field(description="Which dilution of precision.")
    dop_limit: float = Field(description="From this dilution on positioning is not good enough, no unit.")
    anchors: list[PlacedAnchor]
    satellites: list[PlacedSatellite]
    unhealthy_satellites: list[str] = Field([], description="Ids of satellites that were left out as unhealthy.")


def positioning_summary(
    lines: MinimumVisibleAltitude,
    sources: RangingSources,
    parameters: PositioningParameters,
    elapsed_s: float,
    warnings: Sequence[str] = (),
) -> PositioningSummary:
    """What is told of a map from these sight lines; of what was asked, all that is not long.

    elapsed_s, warnings: of the calculation that followed them, besides their own.
    """
    return PositioningSummary(
        **preamble(
            *(lines.grid, parameters, lines, (*lines.warnings, *warnings, *sources.warnings)),
            mode=parameters.mode,
            unknown=parameters.unknown,
            besides={"satellites": set(ORBIT_TEXTS), "path": True, "tracks": True},
        ),
        timing={"calculation_s": lines.elapsed_s + elapsed_s},
        kind=parameters.kind,
        measure=parameters.measure,
        dop_limit=parameters.dop_limit,
        anchors=placed_anchors(lines.grid, lines.anchors),
        satellites=placed_satellites(lines.anchors),
        unhealthy_satellites=list(sources.unhealthy),
    )
