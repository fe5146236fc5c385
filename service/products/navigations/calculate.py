"""A drive's log, navigated over a map, as the service answers it."""

from __future__ import annotations

import functools
import importlib.metadata
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field, JsonValue

from navigation import Verdict
from navigation.drives import SOURCES
from planning.bubbles import way_m
from planning.driving import DriveOverMap, navigate_over_map
from planning.watching import GroundErrors
from service.files.mission_files import mission_warnings
from service.parts.cover import notes_on_cover
from service.parts.map_area import map_area
from service.parts.map_facts import Ground, curvature_of, ground_of
from service.parts.positioning_answers import PlacedAnchor, placed_anchors
from service.parts.sentences import told_as_asked
from service.products import UNWATCHED, Work
from service.products.in_common import QUANTILES
from terrain import ElevationGrid, height_at
from visibility import Anchor

from .request import NavigationParameters, drive_of

__all__ = ["DrivePlaceOut", "FinishedNavigation", "NavigationSummary", "SourceOut", "calculate_navigation"]

Array = npt.NDArray[np.float64]
DECIMALS = 6


class DrivePlaceOut(BaseModel):
    """Where the unit was at one time, along the axes of the DEM's frame."""

    time_s: float = Field(description="When, seconds.")
    distance_m: float = Field(description="Way up to here, metres.")
    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Altitude in the DEM's vertical datum, metres.")
    east_m_per_s: float = Field(description="Velocity east, m/s.")
    north_m_per_s: float = Field(description="Velocity north, m/s.")
    up_m_per_s: float = Field(description="Velocity up, m/s.")
    heading_deg: float = Field(description="Of the nose, degrees clockwise from grid north.")
    pitch_deg: float = Field(description="Nose up, degrees.")
    roll_deg: float = Field(description="Right side down, degrees.")
    sigma_east_m: float = Field(description="One sigma east, metres.")
    sigma_north_m: float = Field(description="One sigma north, metres.")
    sigma_up_m: float = Field(description="One sigma of the altitude, metres.")
    radius_m: float = Field(description="Radius of the safety bubble, metres.")


class SourceOut(BaseModel):
    """What became of the measurements of one kind; a fix is three, and so is zero velocity."""

    source: str = Field(
        description="range, position, velocity, standstill, speed, sideways, ground, pseudorange, phase."
    )
    measurements: int = Field(description="How many numbers there were.")
    used: int = Field(description="How many were used.")
    gated: int = Field(description="How many lay too far off to be believed.")
    left_out: int = Field(description="How many were left out before: not measured, or hidden by the map.")
    mean_nis: float | None = Field(
        description="Mean of their squared innovations by their variances, no unit, 1 where both are right; null: none."
    )


class NavigationSummary(BaseModel):
    """The drive in numbers, and how far to trust them."""

    readings: int = Field(description="Number of inertial readings.")
    places: int = Field(description="Number of places that are told.")
    from_s: float = Field(description="The first of them, seconds.")
    to_s: float = Field(description="The last of them, seconds.")
    way_m: float = Field(description="Way between the first and the last, metres.")
    smoothed: bool = Field(description="Whether each place is told by the whole log, or by what came before it.")
    radius_quantiles_m: dict[str, float] = Field(description="p05, p50 and p95 of the bubble's radius, metres.")
    epsilon: float = Field(description="How many sigmas the radius is, no unit.")
    sources: list[SourceOut] = Field(description="What corrected the readings.")
    hidden_ranges: int | None = Field(
        description="Number of ranges that the map left out; null where it was not asked or knew nothing."
    )
    force_bias_m_per_s2: tuple[float, float, float] = Field(
        description="What the accelerometers read too much at the end: forward, left, up, m/s²."
    )
    rate_bias_deg_per_s: tuple[float, float, float] = Field(
        description="What the gyros read too much at the end, degrees per second."
    )
    lever_arm_m: tuple[float, float, float] = Field(description="From the unit to the antenna, at the end, metres.")
    error_statement: str | None = Field(None, description="Null: the sigmas of the places are their errors.")
    curvature: str | None = Field(description="Curvature and refraction of sight lines, in words.")
    dem: Ground
    anchors: list[PlacedAnchor]
    warnings: list[str] = Field(description="What to know before trusting it, in sentences.")
    timing: dict[str, float] = Field(description="Seconds that parts of the calculation took.")
    version: str = Field(description="Version of Sightline that calculated it.")


@dataclass(frozen=True, eq=False)
class FinishedNavigation:
    """A navigated drive; rows: (p,) which readings of its track are told. fixes_m: (n, 3) of the log, in the grid."""

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: NavigationParameters
    answer: NavigationSummary
    drive: DriveOverMap
    rows: npt.NDArray[np.intp]
    fixes_m: Array

    def numbers(self) -> dict[str, Array]:
        """The fields of ``DrivePlaceOut``, (p,) each."""
        drive, rows = self.drive, self.rows
        places, velocities = drive.place_m[rows], drive.velocity_m_per_s[rows]
        sigmas = np.sqrt(np.diagonal(drive.covariance_m2[rows], axis1=1, axis2=2))
        pitch_roll = np.degrees(drive.track.angles_rad[rows, 1:])
        columns = [
            drive.track.times_s[rows],
            way_m(drive.place_m)[rows],
            *places.T,
            *velocities.T,
            np.degrees(drive.heading_rad[rows]),
            *pitch_roll.T,
            *sigmas.T,
            drive.track.radius_m[rows],
        ]
        return dict(zip(DrivePlaceOut.model_fields, columns, strict=True))

    @functools.cached_property
    def points(self) -> list[dict[str, JsonValue]]:
        """One entry for each place, as ``DrivePlaceOut`` has it."""
        columns: dict[str, list[Any]] = {
            name: np.round(values, DECIMALS).tolist() for name, values in self.numbers().items()
        }
        return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


@told_as_asked
def calculate_navigation(
    grid: ElevationGrid, parameters: NavigationParameters, work: Work = UNWATCHED
) -> FinishedNavigation:
    """The drive that is asked for.

    Raises AnchorError, AreaError, FrameError, MeasurementError, StateError, TimeOrderError, RequestError, GnssError.
    """
    started_s = time.perf_counter()
    area = map_area(grid, parameters.area)
    log, anchors, told = drive_of(grid, parameters)
    settings = parameters.settings.settings()
    drive = navigate_over_map(
        grid,
        log,
        settings,
        anchors,
        ask_the_map=parameters.ask_the_map,
        errors=GroundErrors(parameters.dem_sigma_m),
        curvature=curvature_of(parameters),
        latitude_deg=parameters.lat_deg,
        progress=work.progress,
    )
    track, rows = drive.track, _told(drive.track.times_s, parameters.interval_s)
    filtered = track.filtered
    hidden = None if drive.sight is None else int(np.count_nonzero(drive.sight < settings.least_sight))
    of_ground = (*grid.provenance.warnings, *notes_on_cover(grid), *area.sentences())
    off = _off_the_map(grid, drive.place_m[rows]) if parameters.ask_the_map else ()
    warnings = (*of_ground, *mission_warnings("navigation", grid), *told, *drive.warnings, *off)
    answer = NavigationSummary(
        readings=len(track.imu.times_s),
        places=len(rows),
        from_s=float(track.times_s[0]),
        to_s=float(track.times_s[-1]),
        way_m=float(way_m(drive.place_m)[-1]),
        smoothed=track.smoothed,
        radius_quantiles_m={name: float(np.quantile(track.radius_m, share)) for name, share in QUANTILES.items()},
        epsilon=settings.epsilon,
        sources=_sources(drive),
        hidden_ranges=hidden,
        force_bias_m_per_s2=_three(filtered.force_bias_m_per_s2[-1]),
        rate_bias_deg_per_s=_three(np.degrees(filtered.rate_bias_rad_per_s[-1])),
        lever_arm_m=_three(filtered.lever_arm_m),
        error_statement=None,
        curvature=None if drive.sight is None else _curvature(grid, parameters),
        dem=ground_of(area.box),
        anchors=placed_anchors(grid, anchors),
        warnings=list(dict.fromkeys(warnings)),
        timing={"calculation_s": time.perf_counter() - started_s},
        version=importlib.metadata.version("sightline"),
    )
    work.progress(1.0)
    fixes_m = np.empty((0, 3)) if log.fixes is None else log.fixes.positions_m
    return FinishedNavigation(area.box, anchors, parameters, answer, drive, rows, fixes_m)


def _off_the_map(grid: ElevationGrid, places_m: Array) -> tuple[str, ...]:
    """Where a map that knows something was asked and does not reach, in words."""
    off = int(np.isnan(height_at(grid, places_m[:, 0], places_m[:, 1])).sum())
    if not off or np.isnan(grid.heights_m).all():
        return ()
    return (f"{off} of {len(places_m)} places lie off the DEM or on its unknown ground: it tells nothing there.",)


def _told(times_s: Array, interval_s: float) -> npt.NDArray[np.intp]:
    """The first reading of each interval, and the last of all."""
    steps = np.floor((times_s - times_s[0]) / interval_s + 1e-9)
    first = np.flatnonzero(np.diff(steps, prepend=-1.0) > 0.0)
    return np.unique(np.append(first, len(times_s) - 1))


def _sources(drive: DriveOverMap) -> list[SourceOut]:
    track = drive.track
    squared = track.filtered.innovation**2 / track.filtered.innovation_variance
    found = []
    for number, name in enumerate(SOURCES):
        verdicts = track.filtered.verdict[track.measurements.source == number]
        if not len(verdicts):
            continue
        taken = (track.measurements.source == number) & (track.filtered.verdict == Verdict.USED)
        found.append(
            SourceOut(
                source=name,
                measurements=len(verdicts),
                used=int(np.isin(verdicts, (Verdict.USED, Verdict.REACQUIRED)).sum()),
                gated=int((verdicts == Verdict.GATED).sum()),
                left_out=int((verdicts == Verdict.LEFT_OUT).sum()),
                mean_nis=float(squared[taken].mean()) if taken.any() else None,
            )
        )
    return found


def _curvature(grid: ElevationGrid, parameters: NavigationParameters) -> str:
    from visibility import Curvature

    return Curvature.over(grid, curvature_of(parameters)).sentence()


def _three(values: Array) -> tuple[float, float, float]:
    first, second, third = values.tolist()
    return first, second, third
