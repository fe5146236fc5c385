"""Where a drive begins, as its log tells: place, velocity, level and heading."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError, StateError
from ..inertial import (
    ClockNoise,
    ImuLog,
    InertialStart,
    TangentFrame,
    align_moving,
    align_still,
    angles_of,
    quaternion_of_angles,
    standing_still,
)
from ..inputs import positions
from .logs import DriveLog, Ranges
from .satellites import FirstHeard, first_heard
from .settings import DriveSettings

__all__ = ["Beginning", "beginnings"]

Array = npt.NDArray[np.float64]
# tried where nothing tells the heading; each covers the half way to its neighbours
TRIED_HEADINGS = 12
# a course is one from so many sigmas of speed on
COURSE_SIGMAS = 5.0
LEAST_RANGES, MOST_STEPS = 3, 50


@dataclass(frozen=True, eq=False)
class Beginning:
    """Beliefs to begin with, one, or several of which the log shall decide; and what was decided, in sentences."""

    starts: tuple[InertialStart, ...]
    told: tuple[str, ...]


def beginnings(log: DriveLog, imu: ImuLog, settings: DriveSettings, frame: TangentFrame) -> Beginning:
    """What may be believed at the first reading. Raises StateError where the log does not tell the place."""
    told: list[str] = []
    heard = None if log.satellites is None else first_heard(log.satellites, settings, float(imu.times_s[0]))
    place, sigma, velocity, velocity_sigma = _place(log, imu, settings, told, heard)
    first = imu.times_s <= imu.times_s[0] + max(settings.align_s, 2.0 * float(np.median(np.diff(imu.times_s))))
    still = bool(standing_still(imu, settings.standstill)[first].all())
    force, rate = imu.forces_m_per_s2[first].mean(axis=0), imu.rates_rad_per_s[first].mean(axis=0)
    if velocity is None:
        velocity, velocity_sigma = np.zeros(3), settings.velocity_sigma_m_per_s
    gravity = float(np.linalg.norm(frame.gravity_m_per_s2(place)))
    level_sigma = math.hypot(settings.imu.force_bias_m_per_s2 / gravity, 0.005 if still else 0.05)
    attitudes, heading_sigma = _headings(imu, force, rate, still, velocity, velocity_sigma, settings, frame, told)
    starts = tuple(
        InertialStart(
            place,
            velocity,
            attitude,
            position_sigma_m=sigma,
            velocity_sigma_m_per_s=velocity_sigma,
            attitude_sigma_rad=(level_sigma, level_sigma, heading_sigma),
            # what gyros read that stand still is their bias, but for the planet's turning
            rate_bias_rad_per_s=rate if still and settings.imu.rate_bias_rad_per_s > 1e-3 else (0.0, 0.0, 0.0),
            lever_arm_m=settings.lever_arm_m,
            lever_arm_sigma_m=settings.lever_arm_sigma_m,
            clock=None if heard is None else heard.clock,
            clock_noise=ClockNoise() if heard is None else heard.clock_noise,
            phases=heard is not None and settings.phase_sigma_m > 0.0,
        )
        for attitude in attitudes
    )
    return Beginning(starts, tuple(told))


def _place(
    log: DriveLog, imu: ImuLog, settings: DriveSettings, told: list[str], heard: FirstHeard | None
) -> tuple[Array, float | Array, Array | None, float]:
    """(place, its sigma, velocity or None, its sigma)."""
    fixes, until_s = log.fixes, imu.times_s[0] + max(settings.align_s, 1.0)
    velocity, velocity_sigma = None, settings.velocity_sigma_m_per_s
    placed = None
    if fixes is not None and len(fixes.times_s):
        early = fixes.times_s <= until_s
        moving = early & ~np.isnan(fixes.velocities_m_per_s).any(axis=1)
        if moving.any():
            one = int(np.argmax(moving))
            given = fixes.velocity_sigmas_m_per_s[one]
            velocity = fixes.velocities_m_per_s[one]
            velocity_sigma = float(np.where(np.isnan(given), settings.fix_velocity_sigma_m_per_s, given).max())
        there = ~np.isnan(fixes.positions_m).any(axis=1)
        if there.any():
            one = int(np.argmax(there))
            if fixes.times_s[one] > until_s:
                told.append(f"The first fix comes {fixes.times_s[one] - imu.times_s[0]:.1f} s after the first reading.")
            given = fixes.position_sigmas_m[one]
            placed = fixes.positions_m[one], np.where(np.isnan(given), settings.fix_sigma_m, given)
    if heard is not None and heard.place_m is not None:
        if placed is None:
            placed = heard.place_m, heard.sigmas_m
            if heard.time_s > until_s:
                late_s = heard.time_s - imu.times_s[0]
                told.append(f"Codes of four satellites first come {late_s:.1f} s after the first reading.")
        if velocity is None and heard.velocity_m_per_s is not None and heard.time_s <= until_s:
            velocity, velocity_sigma = heard.velocity_m_per_s, heard.velocity_sigma_m_per_s
    if settings.position_m is not None:
        return np.array(settings.position_m), settings.position_sigma_m, velocity, velocity_sigma
    if placed is not None:
        return placed[0], placed[1], velocity, velocity_sigma
    if log.ranges is None:
        raise StateError("Neither fixes, satellites nor ranges tell where the drive begins; give position_m.")
    place, sides = _of_ranges(log.ranges, positions("anchors_m", log.anchors_m), until_s)
    if sides:
        told.append("The first ranges fit on both sides of their anchors; the lower side was taken.")
    return place, settings.position_sigma_m, velocity, velocity_sigma


def _of_ranges(ranges: Ranges, anchors: Array, until_s: float) -> tuple[Array, bool]:
    """(place that the first ranges tell, whether another one fits as well). Raises StateError."""
    early = (ranges.times_s <= until_s) & (ranges.measured_m > 0.0)
    if len(np.unique(ranges.anchor[early])) < LEAST_RANGES:
        raise StateError(
            f"Until {until_s:.1f} s ranges came from {len(np.unique(ranges.anchor[early]))} anchors; "
            f"{LEAST_RANGES} are needed to tell where the drive begins: give position_m, or a longer align_s."
        )
    numbers = np.unique(ranges.anchor[early])
    measured = np.array([np.median(ranges.measured_m[early & (ranges.anchor == one)]) for one in numbers])
    seen = anchors[numbers]
    reach = float(measured.max())
    found = []
    for up in (-0.5, 0.5):
        place = seen.mean(axis=0) + np.array([0.0, 0.0, up * reach])
        for _ in range(MOST_STEPS):
            away = place - seen
            length = np.maximum(np.linalg.norm(away, axis=1), 1e-9)
            # a little is kept of the step before, for coplanar anchors tell nothing of the height near their plane
            rows = np.vstack([away / length[:, None], 1e-3 * np.eye(3)])
            misfit = np.concatenate([measured - length, np.zeros(3)])
            place = place + np.linalg.lstsq(rows, misfit, rcond=None)[0].clip(-0.5 * reach, 0.5 * reach)
        found.append((float(np.abs(measured - np.linalg.norm(place - seen, axis=1)).max()), place))
    (low_misfit, low), (high_misfit, high) = found
    apart = float(np.linalg.norm(high - low)) > 0.05 * reach
    if not apart or low_misfit > 2.0 * high_misfit + 0.1:
        return (high if low_misfit > high_misfit else low), False
    return low, high_misfit <= 2.0 * low_misfit + 0.1


def _headings(
    imu: ImuLog,
    force: Array,
    rate: Array,
    still: bool,
    velocity: Array,
    velocity_sigma: float,
    settings: DriveSettings,
    frame: TangentFrame,
    told: list[str],
) -> tuple[list[Array], float]:
    """(attitudes that may be, one sigma of their heading)."""
    if settings.heading_rad is not None:
        return [align_still(force, heading_rad=settings.heading_rad)], settings.heading_sigma_rad
    speed = float(np.hypot(velocity[0], velocity[1]))
    if speed > COURSE_SIGMAS * velocity_sigma:
        told.append("The heading at the beginning is the course of the fixes.")
        heading = align_moving(force, velocity, least_speed_m_per_s=min(speed, 1.0) * 0.99)
        return [heading], math.hypot(settings.heading_sigma_rad, velocity_sigma / speed)
    turning = frame.body.rate_rad_per_s * math.cos(frame.latitude_rad)
    span_s = float(np.sum(imu.times_s <= imu.times_s[0] + settings.align_s) * np.median(np.diff(imu.times_s)))
    doubt = math.hypot(
        settings.imu.rate_bias_rad_per_s, settings.imu.angle_walk_rad_per_sqrt_s / math.sqrt(max(span_s, 1e-3))
    ) / max(turning, 1e-12)
    if still and doubt < 0.2:
        try:
            found = align_still(force, rate, frame=frame)
        except StateError as error:
            told.append(str(error))
        else:
            told.append(f"The heading at the beginning is what the gyros feel of {frame.body.name}'s turning.")
            return [found], doubt
    level = align_still(force, heading_rad=0.0)
    pitch, roll = _pitch_and_roll(level)
    turns = [2.0 * math.pi * number / TRIED_HEADINGS for number in range(TRIED_HEADINGS)]
    return [quaternion_of_angles(turn, pitch, roll) for turn in turns], 2.0 * math.pi / TRIED_HEADINGS / 1.5


def _pitch_and_roll(level: Array) -> tuple[float, float]:
    _, pitch, roll = angles_of(level)
    if not math.isfinite(pitch + roll):
        raise MeasurementError("The first readings hold no way up.")
    return float(pitch), float(roll)
