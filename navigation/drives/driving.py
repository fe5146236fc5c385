"""A drive's log, navigated: which beginning it fits, the track, and what became of each measurement."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..bubbles import bubble_radius_m
from ..errors import MeasurementError
from ..inertial import ImuLog, InertialStart, InertialTrack, Measurements, TangentFrame, angles_of, navigate
from ..ranging import Verdict
from .beginning import beginnings
from .logs import DriveLog, Foreseen, drive_measurements, imu_of
from .settings import DriveSettings

__all__ = ["DriveTrack", "navigate_drive"]

Array = npt.NDArray[np.float64]
# headings whose likelihoods differ by less than a factor of e^5 are not decided
DECIDED = 5.0


@dataclass(frozen=True, eq=False)
class DriveTrack:
    """A drive as it was navigated, at n readings: times_s (n,), position_m and velocity_m_per_s (n, 3) east, north, up,
    of the unit; angles_rad (n, 3) heading, pitch, roll; *_covariance_m2 (n, 3, 3), sigmas (n, states) of the error
    state; radius_m (n,) of the bubble. Smoothed where that was asked for, whose readings are those with measurements.

    filtered: what was believed at each reading. measurements, source: SOURCES of each. told: in sentences.
    """

    times_s: Array
    position_m: Array
    velocity_m_per_s: Array
    angles_rad: Array
    position_covariance_m2: Array
    sigmas: Array
    radius_m: Array
    reading: npt.NDArray[np.int64]
    smoothed: bool
    imu: ImuLog
    start: InertialStart
    filtered: InertialTrack
    measurements: Measurements
    told: tuple[str, ...]

    def used(self, source: int) -> tuple[int, int]:
        """(how many measurements of a source were used, how many there are)."""
        mine = self.measurements.source == source
        taken = np.isin(self.filtered.verdict[mine], (Verdict.USED, Verdict.REACQUIRED))
        return int(np.count_nonzero(taken)), int(np.count_nonzero(mine))


def navigate_drive(
    log: DriveLog, settings: DriveSettings, frame: TangentFrame, foreseen: Foreseen | None = None
) -> DriveTrack:
    """Navigate through a drive. Raises MeasurementError, StateError, TimeOrderError.

    Where nothing tells the heading, headings all round are tried, and the one that the log fits best is taken.
    """
    imu = imu_of(log, settings, float(np.linalg.norm(frame.gravity_m_per_s2())))
    measured, passed = drive_measurements(log, imu, settings, foreseen or Foreseen())
    if not len(measured):
        nothing = "Nothing in the log corrects the inertial readings: no fix, range or speed within them."
        raise MeasurementError(" ".join((nothing, *passed)))
    begun = beginnings(log, imu, settings, frame)

    def gone(start: InertialStart, smoother: bool) -> InertialTrack:
        return navigate(
            imu,
            start,
            measured,
            settings.imu,
            frame,
            smoother=smoother,
            gap_acceleration_m_per_s2=settings.gap_acceleration_m_per_s2,
            gap_rate_rad_per_s=settings.gap_rate_rad_per_s,
        )

    start, told = begun.starts[0], list(begun.told)
    if len(begun.starts) > 1:
        start, sentence = _fitting(begun.starts, (gone(one, False) for one in begun.starts))
        told.append(sentence)
    track = gone(start, settings.smoother)
    lost = int(np.count_nonzero(track.verdict == Verdict.REACQUIRED))
    if lost:
        told.append(
            f"Hardly anything fitted any more, and what was believed was widened until it did; measurements that "
            f"were taken so: {lost}."
        )
    smoothed = track.smoothed
    covariance = track.position_covariance_m2 if smoothed is None else smoothed.position_covariance_m2
    return DriveTrack(
        track.times_s if smoothed is None else smoothed.times_s,
        track.position_m if smoothed is None else smoothed.position_m,
        track.velocity_m_per_s if smoothed is None else smoothed.velocity_m_per_s,
        track.angles_rad if smoothed is None else angles_of(smoothed.quaternion),
        covariance,
        track.sigmas if smoothed is None else smoothed.sigmas,
        bubble_radius_m(covariance, settings.epsilon),
        np.arange(len(track.times_s)) if smoothed is None else smoothed.reading,
        smoothed is not None,
        imu,
        start,
        track,
        measured,
        (*imu.warnings, *passed, *told),
    )


def _fitting(starts: tuple[InertialStart, ...], tracks: Iterable[InertialTrack]) -> tuple[InertialStart, str]:
    """(the beginning whose track foretells the measurements best, what was decided)."""
    fits = np.array([_log_likelihood(track) for track in tracks])
    best, second = np.argsort(-fits)[:2]
    found = math.degrees(float(angles_of(np.asarray(starts[best].quaternion))[0]))
    sentence = f"Nothing told the heading at the beginning: of {len(starts)} tried the log fits {found:.0f}° best"
    if fits[best] - fits[second] < DECIDED:
        other = math.degrees(float(angles_of(np.asarray(starts[second].quaternion))[0]))
        sentence += f", and {other:.0f}° hardly less"
    return starts[int(best)], f"{sentence}."


def _log_likelihood(track: InertialTrack) -> float:
    """Of the innovations; one that was not believed counts as the worst that is."""
    there = np.isfinite(track.innovation_variance) & (track.innovation_variance > 0.0)
    squared = track.innovation[there] ** 2 / track.innovation_variance[there]
    return float(-0.5 * (np.minimum(squared, 100.0) + np.log(track.innovation_variance[there])).sum())
