"""A real rover without fixes for a minute: what standing still and not sliding are worth."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.io import loadmat

from benchmarks.report import Row, Table
from navigation.drives import DriveLog, DriveSettings, Fixes, Readings, navigate_drive
from navigation.inertial import ImuNoise, StandstillRule, TangentFrame, matrices_of

__all__ = ["rover_outages"]

Array = npt.NDArray[np.float64]
FOLDER = Path(__file__).resolve().parents[3] / "shared" / "data" / "ins" / "navego_canada_rover"
OUTAGE_S, BEGINNINGS_S = 60.0, (100.0, 140.0, 180.0, 220.0, 260.0, 300.0)
# white noise as the readings vary within a second of driving; the rest as such units have it
NOISE = ImuNoise(0.03, 0.002, 0.1, 0.01, 0.01, 0.0005, 300.0)
PLAIN = DriveSettings(
    imu=NOISE,
    axes="frd",
    lever_arm_m=(-0.156, -0.511, -0.004),
    fix_sigma_m=(0.5, 0.5, 0.5),
    heading_rad=float(np.radians(150.0)),
    heading_sigma_rad=0.2,
    gate_sigma=10.0,
    smoother=False,
)
STILL = {"standstill_sigma_m_per_s": 0.05, "standstill": StandstillRule(0.2, 0.02, window_s=0.1)}
# the unit rides 0.78 m ahead of what the rover turns about, as a track through all its fixes tells; so much of the
# table is fitted to this log
ON_WHEELS = {"sideways_sigma_m_per_s": 0.1, "pivot_m": (-0.78, 0.0, 0.0)}
WAYS: dict[str, dict[str, Any]] = {
    "neither": {},
    "standing still (ZUPT)": STILL,
    "not sliding (NHC)": ON_WHEELS,
    "both": {**STILL, **ON_WHEELS},
}


def rover_outages() -> Table:
    """The Canadian planetary rover of NaveGo's examples, six outages of a minute."""
    if not FOLDER.is_dir():
        return Table("A real rover without fixes", ("what",), (Row(("the data are not here",)),))
    found = {name: _rms(replace(PLAIN, **way)) for name, way in WAYS.items()}
    rows = []
    for name, (flat, up) in found.items():
        target, met = "", None
        if name != "neither":
            target, met = "less than neither", flat < found["neither"][0] and up < found["neither"][1]
        rows.append(Row((name, f"{flat:.1f} m", f"{up:.2f} m"), target, met))
    note = (
        "IMU at 200 Hz, fixes at 2 Hz taken as 0.5 m and 0.1 m/s; errors at the end of outages of 60 s against the "
        "fixes themselves, which are not independent. The rover hardly ever stands."
    )
    return Table("A real rover without fixes", ("what is known", "horizontal, rms", "height, rms"), rows, note)


def _rms(settings: DriveSettings) -> tuple[float, float]:
    imu, fixes = (_loaded(name) for name in ("imu_planetary", "gnss_planetary_r"))
    frame = TangentFrame(float(fixes.lat[0]), float(fixes.lon[0]), float(fixes.h[0]))
    places_m = frame.from_geodetic_m(fixes.lat, fixes.lon, fixes.h)
    velocities = np.stack([fixes.vel[:, 1], fixes.vel[:, 0], -fixes.vel[:, 2]], axis=1)
    errors = []
    for begin_s in BEGINNINGS_S:
        end_s = begin_s + OUTAGE_S
        kept = ((fixes.t < begin_s) | (fixes.t >= end_s)) & (np.arange(len(fixes.t)) % 10 == 0)
        nothing = np.full((int(kept.sum()), 3), np.nan)
        told = Fixes(fixes.t[kept], places_m[kept], nothing, velocities[kept], nothing)
        track = navigate_drive(DriveLog(Readings(imu.t, imu.fb, imu.wb), told), settings, frame)
        last = int(np.searchsorted(track.times_s, end_s)) - 1
        arm = matrices_of(track.filtered.quaternion[last]) @ settings.lever_arm_m
        errors.append(track.position_m[last] + arm - places_m[int(np.searchsorted(fixes.t, end_s)) - 1])
    east, north, up = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    return float(np.hypot(east, north)), float(up)


def _loaded(name: str) -> Any:
    return loadmat(FOLDER / f"{name}.mat", squeeze_me=True, struct_as_record=False)[name]
