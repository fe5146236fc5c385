"""How far a told heading is off, found from the ranges, and whether it does harm (a gyro drifts, a compass is turned).

Two tracks follow the ranges: one that is told of the heading and one that is not. The second one's velocity shows by
how much the heading is off and how fast that drifts; and where the first foretells the ranges worse, it does harm.
"""

from __future__ import annotations

import math
from dataclasses import replace

from ..settings import DetectorSettings
from .odometry import Motion
from .tracks import Track

__all__ = ["Heading"]

HARMFUL_LOG_ODDS = math.log(1e6)  # by so much less likely the heading has to make the ranges
REMEMBERED_S = 60.0  # over which that is summed, fading
# A track's velocity errs alike for about so long: the courses it gives in between are not independent.
ALIKE_S = 2.0
DRIFT_ALIKE_S = 300.0  # how long a drift stays much as it was
SURE_RAD = 0.35  # a heading that was dropped comes back when its offset is known so well
DROPS = 3  # after so many it does not
OFF_SIGMAS = 3.0  # nearer to none, a heading is taken as it is told
NOTABLE_RAD = math.radians(10.0)  # off by so much it is told


class Heading:
    """Offset and drift of the told heading, with their covariance, and how it has done; changed in place."""

    def __init__(self, settings: DetectorSettings) -> None:
        self._settings = settings
        self._drops = 0
        self._begin(settings.heading_offset_sigma_rad)
        # one that may point anywhere has to be found first
        self.used = settings.heading_offset_sigma_rad <= SURE_RAD

    @property
    def contradicted(self) -> bool:
        """Whether the ranges contradict it, so that it is not used."""
        return self._drops > 0 and not self.used

    def _begin(self, offset_sigma_rad: float) -> None:
        self.offset_rad, self.drift_rad_per_s = 0.0, 0.0
        self._offset_var, self._both, self._drift_var = (
            offset_sigma_rad**2, 0.0, self._settings.heading_drift_rad_per_s**2
        )  # fmt: skip
        self._lead = 0.0  # log-odds of the ranges, with the heading over without

    @property
    def sigma_rad(self) -> float:
        """Of the offset."""
        return math.sqrt(self._offset_var)

    def led(self, motion: Motion) -> Motion:
        """The motion after so much more drift, its displacement turned by the offset; without one while not used."""
        if motion.displacement_m is None:
            return motion
        self._drift(motion.duration_s)
        if not self.used:
            return replace(motion, displacement_m=None)
        east_m, north_m = motion.displacement_m
        if not self._is_off():
            across_m = math.hypot(east_m, north_m) * self._settings.heading_sigma_rad
            return replace(motion, across_m=across_m)
        sine, cosine = math.sin(self.offset_rad), math.cos(self.offset_rad)
        turned_m = (east_m * cosine + north_m * sine, north_m * cosine - east_m * sine)
        across_m = math.hypot(east_m, north_m) * math.hypot(self.sigma_rad, self._settings.heading_sigma_rad)
        return replace(motion, displacement_m=turned_m, across_m=across_m)

    def _is_off(self) -> bool:
        """Whether the offset is more than the ranges' noise would make of a heading that is right."""
        return self._drops > 0 or abs(self.offset_rad) > OFF_SIGMAS * self.sigma_rad

    def _drift(self, duration_s: float) -> None:
        self.offset_rad += self.drift_rad_per_s * duration_s
        self._offset_var += 2.0 * duration_s * self._both + duration_s**2 * self._drift_var
        self._both += duration_s * self._drift_var
        self._drift_var += self._settings.heading_drift_rad_per_s**2 * duration_s / DRIFT_ALIKE_S

    def judge(self, told: Motion, unled: Track, with_it: float, without_it: float) -> bool:
        """Learn from an epoch; whether the heading was dropped just now.

        told: the motion as it came. unled: the track that knows no heading. with_it, without_it: log-likelihoods of the
        epoch's ranges by either track.
        """
        self._lead = self._lead * math.exp(-told.duration_s / REMEMBERED_S) + with_it - without_it
        self._compare(told, unled)
        if self.used and self._lead < -HARMFUL_LOG_ODDS:
            self._drops += 1
            self.used = False
            self._begin(math.pi)
            return True
        if not self.used and self._drops < DROPS and self.sigma_rad < SURE_RAD:
            self.used = True
            self._lead = 0.0
        return False

    def _compare(self, told: Motion, unled: Track) -> None:
        """The offset after one course of the track: a Kalman filter of two states."""
        if told.displacement_m is None:
            return
        east, north = unled.state[3], unled.state[4]
        speed = math.hypot(east, north)
        turned = self._settings.acceleration_m_per_s2 * math.sqrt(told.duration_s / 3.0)
        across = north / max(speed, 1e-9), -east / max(speed, 1e-9)
        variance = (
            across[0] ** 2 * unled.covariance[3, 3]
            + across[1] ** 2 * unled.covariance[4, 4]
            + 2.0 * across[0] * across[1] * unled.covariance[3, 4]
            + turned**2
        )
        if math.hypot(*told.displacement_m) <= self._settings.k_odometry * told.sigma_m or speed**2 <= variance:
            return
        noise = (variance / speed**2 + self._settings.heading_sigma_rad**2) * (1.0 + ALIKE_S / told.duration_s)
        off_rad = math.atan2(east, north) - math.atan2(*told.displacement_m) - self.offset_rad
        off_rad = math.remainder(off_rad, math.tau)
        total = self._offset_var + noise
        gain, drift_gain = self._offset_var / total, self._both / total
        self.offset_rad = math.remainder(self.offset_rad + gain * off_rad, math.tau)
        self.drift_rad_per_s += drift_gain * off_rad
        self._drift_var -= drift_gain * self._both
        self._both -= gain * self._both
        self._offset_var -= gain * self._offset_var

    def warning(self) -> str:
        """What to know of the heading, in a sentence; "" where it is well."""
        if self.contradicted:
            return "The heading of the odometry contradicts the ranges: it is not used."
        if abs(self.offset_rad) > max(NOTABLE_RAD, OFF_SIGMAS * self.sigma_rad):
            again = "again " if self._drops else ""
            return (
                "The ranges say that the heading of the odometry has to be turned by "
                f"{math.degrees(self.offset_rad):+.0f}°, and by {60.0 * math.degrees(self.drift_rad_per_s):+.0f}° more "
                f"each minute: it is {again}used so."
            )
        return ""
