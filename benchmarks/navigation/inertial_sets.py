"""Inertial logs made by others, and a drive with a stated unit's errors for outages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.io import loadmat

from navigation.inertial import (
    IMU_PRESETS,
    ImuLog,
    ImuNoise,
    InertialStart,
    Measurements,
    TangentFrame,
    imu_log,
    join,
    position_fixes,
    quaternion_of_angles,
    velocity_fixes,
)
from tests.reference.inertial import Drive, along

__all__ = ["SYNTHETIC", "InertialCase", "navego_synthetic", "outage_drive"]

Array = npt.NDArray[np.float64]
SYNTHETIC = Path(__file__).resolve().parents[3] / "shared" / "data" / "ins" / "navego_synthetic"


@dataclass(frozen=True, eq=False)
class InertialCase:
    """A log with what corrects it, and the truth at its readings: position_m (k, 3), heading_rad (k,)."""

    log: ImuLog
    start: InertialStart
    measurements: Measurements
    noise: ImuNoise
    frame: TangentFrame
    position_m: Array
    heading_rad: Array


def navego_synthetic(folder: Path = SYNTHETIC) -> InertialCase:
    """NaveGo's made-up drive with an ADIS16405 and 5 Hz fixes; the start is off by its own 1, 1 and 2 degrees."""
    imu, gnss, truth = (
        loadmat(folder / f"{name}.mat", squeeze_me=True, struct_as_record=False)[name]
        for name in ("imu1", "gnss", "ref")
    )
    noise = IMU_PRESETS["ADIS16405"]
    frame = TangentFrame(float(truth.lat[0]), float(truth.lon[0]))
    fixes_m = frame.from_geodetic_m(gnss.lat, gnss.lon, gnss.h)
    velocities = np.stack([gnss.vel[:, 1], gnss.vel[:, 0], -gnss.vel[:, 2]], axis=1)
    off = np.radians([1.0, 1.0, 2.0])
    start = InertialStart(
        fixes_m[0],
        velocities[0],
        quaternion_of_angles(float(truth.yaw[0]) + off[2], off[1], off[0]),
        position_sigma_m=(5.0, 5.0, 10.0),
        velocity_sigma_m_per_s=0.1,
        attitude_sigma_rad=off,
    )
    measured = join(position_fixes(gnss.t, fixes_m, (5.0, 5.0, 10.0)), velocity_fixes(gnss.t, velocities, 0.0514444))
    log = imu_log(imu.t, imu.fb, imu.wb, axes="frd", noise=noise)
    return InertialCase(
        log, start, measured, noise, frame, frame.from_geodetic_m(truth.lat, truth.lon, truth.h), np.array(truth.yaw)
    )


def outage_drive(seed: int, noise: ImuNoise, duration_s: float = 600.0, every_s: float = 120.0) -> InertialCase:
    """A drive with centimetre fixes at 1 Hz that are away for 60 of every ``every_s`` seconds from 120 s on."""
    rng = np.random.default_rng(seed)
    frame = TangentFrame(0.53, 0.0, 20.0)
    rate = frame.body.rate_rad_per_s * np.array([0.0, np.cos(0.53), np.sin(0.53)])
    drive = Drive(seed, duration_s, 10.0)
    forces, rates = drive.readings(lambda places_m: along(frame.gravity_m_per_s2, places_m), rate)
    steps, root = len(drive.times_s), 0.005**0.5
    shape = steps, 3
    forces = forces * (1.0 + rng.normal(0.0, noise.force_scale, 3)) + rng.normal(0.0, noise.force_bias_m_per_s2, 3)
    rates = rates * (1.0 + rng.normal(0.0, noise.rate_scale, 3)) + rng.normal(0.0, noise.rate_bias_rad_per_s, 3)
    forces += rng.normal(0.0, noise.velocity_walk_m_per_s_sqrt_s / root, shape)
    rates += rng.normal(0.0, noise.angle_walk_rad_per_sqrt_s / root, shape)
    at = np.arange(1.0, duration_s)
    fixes_m = drive.position(at) + rng.normal(0.0, 0.02, (len(at), 3)) * (1.0, 1.0, 1.5)
    fixes_m[(at > every_s) & (at % every_s >= 60.0)] = np.nan
    sigma = np.radians([0.003, 0.003, 0.023])
    heading, pitch, roll = drive.angles(np.zeros(1))[0] + rng.normal(0.0, sigma[::-1])
    start = InertialStart(
        drive.position(0.0),
        drive.velocity(0.0),
        quaternion_of_angles(heading, pitch, roll),
        position_sigma_m=0.01,
        velocity_sigma_m_per_s=0.005,
        attitude_sigma_rad=sigma,
    )
    headings = drive.angles(drive.times_s)[:, 0]
    log = imu_log(drive.times_s, forces, rates)
    measured = position_fixes(at, fixes_m, (0.02, 0.02, 0.03))
    return InertialCase(log, start, measured, noise, frame, drive.position(drive.times_s), headings)
