"""A drive's log navigated over a map: the map tells which ranges to believe and how high the ground is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from navigation import StateError
from navigation.drives import DriveLog, DriveSettings, DriveTrack, Fixes, Foreseen, Ranges, navigate_drive
from navigation.inertial import Measurements, ground_heights
from planning.watching import GroundErrors, forecast_sight
from terrain import ElevationGrid
from visibility import Anchor, Curvature, lines_of_sight

from .frames import MapFrame, map_frame
from .receivers import framed_satellites, receiver_place_m, sky_of_drive

__all__ = ["DriveOverMap", "navigate_over_map"]

Array = npt.NDArray[np.float64]
# the map is asked so often, and again about the track that it made
ASKED_EVERY_S, ROUNDS = 1.0, 2


@dataclass(frozen=True, eq=False)
class DriveOverMap:
    """A drive in the grid's frame, at n readings of its track.

    place_m: (n, 3) east, north, altitude; velocity_m_per_s (n, 3) and covariance_m2 (n, 3, 3) along the grid's axes;
    heading_rad: (n,) clockwise from grid north. sight: (r,) that the map gave each range, NaN = not known, None = no
    map was asked.
    """

    track: DriveTrack
    frame: MapFrame
    place_m: Array
    velocity_m_per_s: Array
    covariance_m2: Array
    heading_rad: Array
    sight: Array | None
    warnings: tuple[str, ...]


def navigate_over_map(
    grid: ElevationGrid,
    log: DriveLog,
    settings: DriveSettings,
    anchors: Sequence[Anchor] = (),
    *,
    ask_the_map: bool = True,
    errors: GroundErrors | None = None,
    curvature: Curvature | None = None,
    latitude_deg: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> DriveOverMap:
    """Navigate through a log whose places (fixes, settings.position_m) and headings are those of the grid.

    Velocities of fixes are true east, north, up, as receivers tell them; places of satellites are ECEF. anchors: that
    ranges are numbered by; ranges without a sigma have that of their anchor. ask_the_map: first without it, then with
    what it says of that track: probabilities of sight, which satellites the ground hides, and its height where
    antenna_above_ground_m is given. Over unknown ground it says nothing. errors: of the map. Raises MeasurementError,
    StateError, TimeOrderError, FrameError.
    """
    anchors_m = np.array([(one.east_m, one.north_m, one.altitude_m) for one in anchors]).reshape(-1, 3)
    frame = map_frame(grid, _origin(grid, log, settings, anchors_m), latitude_deg)
    framed, assumed = _framed(grid, log, anchors, anchors_m, frame)
    asked = replace(
        settings,
        heading_rad=None if settings.heading_rad is None else settings.heading_rad + frame.grid_north_rad,
        position_m=None if settings.position_m is None else tuple(frame.to_frame(settings.position_m)[0].tolist()),
    )
    track, foreseen = navigate_drive(framed, asked, frame.tangent), Foreseen()
    told: list[str] = []
    if ask_the_map:
        for number in range(ROUNDS):
            if progress is not None:
                progress((1.0 + number) / (1.0 + ROUNDS))
            wrong_by = errors or GroundErrors()
            foreseen, told = _foreseen(grid, framed, asked, anchors_m, frame, track, wrong_by, curvature)
            if foreseen.sight is None and foreseen.heights is None and foreseen.sky is None:
                break
            track = navigate_drive(framed, asked, frame.tangent, foreseen)
    turn = frame.turn
    return DriveOverMap(
        track,
        frame,
        frame.to_grid(track.position_m),
        track.velocity_m_per_s @ turn.T,
        turn @ track.position_covariance_m2 @ turn.T,
        (track.angles_rad[:, 0] - frame.grid_north_rad) % (2.0 * np.pi),
        foreseen.sight,
        (*frame.warnings, *assumed, *told, *track.told),
    )


def _origin(grid: ElevationGrid, log: DriveLog, settings: DriveSettings, anchors_m: Array) -> Array:
    """Where the frame touches the ground: the beginning, the first fix, or amid the anchors."""
    if settings.position_m is not None:
        return np.array(settings.position_m)
    if log.fixes is not None:
        known = log.fixes.positions_m[~np.isnan(log.fixes.positions_m).any(axis=1)]
        if len(known):
            return np.array(known[0])
    if log.satellites is not None:
        return receiver_place_m(grid, log.satellites)
    if not len(anchors_m):
        raise StateError("Neither fixes nor anchors tell where the drive is; give the position at its beginning.")
    return np.array(anchors_m.mean(axis=0))


def _framed(
    grid: ElevationGrid, log: DriveLog, anchors: Sequence[Anchor], anchors_m: Array, frame: MapFrame
) -> tuple[DriveLog, tuple[str, ...]]:
    """(the log in the frame, what was assumed)."""
    fixes, ranges, satellites, told = log.fixes, log.ranges, log.satellites, tuple[str, ...]()
    if fixes is not None:
        fixes = Fixes(
            fixes.times_s,
            frame.to_frame(fixes.positions_m),
            fixes.position_sigmas_m,
            fixes.velocities_m_per_s,
            fixes.velocity_sigmas_m_per_s,
        )
    if ranges is not None and len(ranges.times_s):
        own = np.array([np.hypot(one.ranging_sigma_m, one.pose_sigma_m) for one in anchors])[ranges.anchor]
        sigmas = np.where(np.isnan(ranges.sigmas_m), np.where(own > 0.0, own, np.nan), ranges.sigmas_m)
        ranges = Ranges(ranges.times_s, ranges.anchor, ranges.measured_m, sigmas)
    if satellites is not None:
        satellites, told = framed_satellites(grid, satellites, frame)
    return DriveLog(log.readings, fixes, ranges, log.speeds, frame.to_frame(anchors_m), satellites), told


def _foreseen(
    grid: ElevationGrid,
    log: DriveLog,
    settings: DriveSettings,
    anchors_m: Array,
    frame: MapFrame,
    track: DriveTrack,
    errors: GroundErrors,
    curvature: Curvature | None,
) -> tuple[Foreseen, list[str]]:
    """What the map says of a track, and sentences about it."""
    steps = np.flatnonzero(np.diff(np.floor(track.times_s / ASKED_EVERY_S), prepend=-np.inf) > 0.0)
    at_s, places_m = track.times_s[steps], frame.to_grid(track.position_m[steps])
    covariances_m2 = frame.turn @ track.position_covariance_m2[steps] @ frame.turn.T
    sight = np.full((len(steps), len(anchors_m)), np.nan)
    heights, antenna_m = None, settings.antenna_above_ground_m
    if antenna_m is None:
        if len(anchors_m):
            starts, ends = np.repeat(places_m, len(anchors_m), axis=0), np.tile(anchors_m, (len(steps), 1))
            seen = lines_of_sight(grid, starts, ends, curvature=curvature, dem_sigma_m=errors.dem_sigma_m)
            assert seen.probability_clear is not None, "it was asked for"
            sight = seen.probability_clear.reshape(sight.shape)
    else:
        rows = []
        for number, (place_m, covariance_m2) in enumerate(zip(places_m, covariances_m2, strict=True)):
            found = forecast_sight(
                grid, place_m, covariance_m2, anchors_m, antenna_m, errors=errors, curvature=curvature
            )
            if found is not None:
                sight[number] = found.p_sight
                ground = found.ground
                slopes = ground.slope_east, ground.slope_north
                rows.append((at_s[number], ground.east_m, ground.north_m, ground.altitude_m, *slopes, ground.sigma_m))
        heights = _heights(np.array(rows), frame, errors, settings.gate_sigma) if rows else None
    told: list[str] = []
    sky: Array | None = None
    if log.satellites is not None:
        sky = sky_of_drive(grid, log.satellites, frame, at_s, places_m, antenna_m)
        hidden = int(np.count_nonzero(sky == 0.0))
        if hidden:
            told.append(f"Of {len(sky)} measurements of satellites {hidden} were left out, for the ground hides those.")
    if antenna_m is not None and heights is None:
        told.append("The map knows no ground where the drive went; neither height nor sight were taken from it.")
    if log.ranges is None or not len(log.ranges.times_s) or np.isnan(sight).all():
        return Foreseen(None, heights, sky), told
    between = (at_s[1:] + at_s[:-1]) / 2.0
    of_range = sight[np.searchsorted(between, log.ranges.times_s), log.ranges.anchor]
    unknown = int(np.count_nonzero(np.isnan(of_range)))
    if unknown:
        told.append(f"Ranges of which the map does not know whether they were in sight, believed: {unknown}.")
    return Foreseen(of_range, heights, sky), told


def _heights(rows: Array, frame: MapFrame, errors: GroundErrors, gate_sigma: float) -> Measurements:
    """Measurements of the antenna's height; rows: time, east, north, altitude, slopes east and north, sigma.

    The ground errs alike over a stretch: of several heights within it each counts as a part of one.
    """
    places = frame.to_frame(rows[:, 1:4])
    steps_m = np.linalg.norm(np.diff(places[:, :2], axis=0), axis=1)
    apart_m = np.concatenate([steps_m, steps_m[-1:]]) if len(steps_m) else np.array([errors.correlation_m])
    alike = np.clip(errors.correlation_m / np.maximum(apart_m, 1e-9), 1.0, len(rows))
    slopes = rows[:, 4:6] @ frame.turn[:2, :2]
    return ground_heights(
        rows[:, 0],
        places[:, 2],
        rows[:, 6] * np.sqrt(alike),
        slopes=slopes,
        places_m=places[:, :2],
        gate_sigma=gate_sigma,
    )
