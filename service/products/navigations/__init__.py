"""Navigated drives as a product."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from navigation.drives import DriveLog, DriveSettings, Fixes, Ranges, Readings
from navigation.drives.logs import imu_of
from planning.driving import map_frame, navigate_over_map
from service.estimates import Demand, calculation
from service.parts.map_area import map_area
from service.products import Inline, Product, WarmUp
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor

from .calculate import DrivePlaceOut, NavigationSummary, calculate_navigation
from .files import LAYERS
from .receiver import check_files
from .request import REQUEST, NavigationIn, NavigationParameters, readings_of

__all__ = ["NAVIGATION"]

REQUEST_FILE = "request.json"
LONG = ("readings", "fixes", "ranges", "speeds")
# states after each reading, covariances of those with measurements; a reading twelve times where headings are tried
BYTES_PER_READING, SECONDS_PER_READING = 3000, 3e-4
# of observations, some 30 characters of which are a row
BYTES_PER_CHARACTER, SECONDS_PER_CHARACTER = 50, 5e-6


def _estimate(grid: ElevationGrid, asked: NavigationParameters) -> list[Demand]:
    count = len(asked.readings.times_s)
    told = f"{count:,} readings"
    heard = 0 if asked.satellites is None else len(asked.satellites.observations)
    of_log = calculation(
        told if not heard else f"{told} and {heard:,} characters of RINEX",
        count * BYTES_PER_READING + heard * BYTES_PER_CHARACTER,
        count * SECONDS_PER_READING + heard * SECONDS_PER_CHARACTER,
        "a shorter log",
    )
    return [Demand("max_anchors", len(asked.anchors), f"{len(asked.anchors)} anchors are"), *of_log]


def _check(grid: ElevationGrid, asked: NavigationParameters, settings: Settings) -> None:
    map_area(grid, asked.area)
    drive = asked.settings.settings()
    west_m, south_m, east_m, north_m = grid.bounds_m
    frame = map_frame(grid, ((west_m + east_m) / 2.0, (south_m + north_m) / 2.0, 0.0), asked.lat_deg)
    gravity = float(np.linalg.norm(frame.tangent.gravity_m_per_s2()))
    imu_of(DriveLog(readings_of(asked)), drive, gravity)
    if asked.satellites is not None:
        check_files(asked.satellites)


def _small_drive(grid: ElevationGrid) -> None:
    times_s = np.arange(0.0, 3.0, 0.1)
    readings = Readings(times_s, np.tile((0.0, 0.0, 9.8), (len(times_s), 1)), np.zeros((len(times_s), 3)))
    anchors = [Anchor("A", 100.0, -200.0, 90.0), Anchor("B", 0.0, -50.0, 90.0), Anchor("C", 150.0, 0.0, 120.0)]
    at_s = np.array([1.0, 2.0])
    nothing = np.full((2, 3), np.nan)
    places_m = np.tile((10.0, -10.0, 60.0), (2, 1))
    fixes = Fixes(at_s, places_m, nothing, np.zeros((2, 3)), nothing)
    ranges = Ranges(at_s, np.array([0, 1]), np.array([210.0, 50.0]), np.full(2, np.nan))
    for more in ({"smoother": False}, {"antenna_above_ground_m": 1.0, "standstill_sigma_m_per_s": 0.1}):
        settings = DriveSettings(heading_rad=0.0, sideways_sigma_m_per_s=0.1, **more)
        navigate_over_map(grid, DriveLog(readings, fixes, ranges), settings, anchors)


def _pack(grid: ElevationGrid, asked: NavigationParameters, folder: Path) -> dict[str, JsonValue]:
    """What is asked with the numbers of what is long; the whole of it goes into the folder."""
    folder.mkdir(parents=True)
    (folder / REQUEST_FILE).write_text(asked.model_dump_json(exclude_none=True), encoding="utf-8")
    counts = {name: len(getattr(asked, name)) for name in LONG[1:]}
    packed: dict[str, JsonValue] = {
        **asked.model_dump(mode="json", exclude_none=True, exclude={*LONG, "satellites"}),
        "readings": len(asked.readings.times_s),
        **counts,
    }
    if asked.satellites is not None:
        packed["satellites"] = len(asked.satellites.observations)
    return packed


def _unpack(packed: Mapping[str, JsonValue], folder: Path) -> NavigationParameters:
    return NavigationParameters.model_validate_json((folder / REQUEST_FILE).read_bytes())


NAVIGATION = Product(
    name="navigation",
    title="navigation",
    plural="navigations",
    model="Navigation",
    tag="Navigations",
    summary="Where a vehicle was on a drive, by its inertial unit and what corrects it.",
    about="The log of a drive, navigated: inertial readings corrected by fixes, ranges to anchors, an odometer and "
    "what the map knows; places with their sigmas, biases, and what became of each measurement.",
    asked=NavigationIn,
    parameters=NavigationParameters,
    answer=NavigationSummary,
    example=REQUEST,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_small_drive),),
    calculate=calculate_navigation,
    layers=LAYERS,
    pack=_pack,
    unpack=_unpack,
    long_body=True,
    inline=Inline("points", "points.json", DrivePlaceOut, "One entry per place; null until it succeeded."),
)
