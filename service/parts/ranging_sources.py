"""What is ranged to: the anchors, tracks and satellites of a request in the grid's frame."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from gnss import Place, parse_almanac, parse_rinex_navigation
from service.parts.anchors import FramesIn, SightParameters, TrackIn
from service.parts.doubts import doubted_anchors
from service.parts.map_facts import curvature_of
from service.parts.positioning import (
    CeilingParameters,
    MorphingMapParameters,
    PositioningParameters,
    RangingParameters,
    SatellitesIn,
)
from service.parts.shapes_in_grid import anchors_in_grid, points_in_grid
from terrain import ElevationGrid
from visibility import (
    Anchor,
    DistantAnchor,
    FlightLimit,
    MinimumVisibleAltitude,
    VisibilityInputError,
)
from visibility.air.morphing_maps import check_ceiling
from visibility.air.morphing_times import anchors_over
from visibility.dilution.dop_questions import check_geometry
from visibility.dilution.sets_in_sight import sources_of_anchors
from visibility.satellites import SatelliteEyes, SatelliteTrack, satellite_eyes, satellite_tracks
from visibility.satellites.in_view import Constellation
from visibility.sight import AnchorTrack, check_anchors
from visibility.signal import min_usable_altitude

__all__ = [
    "MovingSources",
    "RangingSources",
    "Source",
    "check_moving_sources",
    "check_sources",
    "eyes_of",
    "limit_of",
    "lines_to",
    "moving_sources",
    "ranging_sources",
    "sight_lines",
    "time_of",
    "track_of",
]

Source = Anchor | DistantAnchor


@dataclass(frozen=True, slots=True)
class RangingSources:
    """The anchors, then the satellites in view; those left out as unhealthy, and sentences about all left out.

    passed_over: what else in the file of orbits, and what of map doubts, was not used.
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
    anchors, told = doubted_anchors(grid, anchors_in_grid(grid, parameters), parameters.doubts)
    if parameters.satellites is None:
        return RangingSources(anchors, passed_over=told)
    asked = parameters.satellites
    eyes = eyes_of(grid, asked, [asked.time])
    seen = eyes.distant_anchors(ranging_sigma_m=asked.ranging_sigma_m)
    return RangingSources((*anchors, *seen), eyes.view.unhealthy_ids, (*told, *eyes.view.warnings))


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
    *,
    only_above_ground_m: float | None = None,
) -> MinimumVisibleAltitude:
    """Minimum visible, or usable, altitudes of anchors that were checked, calculated as the request says.

    only_above_ground_m: as in ``min_usable_altitude``.
    """
    return min_usable_altitude(
        *(grid, sources, parameters.mode, curvature_of(parameters)),
        unknown=parameters.unknown,
        progress=progress,
        only_above_ground_m=only_above_ground_m,
    )


@dataclass(frozen=True, eq=False)
class MovingSources:
    """Anchors, tracks, then satellites that are in view at some time; those left out as unhealthy.

    moving: how many of them are elsewhere in each frame. passed_over: what else in the file of orbits was not used.
    """

    all: tuple[Anchor | AnchorTrack | SatelliteTrack, ...]
    unhealthy: tuple[str, ...]
    moving: int
    passed_over: tuple[str, ...] = ()


def moving_sources(grid: ElevationGrid, parameters: MorphingMapParameters, frames: FramesIn) -> MovingSources:
    """What there is to range to in these frames.

    Raises AnchorError, FrameError, AlmanacError, VisibilityInputError.
    """
    standing, told = doubted_anchors(grid, anchors_in_grid(grid, parameters), parameters.doubts)
    tracks = tuple(track_of(grid, track, heard=parameters.usable) for track in parameters.tracks)
    if parameters.satellites is None:
        return MovingSources((*standing, *tracks), (), len(tracks), told)
    asked, times_s = parameters.satellites, frames.times_s()
    eyes = eyes_of(grid, asked, [time_of(asked.time, time_s) for time_s in times_s])
    sky = satellite_tracks(eyes, times_s, ranging_sigma_m=asked.ranging_sigma_m)
    moving = len(tracks) + len(sky)
    return MovingSources((*standing, *tracks, *sky), eyes.view.unhealthy_ids, moving, (*told, *eyes.view.warnings))


def check_moving_sources(
    grid: ElevationGrid, parameters: MorphingMapParameters, frames: FramesIn
) -> Sequence[tuple[Anchor | DistantAnchor, ...]]:
    """Who is there in each frame; refuses what no frame can be made from. Raises as moving_sources does."""
    sources = moving_sources(grid, parameters, frames).all
    return anchors_over(grid, sources, frames.times_s(), limit_of(parameters))


def time_of(start: datetime, time_s: float) -> datetime:
    """The instant of a frame. Raises VisibilityInputError beyond the calendar."""
    try:
        return start + timedelta(seconds=time_s)
    except OverflowError as error:
        raise VisibilityInputError(f"{time_s:g} s after {start.isoformat()} lies beyond the calendar.") from error


def track_of(grid: ElevationGrid, asked: TrackIn, *, heard: bool = False) -> AnchorTrack:
    """The track in the grid's frame; heard: with its radio, so that its signal decides.

    Raises AnchorError, FrameError, VisibilityInputError.
    """
    name = asked.id.replace("{", "{{").replace("}", "}}")
    positions_m = points_in_grid(grid, asked.points, f"Point {{}} of track {name}")
    return AnchorTrack(
        asked.id,
        np.array([point.time_s for point in asked.points]),
        positions_m,
        asked.ranging_sigma_m,
        asked.pose_sigma_m,
        asked.antenna_limits(),
        asked.pose_covariance(),
        asked.radio.radio() if heard and asked.radio is not None else None,
    )
