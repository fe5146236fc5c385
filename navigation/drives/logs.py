"""What a vehicle measured on a drive: inertial readings, fixes, two-way ranges, an odometer's speeds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError
from ..inertial import (
    ImuLog,
    Measurements,
    imu_log,
    join,
    position_fixes,
    ranges_to_anchors,
    standing_still,
    standstill,
    vehicle_speeds,
    velocity_fixes,
)
from ..inputs import positions
from .satellites import Satellites, satellite_measurements
from .settings import DriveSettings

__all__ = ["SOURCES", "DriveLog", "Fixes", "Foreseen", "Ranges", "Readings", "Speeds", "drive_measurements", "imu_of"]

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
# what measurements are of, by ``Measurements.source``
SOURCES = ("range", "position", "velocity", "standstill", "speed", "sideways", "ground", "pseudorange", "phase")
# zero velocity, and that it does not slide, are said so often
ASIDE_S = 0.1


@dataclass(frozen=True, eq=False)
class Readings:
    """Of an inertial unit: times_s (k,), forces and rates (k, 3), in the units and axes of the settings."""

    times_s: npt.ArrayLike
    forces: npt.ArrayLike
    rates: npt.ArrayLike


@dataclass(frozen=True, eq=False)
class Fixes:
    """Of a satellite receiver: times_s (n,), positions_m (n, 3) in the frame and velocities (n, 3), NaN = none.

    *_sigmas: (n, 3), NaN = those of the settings.
    """

    times_s: Array
    positions_m: Array
    position_sigmas_m: Array
    velocities_m_per_s: Array
    velocity_sigmas_m_per_s: Array


@dataclass(frozen=True, eq=False)
class Ranges:
    """Two-way ranges: times_s (n,), anchor (n,) its number, measured_m (n,), sigmas_m (n,), NaN = the settings'.

    offsets_m: (n, 3) or (3,) from the antenna to the radio of each, forward, left, up, where there are several.
    """

    times_s: Array
    anchor: Ints
    measured_m: Array
    sigmas_m: Array
    offsets_m: npt.ArrayLike = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Speeds:
    """Of an odometer: times_s (n,), forward_m_per_s (n,)."""

    times_s: Array
    forward_m_per_s: Array


@dataclass(frozen=True, eq=False)
class DriveLog:
    """All that was measured. anchors_m: (k, 3) that ranges go to, in the frame. satellites: what a receiver heard."""

    readings: Readings
    fixes: Fixes | None = None
    ranges: Ranges | None = None
    speeds: Speeds | None = None
    anchors_m: npt.ArrayLike = ()
    satellites: Satellites | None = None


@dataclass(frozen=True, eq=False)
class Foreseen:
    """What a map says of a drive. sight: (n,) probability for each range, NaN = not known. heights: of the ground.
    sky: (n,) the same as sight for each row of the satellites."""

    sight: Array | None = None
    heights: Measurements | None = None
    sky: Array | None = None


def imu_of(log: DriveLog, settings: DriveSettings, gravity_m_per_s2: float) -> ImuLog:
    """The readings, checked. Raises MeasurementError, TimeOrderError."""
    read = log.readings
    return imu_log(
        np.asarray(read.times_s, np.float64) - settings.imu_late_s,
        read.forces,
        read.rates,
        axes=settings.axes,
        force_unit=settings.force_unit,
        rate_unit=settings.rate_unit,
        noise=settings.imu,
        max_gap_s=settings.max_gap_s,
        gravity_m_per_s2=gravity_m_per_s2,
    )


def drive_measurements(
    log: DriveLog, imu: ImuLog, settings: DriveSettings, foreseen: Foreseen
) -> tuple[Measurements, tuple[str, ...]]:
    """(what corrects the readings, in order of time; what was passed over, in sentences). Raises MeasurementError."""
    gate = settings.gate_sigma
    nothing = join()
    lists = dict.fromkeys(SOURCES, nothing)
    warnings: list[str] = []
    anchors = positions("anchors_m", log.anchors_m)
    if log.ranges is not None and len(log.ranges.times_s):
        ranges = log.ranges
        if not ((ranges.anchor >= 0) & (ranges.anchor < len(anchors))).all():
            raise MeasurementError(f"Ranges go to anchors 0 to {len(anchors) - 1}; one names another.")
        told = np.ones(len(ranges.times_s)) if foreseen.sight is None else foreseen.sight
        sight = np.where(np.isnan(told), 1.0, told)
        sigmas = np.where(np.isnan(ranges.sigmas_m), settings.range_sigma_m, ranges.sigmas_m)
        if settings.hidden_excess_m > 0.0:
            # one that may be hidden is off by an exponential of that mean as often as it is
            sigmas = np.hypot(sigmas, np.sqrt(2.0 * (1.0 - sight)) * settings.hidden_excess_m)
            sight = np.where(sight >= settings.least_sight, 1.0, 0.0)
        lists["range"] = ranges_to_anchors(
            ranges.times_s,
            anchors[ranges.anchor],
            np.where(ranges.measured_m > 0.0, ranges.measured_m, np.nan),
            sigmas,
            sight=sight,
            least_sight=settings.least_sight,
            offsets_m=ranges.offsets_m,
            gate_sigma=gate,
        )
    if log.fixes is not None and len(log.fixes.times_s):
        fixes = log.fixes
        sigmas = np.where(np.isnan(fixes.position_sigmas_m), settings.fix_sigma_m, fixes.position_sigmas_m)
        lists["position"] = position_fixes(fixes.times_s, fixes.positions_m, sigmas, gate_sigma=gate)
        sigmas = np.where(
            np.isnan(fixes.velocity_sigmas_m_per_s), settings.fix_velocity_sigma_m_per_s, fixes.velocity_sigmas_m_per_s
        )
        if not np.isnan(fixes.velocities_m_per_s).all():
            lists["velocity"] = velocity_fixes(fixes.times_s, fixes.velocities_m_per_s, sigmas, gate_sigma=gate)
    every = max(round(ASIDE_S / float(np.median(np.diff(imu.times_s)))), 1)
    at_s = imu.times_s[::every]
    if settings.standstill_sigma_m_per_s > 0.0:
        still = standing_still(imu, settings.standstill)[::every]
        lists["standstill"] = standstill(at_s[still], settings.standstill_sigma_m_per_s)
    if log.speeds is not None and len(log.speeds.times_s):
        lists["speed"] = vehicle_speeds(
            log.speeds.times_s,
            log.speeds.forward_m_per_s,
            settings.speed_sigma_m_per_s,
            mounting_rad=settings.mounting_rad,
            pivot_m=settings.pivot_m,
            rates_rad_per_s=_rates_at(imu, log.speeds.times_s),
            gate_sigma=gate,
        )
    if settings.sideways_sigma_m_per_s > 0.0:
        sure_s = at_s[~imu.gaps[::every]]
        lists["sideways"] = vehicle_speeds(
            sure_s,
            None,
            1.0,
            sideways_sigma_m_per_s=settings.sideways_sigma_m_per_s,
            mounting_rad=settings.mounting_rad,
            pivot_m=settings.pivot_m,
            rates_rad_per_s=_rates_at(imu, sure_s),
        )
    if foreseen.heights is not None:
        lists["ground"] = foreseen.heights
    if log.satellites is not None:
        told_of = satellite_measurements(log.satellites, imu, settings, foreseen.sky)
        lists["pseudorange"], lists["phase"], of_sky = told_of
        warnings.extend(of_sky)
    within = []
    for name, one in lists.items():
        inside = (one.times_s >= imu.times_s[0]) & (one.times_s <= imu.times_s[-1])
        outside = len({float(time_s) for time_s in one.times_s[~inside]})
        if outside:
            warnings.append(f"Not used, for they lie outside of the inertial readings: {outside} ({name}).")
        within.append(_only(one, inside))
    return join(*within), tuple(warnings)


def _rates_at(imu: ImuLog, times_s: Array) -> Array:
    """(n, 3) turn rates about instants, of a tenth of a second."""
    step_s = float(np.median(np.diff(imu.times_s)))
    width = max(round(ASIDE_S / step_s), 1)
    mean = [np.convolve(rate, np.full(width, 1.0 / width), "same") for rate in imu.rates_rad_per_s.T]
    return np.stack([np.interp(times_s, imu.times_s, one) for one in mean], axis=-1)


def _only(one: Measurements, kept: npt.NDArray[np.bool_]) -> Measurements:
    return Measurements(
        one.times_s[kept],
        one.kinds[kept],
        one.values[kept],
        one.variances[kept],
        np.ascontiguousarray(one.vectors[kept]),
        np.ascontiguousarray(one.offsets_m[kept]),
        one.gates[kept],
        one.source[kept],
        one.row[kept],
    )
