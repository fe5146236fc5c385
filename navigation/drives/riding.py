"""Inertial navigation along with a detector: readings as they come, corrected by what verdicts leave of the ranges.

It begins where the filter at constant velocity knows place and course; where readings stop, that one begins anew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from detection import DetectorSettings, EpochResult, GroundHeight, Motion, RangeEpoch, RangingAnchor, Rejection

from ..bubbles import bubble_radius_m
from ..errors import MeasurementError, TimeOrderError
from ..estimators import GATE, SIGMAS, ConstantVelocityEstimator, RoverEstimate
from ..inertial import (
    ImuLog,
    InertialStart,
    InertialTrack,
    Measurements,
    TangentFrame,
    align_still,
    ground_heights,
    imu_log,
    join,
    matrices_of,
    navigate,
    ranges_to_anchors,
    standing_still,
    standstill,
    vehicle_speeds,
)
from ..ranging import Verdict
from .settings import DriveSettings

__all__ = ["InertialEstimator"]

Array = npt.NDArray[np.float64]

KEPT_S = 5.0  # of readings, from which the unit is levelled
SILENT_S = 0.5  # without a reading before an epoch, and inertial navigation ends
COURSE_SIGMAS = 2.5  # of speed from which a course is one
LEVEL_SIGMA_RAD = 0.03
COURSE_SIGMA_RAD = math.radians(5.0)  # of the nose beside the course
LOST_EPOCHS = 5
MID_LATITUDES = TangentFrame(math.radians(45.0))


class InertialEstimator(ConstantVelocityEstimator):
    """An ``Estimator`` with an inertial unit, whose readings ``feel`` takes; changed in place.

    drive: the unit, its axes and units, lever arm, heading at the beginning (None = it drives forward, and its course
    is its heading), standstill and speeds. frame: gravity and the body's turning amid the anchors; its north is that of
    the anchors. Raises StateError.
    """

    def __init__(
        self,
        anchors: Sequence[RangingAnchor],
        settings: DetectorSettings,
        drive: DriveSettings | None = None,
        frame: TangentFrame = MID_LATITUDES,
    ) -> None:
        super().__init__(anchors, settings)
        self._drive, self._frame = drive or DriveSettings(), frame
        places_m = [(one.east_m, one.north_m, one.altitude_m) for one in anchors]
        self._origin_m = np.mean(np.array(places_m), axis=0) if places_m else np.zeros(3)
        self._offset_s = settings.ranging_offset_s
        self._gravity = float(np.linalg.norm(frame.gravity_m_per_s2(np.zeros(3))))
        self._kept: ImuLog | None = None  # the last seconds of readings
        self._inertial: _Belief | None = None
        self._off_epochs, self._rode = 0, False

    @property
    def latest_s(self) -> float | None:
        """When the last reading was taken that is kept; None before the first."""
        return None if self._kept is None else float(self._kept.times_s[-1])

    @property
    def riding(self) -> bool:
        """Whether readings are navigated with."""
        return self._inertial is not None

    def feel(self, times_s: npt.ArrayLike, forces: npt.ArrayLike, rates: npt.ArrayLike) -> tuple[int, tuple[str, ...]]:
        """(how many readings were taken, what to know of the others, sentences).

        times_s: (k,) on the ranging clock; forces, rates: (k, 3), each the mean since the reading before, in the units
        and axes of the drive's settings. Those that are not finite, or not later than the one before, are left out.
        """
        times = np.asarray(times_s, np.float64)
        force, rate = (np.asarray(values, np.float64).reshape(len(times), 3) for values in (forces, rates))
        told = []
        finite = np.isfinite(times) & np.isfinite(force).all(axis=1) & np.isfinite(rate).all(axis=1)
        if not finite.all():
            told.append(f"Inertial readings that are not finite, not used: {np.count_nonzero(~finite)}.")
        kept = self._kept
        before_s = -math.inf if kept is None else float(kept.times_s[-1])
        latest_s = np.maximum.accumulate(np.concatenate([[before_s], np.where(finite, times, -np.inf)]))
        late = finite & ~(times > latest_s[:-1])
        if late.any():
            told.append(f"Inertial readings no later than the one before, not used: {np.count_nonzero(late)}.")
        fresh = finite & ~late
        if not fresh.any():
            return 0, tuple(told)
        try:
            taken = self._checked(times[fresh], force[fresh], rate[fresh])
        except (MeasurementError, TimeOrderError) as error:
            return 0, (*told, f"Not used: {error}")
        self._kept = taken if kept is None else _joined(kept, taken)
        return int(np.count_nonzero(fresh)), (*told, *taken.warnings)

    def step(self, epoch: RangeEpoch, result: EpochResult, motion: Motion | None) -> RoverEstimate | None:
        """As ``Estimator.step`` has it."""
        if result.rejection is not None:
            return None
        time_s = epoch.time_s - self._offset_s
        if self._inertial is not None and not self._hears(time_s):
            self._inertial = None
        if self._inertial is None:
            blind = super().step(epoch, result, motion)
            if blind is not None and self._hears(time_s):
                self._begin(blind)
            self._forget()
            return blind
        self._anchors |= {anchor.id: anchor for anchor in epoch.moved if anchor.id in self._anchors}
        track, used = self._correct(self._inertial, epoch, result, motion, time_s)
        self._inertial = _Belief(float(track.times_s[-1]), track.end())
        found = self._told(track, epoch.time_s, used)
        self._forget()
        if self._is_off(found, result):
            self._inertial, self._off_epochs = None, 0
        return found

    def _checked(self, times_s: Array, force: Array, rate: Array) -> ImuLog:
        """Readings in the filter's axes and units; one alone is judged with the last one before it."""
        drive = self._drive
        lone = len(times_s) == 1
        if lone:  # nothing of a log can be said of one reading; its own time apart is no gap
            times_s, force, rate = (
                np.array([times_s[0] - 1e-3, times_s[0]]),
                np.repeat(force, 2, 0),
                np.repeat(rate, 2, 0),
            )
        read = imu_log(
            times_s, force, rate, axes=drive.axes, force_unit=drive.force_unit, rate_unit=drive.rate_unit,
            noise=drive.imu, max_gap_s=drive.max_gap_s, gravity_m_per_s2=self._gravity,
        )  # fmt: skip
        first = 1 if lone else 0
        return ImuLog(
            read.times_s[first:],
            read.forces_m_per_s2[first:],
            read.rates_rad_per_s[first:],
            read.gaps[first:],
            read.warnings,
        )

    def _hears(self, time_s: float) -> bool:
        """Whether readings reach up to an epoch."""
        return self._kept is not None and len(self._kept.times_s) > 1 and self._kept.times_s[-1] >= time_s - SILENT_S

    def _begin(self, blind: RoverEstimate) -> None:
        """At the last reading before the epoch, where the course or the settings tell the heading."""
        kept, drive = self._kept, self._drive
        assert kept is not None, "it hears"
        heading, sigma = drive.heading_rad, drive.heading_sigma_rad
        if heading is None or self._rode:  # what was told is of the beginning
            east, north, _ = blind.velocity_m_per_s.tolist()
            speed_sigma = math.sqrt(float(np.linalg.eigvalsh(blind.covariance[3:5, 3:5])[-1]))
            speed = math.hypot(east, north)
            if not speed > COURSE_SIGMAS * speed_sigma:
                return
            heading, sigma = math.atan2(east, north), math.hypot(COURSE_SIGMA_RAD, speed_sigma / speed)
        attitude = align_still(kept.forces_m_per_s2.mean(axis=0), heading_rad=heading)
        still = bool(standing_still(kept, drive.standstill).all())
        spread = np.sqrt(np.diag(blind.covariance))
        start = InertialStart(
            blind.position_m - self._origin_m, blind.velocity_m_per_s, attitude, spread[:3], spread[3:],
            (LEVEL_SIGMA_RAD, LEVEL_SIGMA_RAD, sigma),
            rate_bias_rad_per_s=kept.rates_rad_per_s.mean(axis=0) if still else (0.0, 0.0, 0.0),
            lever_arm_m=drive.lever_arm_m, lever_arm_sigma_m=drive.lever_arm_sigma_m,
        )  # fmt: skip
        self._inertial, self._state, self._rode = _Belief(float(kept.times_s[-1]), start), None, True

    def _correct(
        self, inertial: _Belief, epoch: RangeEpoch, result: EpochResult, motion: Motion | None, time_s: float
    ) -> tuple[InertialTrack, tuple[str, ...]]:
        """(the track through the readings up to now, ids of the ranges that were leaned on)."""
        kept = self._kept
        assert kept is not None, "it hears"
        readings = _only(kept, kept.times_s >= inertial.time_s)
        now_s, gate = float(readings.times_s[-1]), self._drive.gate_sigma
        names, lists = list[str](), list[Measurements]()
        for at_s, heard in self._rounds(epoch, result, time_s):
            anchors_m, ranges_m, variances_m2 = (np.array(column) for column in zip(*heard.values(), strict=True))
            at = np.full(len(heard), min(max(at_s, inertial.time_s), now_s))
            lists.append(
                ranges_to_anchors(at, anchors_m - self._origin_m, ranges_m, np.sqrt(variances_m2), gate_sigma=GATE)
            )
            names += heard
        at = np.array([min(max(time_s, inertial.time_s), now_s)])
        drive, odometry = self._drive, epoch.odometry
        still = drive.standstill_sigma_m_per_s > 0.0 and len(readings.times_s) > 2
        if still and standing_still(readings, drive.standstill).all():
            lists.append(standstill(at, drive.standstill_sigma_m_per_s))
        if motion is not None and motion.reliable and odometry is not None and odometry.wheel_m is not None:
            forward = np.array([odometry.wheel_m[0] / odometry.duration_s])
            sigma = math.hypot(drive.speed_sigma_m_per_s, motion.sigma_m / motion.duration_s)
            lists.append(
                vehicle_speeds(
                    at, forward, sigma, sideways_sigma_m_per_s=drive.sideways_sigma_m_per_s,
                    mounting_rad=drive.mounting_rad, pivot_m=drive.pivot_m, gate_sigma=gate,
                )
            )  # fmt: skip
        measured = join(*lists)
        track = navigate(readings, inertial.start, measured, drive.imu, self._frame)
        taken = np.isin(track.verdict, (Verdict.USED, Verdict.REACQUIRED))
        used = [names[int(row)] for row in _rows(measured, lists, len(names))[taken] if row >= 0]
        if epoch.ground is not None and all(one.reason is not Rejection.BAD_GROUND for one in result.rejected):
            track = self._standing(track, epoch.ground, _only(readings, readings.times_s == now_s))
        return track, tuple(dict.fromkeys(used))

    def _standing(self, track: InertialTrack, ground: GroundHeight, now: ImuLog) -> InertialTrack:
        """The ground makes the height as sure as the map, never surer: it errs alike epoch after epoch."""
        over = np.array([-ground.slope_east, -ground.slope_north, 1.0])
        variance_m2, told_m2 = float(over @ track.covariance[:3, :3] @ over), ground.sigma_m**2
        if variance_m2 <= told_m2:
            return track
        sigma_m = math.sqrt(variance_m2 * told_m2 / (variance_m2 - told_m2))
        height = ground_heights(
            now.times_s, [ground.altitude_m - self._origin_m[2]], sigma_m,
            slopes=(ground.slope_east, ground.slope_north),
            places_m=np.array([(ground.east_m, ground.north_m)]) - self._origin_m[:2], gate_sigma=GATE,
        )  # fmt: skip
        return navigate(now, track.end(), height, self._drive.imu, self._frame)

    def _told(self, track: InertialTrack, time_s: float, used: tuple[str, ...]) -> RoverEstimate:
        covariance = track.covariance[:6, :6]
        radius_m = float(bubble_radius_m(covariance[:3, :3], SIGMAS))
        antenna_m = track.position_m[-1] + np.asarray(matrices_of(track.quaternion[-1])) @ track.lever_arm_m
        return RoverEstimate(
            time_s, antenna_m + self._origin_m, track.velocity_m_per_s[-1], covariance, radius_m, used, False
        )

    def _is_off(self, found: RoverEstimate, result: EpochResult) -> bool:
        """Whether positions that redundant ranges confirm have been elsewhere for some epochs."""
        fix = result.position
        if fix is None or not fix.checked or fix.mirror_m is not None:
            return False
        off_m = fix.position_m - found.position_m
        apart2 = float(off_m @ np.linalg.solve(fix.covariance_m2 + found.covariance[:3, :3], off_m))
        self._off_epochs = self._off_epochs + 1 if apart2 > GATE**2 else 0
        return self._off_epochs >= LOST_EPOCHS

    def _forget(self) -> None:
        """Readings that nobody asks for any more."""
        kept = self._kept
        if kept is None:
            return
        since_s = kept.times_s[-1] - KEPT_S if self._inertial is None else self._inertial.time_s
        self._kept = _only(kept, kept.times_s >= min(since_s, kept.times_s[-1]))


@dataclass(frozen=True, slots=True, eq=False)
class _Belief:
    """What is believed at a reading's time."""

    time_s: float
    start: InertialStart


def _joined(before: ImuLog, after: ImuLog) -> ImuLog:
    """Both; the step from one to the other is a gap where it is far longer than those within."""
    gaps = after.gaps.copy()
    usual_s = float(np.median(np.diff(np.concatenate([before.times_s[-50:], after.times_s[:50]]))))
    gaps[0] |= bool(after.times_s[0] - before.times_s[-1] > 10.0 * usual_s)
    return ImuLog(
        np.concatenate([before.times_s, after.times_s]),
        np.concatenate([before.forces_m_per_s2, after.forces_m_per_s2]),
        np.concatenate([before.rates_rad_per_s, after.rates_rad_per_s]),
        np.concatenate([before.gaps, gaps]),
    )


def _only(log: ImuLog, kept: npt.NDArray[np.bool_]) -> ImuLog:
    return ImuLog(log.times_s[kept], log.forces_m_per_s2[kept], log.rates_rad_per_s[kept], log.gaps[kept])


def _rows(measured: Measurements, lists: Sequence[Measurements], ranges: int) -> npt.NDArray[np.int64]:
    """(m,) of each joined measurement the number of its range, all rounds counted through; -1 = it is none."""
    begins = np.cumsum([0, *(len(one) for one in lists)])[:-1]
    numbers = begins[measured.source] + measured.row if len(measured) else np.zeros(0, np.int64)
    found: npt.NDArray[np.int64] = np.where(numbers < ranges, numbers, -1)
    return found
