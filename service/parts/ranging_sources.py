"""What is ranged to: the anchors and satellites of a request in the grid's frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from gnss import Place, parse_almanac, parse_rinex_navigation
from service.parts.map_facts import curvature_of
from service.parts.positioning import CeilingParameters, PositioningParameters, RangingParameters, SatellitesIn
from service.parts.positions import resolve_anchor
from service.parts.sight import SightParameters
from terrain import ElevationGrid, height_at
from visibility import (
    Anchor,
    DistantAnchor,
    FlightLimit,
    MinimumVisibleAltitude,
    check_anchors,
    min_visible_altitude,
)
from visibility.air.morphing_maps import check_ceiling
from visibility.dilution.columns_of_air import sources_of_anchors
from visibility.dilution.flight_limits import check_geometry
from visibility.satellites import SatelliteEyes, satellite_eyes
from visibility.satellites.in_view import Constellation

__all__ = [
    "RangingSources",
    "Source",
    "check_sources",
    "eyes_of",
    "limit_of",
    "lines_to",
    "ranging_sources",
    "sight_lines",
    "source_summary",
]

Source = Anchor | DistantAnchor


@dataclass(frozen=True, slots=True)
class RangingSources:
    """The anchors, then the satellites in view; those left out as unhealthy, and sentences about all left out.

    passed_over: what else in the file of orbits was not used.
    """

    all: tuple[Source, ...]
    unhealthy: tuple[str, ...] = ()
    passed_over: tuple[str, ...] = ()

    @property
    def warnings(self) -> tuple[str, ...]:
        """What to know about those left out."""
        unhealthy = (f"Satellites left out as unhealthy: {', '.join(self.unhealthy)}.",) if self.unhealthy else ()
        return (*unhealthy, *self.passed_over)


def ranging_sources(grid: ElevationGrid, parameters: RangingParameters) -> RangingSources:
    """What there is to range to. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in parameters.anchors)
    if parameters.satellites is None:
        return RangingSources(anchors)
    asked = parameters.satellites
    eyes = eyes_of(grid, asked, [asked.time])
    seen = eyes.distant_anchors(ranging_sigma_m=asked.ranging_sigma_m)
    return RangingSources((*anchors, *seen), eyes.view.unhealthy_ids, eyes.view.warnings)


def eyes_of(grid: ElevationGrid, asked: SatellitesIn, times: Sequence[datetime]) -> SatelliteEyes:
    """Where the satellites of a request stand at some times. Raises AlmanacError, FrameError, VisibilityInputError."""
    constellation: Constellation
    if asked.navigation is not None:
        constellation = parse_rinex_navigation(asked.navigation, "the navigation file")
    else:
        constellation = parse_almanac(asked.almanac or "", "the almanac", asked.reference_date)
    place = None if asked.lon_deg is None or asked.lat_deg is None else Place(asked.lon_deg, asked.lat_deg)
    return satellite_eyes(grid, constellation, times, math.radians(asked.cone_deg), place=place)


def limit_of(parameters: PositioningParameters) -> FlightLimit:
    """The limit asked for, as the libraries take it."""
    return FlightLimit(parameters.dop_limit, parameters.measure, parameters.kind, parameters.min_anchors)


def check_sources(grid: ElevationGrid, sources: tuple[Source, ...], parameters: PositioningParameters) -> None:
    """Refuse what no map can be made from: anchors that cannot be used, too few of them, all on one line, no air.

    Raises AnchorError, VisibilityInputError.
    """
    check_anchors(grid, sources)
    check_geometry(limit_of(parameters), sources_of_anchors(sources))
    if isinstance(parameters, CeilingParameters):
        check_ceiling(grid, *parameters.ceiling())


def sight_lines(
    grid: ElevationGrid,
    parameters: PositioningParameters,
    progress: Callable[[float], None] | None,
    share: float,
) -> tuple[MinimumVisibleAltitude, RangingSources]:
    """Minimum visible altitudes of all that is ranged to; they take ``share`` of the progress.

    Raises what ranging_sources and check_sources raise.
    """
    sources = ranging_sources(grid, parameters)
    check_sources(grid, sources.all, parameters)
    return lines_to(grid, sources.all, parameters, None if progress is None else lambda done: progress(share * done)), (
        sources
    )


def lines_to(
    grid: ElevationGrid,
    sources: tuple[Source, ...],
    parameters: SightParameters,
    progress: Callable[[float], None] | None = None,
) -> MinimumVisibleAltitude:
    """Minimum visible altitudes of anchors that were checked, calculated as the request says."""
    return min_visible_altitude(
        grid, sources, parameters.mode, curvature_of(parameters), unknown=parameters.unknown, progress=progress
    )


def source_summary(grid: ElevationGrid, sources: tuple[Source, ...]) -> dict[str, list[dict[str, Any]]]:
    """Where anchors and satellites are, ready for JSON."""
    anchors, satellites = [], []
    for source in sources:
        if isinstance(source, DistantAnchor):
            satellites.append(
                {
                    "id": source.id,
                    "grid_azimuth_deg": math.degrees(source.azimuth_rad),
                    "elevation_deg": math.degrees(source.elevation_rad),
                    "range_m": source.range_m,
                }
            )
            continue
        ground_m = float(height_at(grid, source.east_m, source.north_m))
        anchors.append(
            {
                "id": source.id,
                "east_m": source.east_m,
                "north_m": source.north_m,
                "altitude_m": source.altitude_m,
                "above_ground_m": None if math.isnan(ground_m) else source.altitude_m - ground_m,
            }
        )
    return {"anchors": anchors, "satellites": satellites}
