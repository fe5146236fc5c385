"""What morphing maps over time range to: standing anchors, anchors on tracks, satellites over hours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from service.parts.frames import FramesIn, TrackIn
from service.parts.point_arrays import points_in_grid
from service.parts.positioning import MorphingMapParameters
from service.parts.positions import resolve_anchor
from service.parts.ranging_sources import eyes_of, limit_of
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, VisibilityInputError
from visibility.air.morphing_times import anchors_over
from visibility.satellites import SatelliteTrack, satellite_tracks
from visibility.sight import AnchorTrack

__all__ = ["MovingSources", "check_moving_sources", "moving_sources", "time_of", "track_of"]


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
    standing = tuple(resolve_anchor(grid, anchor) for anchor in parameters.anchors)
    tracks = tuple(track_of(grid, track) for track in parameters.tracks)
    if parameters.satellites is None:
        return MovingSources((*standing, *tracks), (), len(tracks))
    asked, times_s = parameters.satellites, frames.times_s()
    eyes = eyes_of(grid, asked, [time_of(asked.time, time_s) for time_s in times_s])
    sky = satellite_tracks(eyes, times_s, ranging_sigma_m=asked.ranging_sigma_m)
    moving = len(tracks) + len(sky)
    return MovingSources((*standing, *tracks, *sky), eyes.view.unhealthy_ids, moving, eyes.view.warnings)


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


def track_of(grid: ElevationGrid, asked: TrackIn) -> AnchorTrack:
    """The track in the grid's frame. Raises AnchorError, FrameError, VisibilityInputError."""
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
    )
