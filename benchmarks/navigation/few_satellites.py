"""A minute with three satellites: fixes, pseudoranges, changes of phase in the inertial filter, on recorded RINEX."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import CubicSpline

from benchmarks.report import Row, Table
from gnss import GpsTime
from gnss.differential import read_observations, read_orbits, receiver_ranges
from gnss.sky import place_of_ecef
from navigation.drives import DriveLog, DriveSettings, Fixes, Readings, Satellites, navigate_drive
from navigation.inertial import IMU_PRESETS, ImuNoise, TangentFrame
from tests.reference.inertial import Drive, along

__all__ = ["few_satellites"]

Array = npt.NDArray[np.float64]
SIMULATED = Path(__file__).resolve().parents[3] / "shared" / "data" / "rtk" / "simulated"
MIDNIGHT = GpsTime.of_utc(datetime(2014, 12, 20, tzinfo=UTC), leap_seconds=0)
# of the recording, seconds from midnight: the rover stands, then drives a circle
BEGIN_S, FEW_S, END_S = 60.0, 200.0, 260.0
FEW = 3
# the recording has no air; lower satellites suffer most from the models that take its delays away
LOWEST_RAD = math.radians(25.0)
WAYS = ("fixes of its codes", "codes", "codes and phases")


class _Recorded(Drive):
    """The circle that was recorded, level, along its course."""

    def __init__(self, times_s: Array, places_m: Array) -> None:
        self.times_s = np.arange(BEGIN_S, END_S + 1e-9, 0.01)
        self.position = CubicSpline(times_s, places_m)
        self.velocity = self.position.derivative()
        fine = np.arange(BEGIN_S - 1.0, END_S + 1.0, 0.1)
        step = self.velocity(fine)
        moves = np.hypot(*step[:, :2].T) > 0.5
        course = np.unwrap(np.arctan2(step[moves, 0], step[moves, 1]))
        heading = CubicSpline(fine, np.interp(fine, fine[moves], course))
        self._angles = heading, lambda t: 0.0 * np.asarray(t), lambda t: 0.0 * np.asarray(t)


def few_satellites(drives: int = 10) -> Table:
    """Errors of a minute with three satellites in sight, by what of them corrects the readings."""
    title, columns = "A minute with three satellites", ("unit", "corrected by", "after the minute, rms", "in it, rms")
    if not SIMULATED.is_dir():
        return Table(title, columns, (Row(("the data are not here", "", "", "")),))
    rows = []
    for grade in ("tactical", "ADIS16405"):
        errors = np.array([[_driven(seed, IMU_PRESETS[grade], way) for way in WAYS] for seed in range(drives)])
        ends, within = np.sqrt((errors**2).mean(axis=0)).T
        for number, way in enumerate(WAYS):
            target, met = ("", None) if number == 0 else ("≤ half of the fixes'", bool(ends[number] <= 0.5 * ends[0]))
            rows.append(Row((grade, way, f"{ends[number]:.1f} m", f"{within[number]:.1f} m"), target, met))
    note = (
        f"The rover of gps-sdr-sim's recorded pair ({END_S - BEGIN_S:.0f} s, 1 Hz, L1), inertial readings made up of "
        f"its true circle, {drives} units each; from {FEW_S - BEGIN_S:.0f} s on the three highest satellites are left. "
        "Fixes are least squares of the same codes, 3 m and what the geometry makes of it."
    )
    return Table(title, columns, tuple(rows), note)


@cache
def _scene() -> tuple[TangentFrame, _Recorded, Array, Array, Satellites]:
    """(frame, drive, forces, rates, what was heard in the frame, with the few from then on)."""
    truth = np.loadtxt(SIMULATED / "rover.csv", delimiter=",")
    place = place_of_ecef(truth[0, 1:])
    frame = TangentFrame(math.radians(place.lat_deg), math.radians(place.lon_deg), place.height_m)
    drive = _Recorded(truth[::10, 0], frame.from_centred_m(truth[::10, 1:]))
    rate = frame.body.rate_rad_per_s * np.array([0.0, math.cos(frame.latitude_rad), math.sin(frame.latitude_rad)])
    forces, rates = drive.readings(lambda at_m: along(frame.gravity_m_per_s2, at_m), rate)
    heard = receiver_ranges(read_observations(SIMULATED / "rover.obs"), read_orbits(SIMULATED / "base.nav"))
    at_s = heard.time_s - MIDNIGHT.week * 604_800.0 - MIDNIGHT.second_of_week
    number = np.unique(heard.satellite, return_inverse=True)[1].astype(np.int64)
    highest = np.argsort([-heard.elevation_rad[number == one].mean() for one in range(number.max() + 1)])[:FEW]
    kept = (at_s >= BEGIN_S) & (at_s <= END_S) & ((at_s < FEW_S) | np.isin(number, highest))
    satellites = Satellites(
        at_s[kept],
        number[kept],
        frame.from_centred_m(heard.position_ecef_m[kept]),
        heard.code_m[kept],
        heard.phase_m[kept],
        heard.arc[kept],
        frame.from_centred_m(heard.place_ecef_m),
    )
    return frame, drive, forces, rates, satellites


def _driven(seed: int, noise: ImuNoise, way: str) -> tuple[float, float]:
    """(error in space after the minute, rms in it)."""
    frame, drive, forces, rates, heard = _scene()
    rng, root = np.random.default_rng(seed), 0.01**0.5
    forces = forces + rng.normal(0.0, noise.force_bias_m_per_s2, 3)
    rates = rates + rng.normal(0.0, noise.rate_bias_rad_per_s, 3)
    forces += rng.normal(0.0, noise.velocity_walk_m_per_s_sqrt_s / root, forces.shape)
    rates += rng.normal(0.0, noise.angle_walk_rad_per_sqrt_s / root, rates.shape)
    heading = float(drive.angles(np.array([BEGIN_S]))[0, 0])
    settings = DriveSettings(
        imu=noise, heading_rad=heading, position_m=(0.0, 0.0, 0.0), least_elevation_rad=LOWEST_RAD, smoother=False
    )
    log = DriveLog(Readings(drive.times_s, forces, rates), satellites=heard)
    if way == "codes":
        settings = replace(settings, phase_sigma_m=0.0)
    elif way != "codes and phases":
        log = replace(log, satellites=None, fixes=_fixes(heard))
    track = navigate_drive(log, settings, frame)
    late = track.times_s >= FEW_S
    off_m = np.linalg.norm(track.position_m[late] - drive.position(track.times_s[late]), axis=1)
    return float(off_m[-1]), float(np.sqrt((off_m**2).mean()))


def _fixes(heard: Satellites) -> Fixes:
    """Least squares of each epoch's codes, of four satellites or more."""
    times, places, sigmas = [], [], []
    away = heard.positions_m - heard.place_m
    high = away[:, 2] > math.sin(LOWEST_RAD) * np.linalg.norm(away, axis=1)
    for time_s in np.unique(heard.times_s).tolist():
        rows = (heard.times_s == time_s) & np.isfinite(heard.codes_m) & high
        if rows.sum() < 4:
            continue
        state = np.append(heard.place_m, np.median(heard.codes_m[rows]) - 2.2e7)
        table = np.empty((0, 4))
        for _ in range(8):
            away = state[:3] - heard.positions_m[rows]
            length = np.linalg.norm(away, axis=1)
            table = np.column_stack([away / length[:, None], np.ones(len(away))])
            state = state + np.linalg.lstsq(table, heard.codes_m[rows] - length - state[3], rcond=None)[0]
        times.append(time_s)
        places.append(state[:3])
        sigmas.append(3.0 * np.sqrt(np.diag(np.linalg.inv(table.T @ table))[:3]))
    nothing = np.full((len(times), 3), np.nan)
    return Fixes(np.array(times), np.array(places), np.array(sigmas), nothing, nothing)
