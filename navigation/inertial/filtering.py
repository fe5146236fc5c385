"""Inertial navigation through a log: a belief at its beginning, readings, and measurements that correct it."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from gnss import ReceiverClock

from ..errors import StateError, TimeOrderError
from ..inputs import check_covariance, numbers
from .alignment import angles_of
from .bodies import TangentFrame
from .imu import ImuNoise
from .kernels import corrections, logs
from .kernels import error_state as kernel
from .measurements import Measurements
from .samples import ImuLog
from .smoothing import SmoothedTrack, smooth

__all__ = ["ClockNoise", "InertialStart", "InertialTrack", "navigate"]

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class ClockNoise:
    """How surely a receiver's clock is known at the beginning, in metres of range, and how it wanders in a second.

    Raises StateError.
    """

    offset_sigma_m: float = 1e5
    drift_sigma_m_per_s: float = 100.0
    walk_m_per_sqrt_s: float = 0.1
    drift_walk_m_per_s_sqrt_s: float = 0.1

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if not math.isfinite(value) or value < 0.0 or ("sigma" in one.name and value == 0.0):
                raise StateError(f"{one.name} of the clock must be finite, sigmas above zero, walks zero or more.")


@dataclass(frozen=True, eq=False)
class InertialStart:
    """What is believed at the first reading, east, north, up; quaternion (4,) turns forward, left, up into that.

    Sigmas: (3,) or one for all; attitude_sigma_rad: of turns about east, north, up. lever_arm_m: (3,) from the unit to
    the antenna, forward, left, up; lever_arm_sigma_m: 0 = known for certain, not estimated. Biases are what the unit
    reads too much, scale factors what of it. clock: of a receiver whose pseudoranges come in, two more states, its
    times those of the log; clock_noise: how surely it is known. phases: whether changes of its carrier phases come in,
    seven more, of the epoch before (position, psi and clock). covariance: (n, n) of the error state without those
    seven, in place of all sigmas, as a track ends with. Raises StateError.
    """

    position_m: npt.ArrayLike
    velocity_m_per_s: npt.ArrayLike
    quaternion: npt.ArrayLike
    position_sigma_m: npt.ArrayLike = 10.0
    velocity_sigma_m_per_s: npt.ArrayLike = 0.1
    attitude_sigma_rad: npt.ArrayLike = 0.02
    force_bias_m_per_s2: npt.ArrayLike = (0.0, 0.0, 0.0)
    rate_bias_rad_per_s: npt.ArrayLike = (0.0, 0.0, 0.0)
    lever_arm_m: npt.ArrayLike = (0.0, 0.0, 0.0)
    lever_arm_sigma_m: float = 0.0
    force_scale: npt.ArrayLike = (0.0, 0.0, 0.0)
    rate_scale: npt.ArrayLike = (0.0, 0.0, 0.0)
    clock: ReceiverClock | None = None
    clock_noise: ClockNoise = ClockNoise()
    phases: bool = False
    covariance: npt.ArrayLike | None = None

    def belief(self, noise: ImuNoise, at_s: float = 0.0) -> tuple[kernel.Belief, kernel.Layout]:
        """The kernels' belief: 15 error states, 3 more with the lever arm, 6 with scale factors, 2 with a clock, 7 with
        phases.

        at_s: of the first reading.
        """
        if self.phases and self.clock is None:
            raise StateError(
                "Changes of phase need the receiver's clock: InertialStart(…, clock=gnss.ReceiverClock())."
            )
        quaternion = numbers("quaternion", self.quaternion, (4,), StateError)
        length = float(np.linalg.norm(quaternion))
        if not length > 0.0 or not math.isfinite(length):
            raise StateError("quaternion must hold four finite numbers, not all zero.")
        scales = noise.force_scale > 0.0 or noise.rate_scale > 0.0
        sigmas = [
            _three("position_sigma_m", self.position_sigma_m),
            _three("velocity_sigma_m_per_s", self.velocity_sigma_m_per_s),
            _three("attitude_sigma_rad", self.attitude_sigma_rad),
            np.full(3, noise.force_bias_m_per_s2),
            np.full(3, noise.rate_bias_rad_per_s),
        ]
        if scales:
            sigmas += [np.full(3, noise.force_scale), np.full(3, noise.rate_scale)]
        lever = 3 * len(sigmas) if self.lever_arm_sigma_m > 0.0 else -1
        if lever >= 0:
            sigmas.append(np.full(3, float(self.lever_arm_sigma_m)))
        clock = 3 * len(sigmas) if self.clock else -1
        layout = kernel.Layout(15 if scales else -1, lever, clock, clock + 2 if self.phases else -1)
        offset = np.zeros(2)
        if self.clock is not None:
            sigmas.append(np.array([self.clock_noise.offset_sigma_m, self.clock_noise.drift_sigma_m_per_s]))
            offset[:] = float(self.clock.ranges_m(at_s)), self.clock.drift_m_per_s
        covariance = np.diag(np.concatenate(sigmas) ** 2)
        if self.covariance is not None:
            covariance = numbers("covariance", self.covariance, covariance.shape, StateError)
        check_covariance("The covariance at the beginning", covariance)
        if self.phases:  # of no epoch as yet
            covariance = np.pad(covariance, (0, kernel.KEPT))
        told = ("force_bias_m_per_s2", "rate_bias_rad_per_s", "force_scale", "rate_scale")
        sensors = np.stack([numbers(name, getattr(self, name), (3,), StateError) for name in told])
        values = [
            numbers("position_m", self.position_m, (3,), StateError),
            numbers("velocity_m_per_s", self.velocity_m_per_s, (3,), StateError),
            numbers("lever_arm_m", self.lever_arm_m, (3,), StateError),
        ]
        if not all(np.isfinite(value).all() for value in [*values, sensors]):
            raise StateError("The belief at the beginning must hold finite numbers.")
        position, velocity, arm = values
        attitude = quaternion / length
        none = np.full(3, math.nan), attitude.copy(), np.full(1, math.nan)
        return kernel.Belief(position, velocity, attitude, sensors, arm, offset, *none, covariance, np.zeros(1)), layout


@dataclass(frozen=True, eq=False)
class InertialTrack:
    """What is believed after each of k readings, and what became of m measurements.

    position_m, velocity_m_per_s: (k, 3) of the unit, east, north, up. quaternion: (k, 4). force_bias, rate_bias,
    force_scale, rate_scale: (k, 3). sigmas: (k, n) of the error state. position_covariance_m2: (k, 3, 3).
    covariance: (n, n) of the error state at the end, without what is kept of an epoch of phases, which sigmas end with.
    innovation, innovation_variance: (m,), NaN where left out; verdict: (m,) Verdict of ``navigation``, uint8.
    clock_m: (k, 2) offset and drift of the receiver's clock, 0 where there is none. smoothed: what the whole log says
    of the readings with measurements, where that was asked for.
    """

    times_s: Array
    position_m: Array
    velocity_m_per_s: Array
    quaternion: Array
    force_bias_m_per_s2: Array
    rate_bias_rad_per_s: Array
    force_scale: Array
    rate_scale: Array
    sigmas: Array
    position_covariance_m2: Array
    innovation: Array
    innovation_variance: Array
    verdict: npt.NDArray[np.uint8]
    lever_arm_m: Array
    covariance: Array
    clock_m: Array
    clock_noise: ClockNoise | None = None
    smoothed: SmoothedTrack | None = None

    @property
    def angles_rad(self) -> Array:
        """(k, 3) heading, pitch, roll."""
        return angles_of(self.quaternion)

    def end(self) -> InertialStart:
        """What is believed after the last reading, for a log that goes on from there."""
        clock, noise = None, self.clock_noise
        if noise is not None:
            offset_m, drift_m_per_s = self.clock_m[-1].tolist()
            clock = ReceiverClock.of_ranges(offset_m, drift_m_per_s, float(self.times_s[-1]))
        return InertialStart(
            self.position_m[-1],
            self.velocity_m_per_s[-1],
            self.quaternion[-1],
            force_bias_m_per_s2=self.force_bias_m_per_s2[-1],
            rate_bias_rad_per_s=self.rate_bias_rad_per_s[-1],
            lever_arm_m=self.lever_arm_m,
            lever_arm_sigma_m=1.0 if len(self.covariance) - (2 if clock else 0) in (18, 24) else 0.0,
            force_scale=self.force_scale[-1],
            rate_scale=self.rate_scale[-1],
            clock=clock,
            clock_noise=noise or ClockNoise(),
            phases=self.sigmas.shape[1] > len(self.covariance),
            covariance=self.covariance,
        )


def navigate(
    log: ImuLog,
    start: InertialStart,
    measurements: Measurements,
    noise: ImuNoise,
    frame: TangentFrame,
    *,
    smoother: bool = False,
    gap_acceleration_m_per_s2: float = 2.0,
    gap_rate_rad_per_s: float = 1.0,
) -> InertialTrack:
    """Navigate through a log in one compiled go.

    measurements: in order of time (``join``), none before the first reading or after the last. smoother: Rauch, Tung
    and Striebel's, back through the readings that have measurements; these are then taken at the end of their
    reading's step. gap_*: how much the vehicle may be pushed and turned within a second of a gap. Raises StateError,
    TimeOrderError.
    """
    belief, layout = start.belief(noise, float(log.times_s[0]))
    times = measurements.times_s
    if start.clock is None and np.isin(measurements.kinds, (corrections.PSEUDORANGE, corrections.PHASE_CHANGE)).any():
        raise StateError(
            "Pseudoranges and phases need the receiver's clock: InertialStart(…, clock=gnss.ReceiverClock())."
        )
    changes_s = np.unique(times[measurements.kinds == corrections.PHASE_CHANGE])
    if len(changes_s) and not start.phases:
        raise StateError("Changes of phase need what is kept of the epoch before: InertialStart(…, phases=True).")
    if smoother and (np.diff(np.searchsorted(log.times_s, changes_s)) == 0).any():
        raise StateError("Two epochs of carrier phases lie between two readings; a smoother needs a reading for each.")
    if len(times) and not (log.times_s[0] <= times[0] and times[-1] <= log.times_s[-1]):
        raise TimeOrderError(
            f"Measurements from {times[0]} to {times[-1]} s lie outside of the readings, "
            f"{log.times_s[0]} to {log.times_s[-1]} s."
        )
    count, size, kept = len(log.times_s), len(belief.covariance), kernel.KEPT if start.phases else 0
    decay = 0.0 if math.isinf(noise.correlation_s) else 1.0 / noise.correlation_s
    wander = math.sqrt(2.0 * decay) if decay > 0.0 else 1.0 / 60.0
    settings = (
        layout,
        kernel.Noise(
            noise.velocity_walk_m_per_s_sqrt_s,
            noise.angle_walk_rad_per_sqrt_s,
            noise.force_wander_m_per_s2 * wander,
            noise.rate_wander_rad_per_s * wander,
            # what a unit has at turn-on stays; only what wanders decays, and beside it that is small
            0.0 if noise.force_wander_m_per_s2 < noise.force_bias_m_per_s2 else decay,
            0.0 if noise.rate_wander_rad_per_s < noise.rate_bias_rad_per_s else decay,
            float(gap_acceleration_m_per_s2),
            float(gap_rate_rad_per_s),
            0.0 if start.clock is None else start.clock_noise.walk_m_per_sqrt_s,
            0.0 if start.clock is None else start.clock_noise.drift_walk_m_per_s_sqrt_s,
        ),
        frame.planet(),
    )
    track = logs.Track(
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        np.zeros((count, 4)),
        np.zeros((count, 4, 3)),
        np.zeros((count, size)),
        np.zeros((count, 3, 3)),
        np.zeros((count, 2)),
    )
    places = len(np.unique(np.searchsorted(log.times_s, times, side="left"))) if smoother else 0
    stages = logs.Stages(
        np.zeros((places, size, size)),
        np.zeros((places, size, size)),
        np.zeros((places, size, size)),
        np.zeros((places, size)),
        np.zeros(places, np.int64),
    )
    found, verdicts = np.zeros((len(measurements), 2)), np.zeros(len(measurements), np.uint8)
    readings = logs.Readings(log.times_s, log.forces_m_per_s2, log.rates_rad_per_s, log.gaps)
    events = logs.Events(
        times,
        measurements.kinds,
        measurements.values,
        measurements.variances,
        measurements.vectors,
        measurements.offsets_m,
        measurements.gates,
    )
    logs.filter_log(readings, events, belief, settings, track, stages, found, verdicts)
    return InertialTrack(
        log.times_s,
        track.positions,
        track.velocities,
        track.quaternions,
        track.sensors[:, 0].copy(),
        track.sensors[:, 1].copy(),
        track.sensors[:, 2].copy(),
        track.sensors[:, 3].copy(),
        track.sigmas,
        track.covariances,
        found[:, 0].copy(),
        found[:, 1].copy(),
        verdicts,
        belief.lever_m,
        belief.covariance[: size - kept, : size - kept].copy(),
        track.clocks,
        None if start.clock is None else start.clock_noise,
        smooth(log.times_s, track, stages) if smoother and places else None,
    )


def _three(name: str, value: npt.ArrayLike) -> Array:
    sigma = numbers(name, np.broadcast_to(value, (3,)) if np.ndim(value) == 0 else value, (3,), StateError)
    if not (np.isfinite(sigma) & (sigma >= 0.0)).all():
        raise StateError(f"{name} must be zero or more.")
    return sigma
