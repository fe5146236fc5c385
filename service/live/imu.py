"""Readings of an inertial unit in the epochs of a session, and what the session is told of the unit."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, model_validator

from navigation import MeasurementError
from navigation.drives import DriveSettings, InertialEstimator
from navigation.inertial import IMU_PRESETS
from service.errors import RequestError
from service.parts.points import DegreesNorth, Metres, NotNegative, Number, Positive, StrictModel

__all__ = ["Felt", "FeltOut", "ImuIn", "InertialUnitIn", "LogReadings", "felt", "readings_of"]

Array = npt.NDArray[np.float64]
Three = tuple[Number, Number, Number]
MOST_READINGS = 4000
UNUSED = "Not used: the session has no estimator inertial."
FIRST = "The first increment of a session has no time before it, and is not used."
MOST_AHEAD_S = 3600.0  # of an epoch: a reading of another clock would make all that follow it late


class InertialUnitIn(StrictModel):
    """The inertial unit of a session and how it is mounted."""

    unit: Literal["ADIS16405", "Leador-A15", "H764G", "tactical", "lower"] = Field(
        "tactical", description="Its errors: a preset from a datasheet."
    )
    # the filter's own sentence says more than a pattern
    axes: str = Field(
        "flu",
        max_length=3,
        description="Where x, y and z of the unit point: forward, back, left, right, up, down.",
        json_schema_extra={"pattern": "^[fblrud]{3}$"},
    )
    heading_deg: Number | None = Field(
        None,
        description="Heading at the beginning, degrees clockwise from the anchors' north; null = the course, once the "
        "rover drives forward clearly faster than its velocity is unsure.",
    )
    heading_sigma_deg: Positive = Field(5.0, description="One-sigma error of that, degrees.")
    lever_arm_m: tuple[Metres, Metres, Metres] = Field(
        (0.0, 0.0, 0.0), description="From the unit to the antenna, forward, left, up, metres."
    )
    standstill_sigma_m_per_s: NotNegative = Field(
        0.0, description="Of zero velocity where the readings are still, metres per second; 0 = off."
    )
    sideways_sigma_m_per_s: NotNegative = Field(
        0.0, description="Of going neither sideways nor off the ground, metres per second; 0 = off."
    )
    lat_deg: DegreesNorth | None = Field(None, description="Latitude where no DEM tells it, degrees; null = 45.")

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        try:
            self.settings()
        except MeasurementError as error:
            raise ValueError(str(error)) from error
        return self

    def settings(self) -> DriveSettings:
        """The same for the filter. Raises MeasurementError."""
        heading = None if self.heading_deg is None else math.radians(self.heading_deg)
        return DriveSettings(
            imu=IMU_PRESETS[self.unit],
            axes=self.axes,
            heading_rad=heading,
            heading_sigma_rad=math.radians(self.heading_sigma_deg),
            lever_arm_m=self.lever_arm_m,
            standstill_sigma_m_per_s=self.standstill_sigma_m_per_s,
            sideways_sigma_m_per_s=self.sideways_sigma_m_per_s,
        )


class ImuIn(StrictModel):
    """What an inertial unit read since the epoch before, up to this one: rates, or increments."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"times_s": [12.0], "forces": [[0.0, 0.0, 9.81]], "rates": [[0.0, 0.0, 0.0]]}]}
    )

    times_s: Annotated[list[Number], Field(min_length=1, max_length=MOST_READINGS)] = Field(
        description="When each was taken, seconds on the ranging clock, rising; each stands for the time since the one "
        "before."
    )
    forces: list[Three] | None = Field(None, description="What accelerometers read along x, y, z: +g upwards at rest.")
    rates: list[Three] | None = Field(None, description="What gyros read about x, y, z, a second.")
    delta_velocities: list[Three] | None = Field(
        None, description="In place of forces and rates: velocity gained since the reading before."
    )
    delta_angles: list[Three] | None = Field(None, description="With those: angle turned since the reading before.")
    force_unit: Literal["m/s2", "g"] = Field(
        "m/s2", description="Of forces; of velocities gained the same times a second: m/s, or g s."
    )
    angle_unit: Literal["rad", "deg"] = Field("rad", description="Of rates (a second) and of angles.")

    @model_validator(mode="after")
    def _rates_or_increments(self) -> Self:
        of_rates, of_increments = (self.forces, self.rates), (self.delta_velocities, self.delta_angles)
        given = [pair for pair in (of_rates, of_increments) if pair != (None, None)]
        if len(given) != 1 or any(one is None for one in given[0]):
            raise ValueError("Readings are forces and rates, or delta_velocities and delta_angles.")
        if any(len(one or ()) != len(self.times_s) for one in given[0]):
            raise ValueError(f"Readings must be as many as times_s, {len(self.times_s)}.")
        return self

    def readings(self, last_s: float | None) -> tuple[Array, Array, Array, tuple[str, ...]]:
        """(times (k,), forces (k, 3) in m/s², rates (k, 3) in rad/s, what to know); last_s: of the reading before."""
        times_s = np.array(self.times_s, np.float64)
        forces = np.array(self.forces if self.delta_velocities is None else self.delta_velocities, np.float64)
        rates = np.array(self.rates if self.delta_angles is None else self.delta_angles, np.float64)
        forces *= 9.80665 if self.force_unit == "g" else 1.0
        rates *= math.pi / 180.0 if self.angle_unit == "deg" else 1.0
        if self.delta_velocities is None:
            return times_s, forces, rates, ()
        steps_s = np.diff(times_s, prepend=math.nan if last_s is None else last_s)
        # what is not later than the one before is told by its time, not by an infinite rate
        steps_s[~(steps_s > 0.0) & ~np.isnan(steps_s)] = 1.0
        begin = int(last_s is None)
        forces, rates = forces[begin:] / steps_s[begin:, None], rates[begin:] / steps_s[begin:, None]
        return times_s[begin:], forces, rates, (FIRST,) if begin else ()


class FeltOut(BaseModel):
    """What became of an epoch's inertial readings."""

    model_config = ConfigDict(extra="forbid")

    readings: int = Field(description="How many came.")
    used: int = Field(description="How many were taken.")
    riding: bool = Field(description="Whether the estimate is of inertial navigation; false: it has not begun.")
    warnings: list[str] = Field(description="What to know of them, in sentences.")


@dataclass(frozen=True, slots=True)
class Felt:
    """What became of an epoch's inertial readings, as ``FeltOut``."""

    readings: int
    used: int
    warnings: tuple[str, ...]


def felt(
    asked: ImuIn | None, inertial: InertialEstimator | None, epoch_s: float, latest_s: float | None
) -> tuple[Felt | None, float | None]:
    """Give the readings of an epoch at some time to the filter, if it has one; (None where none came, latest_s).

    latest_s: of the reading before, which the filter need not have kept.
    """
    if asked is None:
        return None, latest_s
    if inertial is None:
        return Felt(len(asked.times_s), 0, (UNUSED,)), None
    times_s, forces, rates, told = asked.readings(latest_s if inertial.latest_s is None else inertial.latest_s)
    near = times_s <= epoch_s + MOST_AHEAD_S
    if not near.all():
        told = (*told, f"Readings over an hour later than their epoch, not used: {np.count_nonzero(~near)}.")
    used, more = inertial.feel(times_s[near], forces[near], rates[near]) if near.any() else (0, ())
    latest_s = max((time_s for time_s in asked.times_s if time_s <= epoch_s + MOST_AHEAD_S), default=latest_s)
    return Felt(len(asked.times_s), used, (*told, *more)), latest_s


def readings_of(epochs: Sequence[ImuIn]) -> tuple[Array, Array, Array, tuple[str, ...]]:
    """What epochs hold one after the other, as ``ImuIn.readings`` has it of one."""
    last_s: float | None = None
    parts, told = [], dict[str, None]()
    for one in epochs:
        *columns, said = one.readings(last_s)
        parts.append(columns)
        told |= dict.fromkeys(said)
        last_s = one.times_s[-1]
    times_s, forces, rates = (np.concatenate(column) for column in zip(*parts, strict=True))
    return times_s, forces, rates, tuple(told)


class LogReadings:
    """The inertial readings of a log, given to a filter up to each epoch; changed in place.

    times_s: (k,) on the ranging clock; forces, rates: (k, 3), as ``InertialEstimator.feel`` takes them. used: how many
    it took; riding: after how many epochs its estimate was of inertial navigation.
    """

    def __init__(self, inertial: InertialEstimator, times_s: Array, forces: Array, rates: Array) -> None:
        self._inertial, self._times_s, self._forces, self._rates = inertial, times_s, forces, rates
        self._next = 0
        self._told = Counter[str]()
        self.used = self.riding = 0

    def __len__(self) -> int:
        return len(self._times_s)

    def check_beside(self, from_s: float, to_s: float) -> None:
        """Raises RequestError where no reading is of the time of the ranges."""
        if not ((self._times_s >= from_s) & (self._times_s <= to_s)).any():
            raise RequestError(
                f"No inertial reading is of the time of the ranges: those are from {from_s:.2f} to {to_s:.2f} s, the "
                f"readings from {self._times_s[0]:.2f} to {self._times_s[-1]:.2f} s."
            )

    def give(self, until_s: float) -> None:
        """Give the filter what was read up to an epoch."""
        end = int(np.searchsorted(self._times_s, until_s, side="right"))
        if end > self._next:
            now = slice(self._next, end)
            used, told = self._inertial.feel(self._times_s[now], self._forces[now], self._rates[now])
            self.used += used
            self._told.update(told)
            self._next = end

    def note(self) -> None:
        """Take in that the filter has had its epoch."""
        self.riding += self._inertial.riding

    def warnings(self) -> tuple[str, ...]:
        """What there is to know of the readings, the most frequent first."""
        return tuple(one if often == 1 else f"{one} ({often} times)" for one, often in self._told.most_common(5))
