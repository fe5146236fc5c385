"""Has a range changed by more than the rover moved (seed 000, "Odometry-Based Occlusion Detection", steps 1-6)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from ..epochs import OdometryIncrement
from ..settings import DetectorSettings, sigma_odometry_m
from ..verdicts import OdometryCondition

__all__ = ["Motion", "aligned", "motion_of"]

RELIABLE = OdometryCondition.RELIABLE


@dataclass(frozen=True, slots=True)
class Motion:
    """What one odometry increment says: how far, how surely, which way (east, north; None = unknown), and whether the
    cross-check of wheels against accelerometer lets it be believed. across_m: sigma of the way to either side."""

    length_m: float
    sigma_m: float
    duration_s: float
    displacement_m: tuple[float, float] | None
    condition: OdometryCondition
    across_m: float = 0.0

    @property
    def reliable(self) -> bool:
        """Whether occlusion may be judged by it."""
        return self.condition is RELIABLE


def motion_of(odometry: OdometryIncrement, settings: DetectorSettings) -> Motion:
    """Displacement and the checks of it (steps 2 and 3).

    Level motion is the wheels' where there are wheels, climb the accelerometer's. Wheels that turn while nothing moves
    are stuck, motion without wheels slipped; where both move, lengths that differ by more than k sigma are different.
    """
    wheel, accelerometer = odometry.wheel_m, odometry.accelerometer_m
    level_m = wheel if wheel is not None else accelerometer[:2] if accelerometer is not None else None
    if level_m is None:
        return Motion(math.nan, math.nan, odometry.duration_s, None, OdometryCondition.MISSING)
    climb_m = accelerometer[2] if accelerometer is not None else 0.0
    flat_m = math.hypot(*level_m)
    length_m = math.hypot(flat_m, climb_m)
    speed = length_m / odometry.duration_s
    sigma_m = sigma_odometry_m(
        settings.wheel_sigma_m if wheel is not None else 0.0,
        settings.accelerometer_sigma_m if accelerometer is not None else 0.0,
        speed,
        settings.time_sigma_s,
    )
    displacement_m = None
    if odometry.heading_rad is not None:
        displacement_m = flat_m * math.sin(odometry.heading_rad), flat_m * math.cos(odometry.heading_rad)
    condition = OdometryCondition.RELIABLE
    if speed > settings.max_speed_m_per_s:
        condition = OdometryCondition.TOO_FAST
    elif wheel is not None and accelerometer is not None:
        condition = _cross_check(math.hypot(*wheel), math.hypot(*accelerometer[:2]), settings)
    return Motion(length_m, sigma_m, odometry.duration_s, displacement_m, condition)


def _cross_check(wheel_m: float, accelerometer_m: float, settings: DetectorSettings) -> OdometryCondition:
    k = settings.k_odometry
    turning = wheel_m > k * settings.wheel_sigma_m
    moving = accelerometer_m > k * settings.accelerometer_sigma_m
    differ = abs(wheel_m - accelerometer_m) > k * math.hypot(settings.wheel_sigma_m, settings.accelerometer_sigma_m)
    if not differ:
        return OdometryCondition.RELIABLE
    if turning and not moving:
        return OdometryCondition.STUCK
    return OdometryCondition.SLIPPED if moving and not turning else OdometryCondition.DIFFERENT


def aligned(before: Motion | None, now: Motion, ahead_s: float) -> Motion:
    """The motion over the ranging interval, of increments stamped by a clock that is ahead by so many seconds.

    An increment of a clock that is ahead began and ended too early. What it lacks at its end the rover is taken to have
    done at the same speed; of one that is behind, the beginning belongs to the increment before.
    """
    share = min(max(-ahead_s / now.duration_s, 0.0), 1.0)
    if share == 0.0 or before is None or not before.reliable:
        return now
    borrowed = now.duration_s / before.duration_s * share
    displacement_m = None
    if now.displacement_m is not None and before.displacement_m is not None:
        east_m, north_m = (
            (1.0 - share) * new + borrowed * old
            for new, old in zip(now.displacement_m, before.displacement_m, strict=True)
        )
        displacement_m = east_m, north_m
    length_m = (1.0 - share) * now.length_m + borrowed * before.length_m
    return replace(now, length_m=length_m, displacement_m=displacement_m)
