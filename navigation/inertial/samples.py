"""Readings of an inertial unit as logs have them, judged before they are navigated with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..errors import MeasurementError, TimeOrderError
from ..inputs import numbers
from .imu import STANDARD_GRAVITY, ImuNoise

__all__ = ["ImuLog", "from_forward_right_down", "imu_log", "turned"]

Array = npt.NDArray[np.float64]
# where x, y and z of a unit point: forward, back, left, right, up, down
TOWARDS = {"f": (1, 0, 0), "b": (-1, 0, 0), "l": (0, 1, 0), "r": (0, -1, 0), "u": (0, 0, 1), "d": (0, 0, -1)}
WORDS = {"f": "forward", "b": "back", "l": "left", "r": "right", "u": "up", "d": "down"}
# axes of a unit whose x, y or z points up or down, forward being another of its axes
FITTING = {"up": ("ufl", "fur", "flu"), "down": ("dfr", "fdl", "frd")}


@dataclass(frozen=True, eq=False)
class ImuLog:
    """Readings of k instants: times_s (k,), increasing; forces_m_per_s2 and rates_rad_per_s (k, 3), each the mean since
    the reading before, x forward, y left, z up. gaps: (k,) where the step before a reading is longer than max_gap_s, or
    an axis saturated: motion is unknown there. warnings: what was done about the log, a sentence each."""

    times_s: Array
    forces_m_per_s2: Array
    rates_rad_per_s: Array
    gaps: npt.NDArray[np.bool_]
    warnings: tuple[str, ...] = ()


def from_forward_right_down(vectors: npt.ArrayLike) -> Array:
    """(..., 3) x forward, y left, z up, of x forward, y right, z down; or the other way round."""
    return np.asarray(vectors, np.float64) * (1.0, -1.0, -1.0)


def turned(vectors: npt.ArrayLike, axes: str) -> Array:
    """(..., 3) x forward, y left, z up, of readings whose axes point as the three letters say, "frd" or "rfu".

    Letters: forward, back, left, right, up, down. Raises MeasurementError for what is no right-handed set of axes.
    """
    matrix = np.array([TOWARDS.get(letter, (0, 0, 0)) for letter in axes], np.float64)
    if matrix.shape != (3, 3) or not np.isclose(np.linalg.det(matrix), 1.0):
        raise MeasurementError(
            f"axes are three letters for x, y, z out of f, b, l, r, u, d, right-handed: flu, frd, rfu …, not {axes!r}."
        )
    found: Array = np.asarray(vectors, np.float64) @ matrix
    return found


def imu_log(
    times_s: npt.ArrayLike,
    forces: npt.ArrayLike,
    rates: npt.ArrayLike,
    *,
    axes: str = "flu",
    force_unit: Literal["m/s2", "g"] = "m/s2",
    rate_unit: Literal["rad/s", "deg/s"] = "rad/s",
    noise: ImuNoise | None = None,
    max_gap_s: float = 0.0,
    gravity_m_per_s2: float = STANDARD_GRAVITY,
) -> ImuLog:
    """A log's readings, checked: times, units, axes, gaps and saturation.

    times_s: (k,), (k, 3) forces (what an accelerometer tells: +g upwards at rest) and rates. axes: where x, y and z of
    the readings point, as for ``turned``: flu is forward, left, up; frd forward, right, down. Rows that repeat a time
    are dropped and told. noise: whose ranges tell saturation. max_gap_s: 0 = ten times the median step.
    gravity_m_per_s2: by which a log in g, or upside down, is known. Raises MeasurementError, TimeOrderError.
    """
    times = np.array(times_s, np.float64)
    if times.ndim != 1 or len(times) < 2:
        raise MeasurementError("An inertial log needs two readings at least.")
    force = turned(numbers("forces", forces, (len(times), 3)), axes)
    rate = turned(numbers("rates", rates, (len(times), 3)), axes)
    finite = np.isfinite(times) & np.isfinite(force).all(axis=1) & np.isfinite(rate).all(axis=1)
    if not finite.all():
        raise MeasurementError(f"Reading {int(np.argmin(finite))} of the inertial log is not finite.")
    steps = np.diff(times)
    if (steps < 0.0).any():
        first = int(np.argmax(steps < 0.0)) + 1
        raise TimeOrderError(
            f"The inertial log goes backwards: {times[first]} s follows {times[first - 1]} s at reading {first}.",
            index=first,
        )
    warnings = []
    fresh = np.concatenate([[True], steps > 0.0])
    if not fresh.all():
        warnings.append(f"Readings that repeat a time: {np.count_nonzero(~fresh)}; the first of each is used.")
        times, force, rate = times[fresh], force[fresh], rate[fresh]
    if len(times) < 2:
        raise MeasurementError("An inertial log needs two instants at least.")
    force = force * (STANDARD_GRAVITY if force_unit == "g" else 1.0)
    rate = np.radians(rate) if rate_unit == "deg/s" else rate
    warnings += _units(force, rate, axes, gravity_m_per_s2)
    steps = np.diff(times)
    longest = max_gap_s if max_gap_s > 0.0 else 10.0 * float(np.median(steps))
    gaps = np.concatenate([[False], steps > longest])
    if gaps.any():
        warnings.append(
            f"Gaps of more than {longest:.3g} s: {np.count_nonzero(gaps)}, {steps[gaps[1:]].sum():.1f} s together, the "
            f"longest {steps.max():.2f} s; motion there is taken as unknown."
        )
    if noise is not None:
        stuck = (np.abs(force) >= 0.999 * noise.force_range_m_per_s2).any(axis=1)
        stuck |= (np.abs(rate) >= 0.999 * noise.rate_range_rad_per_s).any(axis=1)
        if stuck.any():
            warnings.append(f"Saturated readings: {np.count_nonzero(stuck)}; motion there is taken as unknown.")
        gaps |= stuck
    return ImuLog(times, force, rate, gaps, tuple(warnings))


def _units(force: Array, rate: Array, axes: str, gravity_m_per_s2: float) -> list[str]:
    """Warnings; raises MeasurementError where units or axes cannot be what they are said to be."""
    pull = float(np.median(np.linalg.norm(force, axis=1)))
    if 0.8 < pull < 1.2 and gravity_m_per_s2 > 1.7:
        raise MeasurementError(f"Forces of {pull:.2f} m/s² in the median are in g, it seems; say force_unit='g'.")
    if pull > 50.0:
        raise MeasurementError(f"Forces of {pull:.0f} m/s² in the median are no driving; are they in g times m/s²?")
    spin = float(np.quantile(np.linalg.norm(rate, axis=1), 0.95))
    if spin > 15.0:
        raise MeasurementError(
            f"Turn rates of {spin:.0f} rad/s are in degrees, it seems; say so in rate_unit, a session in angle_unit."
        )
    upward = np.median(force, axis=0)
    largest = int(np.argmax(np.abs(upward)))
    if abs(upward[largest]) > 0.8 * gravity_m_per_s2 and (largest != 2 or upward[2] < 0.0):
        read = turned(np.eye(3), axes) @ upward  # along the unit's own axes
        one = int(np.argmax(np.abs(read)))
        side = "up" if read[one] > 0.0 else "down"
        raise MeasurementError(
            f"By gravity the unit's {'xyz'[one]} axis points {side}, where axes='{axes}' has it {WORDS[axes[one]]} "
            f"(median force {read.round(2).tolist()} m/s²); axes='{FITTING[side][one]}' would fit, as others with "
            f"{'xyz'[one]} {side}."
        )
    if not 0.7 * gravity_m_per_s2 < pull < 1.3 * gravity_m_per_s2 and math.isfinite(pull):
        return [f"The median force is {pull:.2f} m/s², gravity {gravity_m_per_s2:.2f}."]
    return []
