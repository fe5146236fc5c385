"""What ground and sensors make of a drive: occluded ranges, noise, losses, and the motion as wheels measure it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..epochs import OdometryIncrement, RangeEpoch, RangeMeasurement
from ..errors import DetectionInputError
from .drives import Floats, SimulatedDrive

__all__ = ["Occlusion", "RangingNoise", "draw_epochs", "occluded_by", "random_occlusions"]


@dataclass(frozen=True, slots=True)
class RangingNoise:
    """How good the sensors are.

    range_sigma_m, occluded_sigma_m: one sigma of a range in sight, and of one over an obstacle (None = the same).
    lost_share: of the ranges. wheel_sigma_m: one sigma of a displacement along each axis; None = no odometry.
    heading_sigma_rad: one sigma of the direction of motion; None = none is known. heading_offset_rad, by which all of
        them are off at the start, and heading_drift_rad_per_s, by which that grows. Raises DetectionInputError.
    """

    range_sigma_m: float = 0.1
    occluded_sigma_m: float | None = None
    lost_share: float = 0.0
    wheel_sigma_m: float | None = 0.02
    heading_sigma_rad: float | None = None
    heading_offset_rad: float = 0.0
    heading_drift_rad_per_s: float = 0.0

    def __post_init__(self) -> None:
        for name in ("range_sigma_m", "occluded_sigma_m", "wheel_sigma_m", "heading_sigma_rad"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise DetectionInputError(f"{name} must be a number >= 0, not {value}.")
        for name in ("heading_offset_rad", "heading_drift_rad_per_s"):
            if not math.isfinite(getattr(self, name)):
                raise DetectionInputError(f"{name} must be a number, not {getattr(self, name)}.")
        if not 0.0 <= self.lost_share < 1.0:
            raise DetectionInputError(f"lost_share must be at least 0 and below 1, not {self.lost_share}.")


def draw_epochs(drive: SimulatedDrive, noise: RangingNoise, generator: np.random.Generator) -> tuple[RangeEpoch, ...]:
    """What a rover measures on the drive, an epoch per moment of it; the same generator draws the same."""
    excess_m = drive.excess_m
    sigma_m = np.full(excess_m.shape, noise.range_sigma_m)
    if noise.occluded_sigma_m is not None:
        sigma_m[excess_m > 0.0] = noise.occluded_sigma_m
    ranges_m = drive.distances_m + excess_m + sigma_m * generator.standard_normal(excess_m.shape)
    heard = np.isfinite(excess_m) & (generator.random(excess_m.shape) >= noise.lost_share)
    motions = _motions(drive, noise, generator)
    return tuple(
        RangeEpoch(
            float(time_s),
            tuple(
                RangeMeasurement(drive.anchors[k].id, float(ranges_m[n, k]), p_sight=_prediction(drive.p_sight, n, k))
                for k in np.flatnonzero(heard[n]).tolist()
            ),
            motions[n],
            n,
        )
        for n, time_s in enumerate(drive.times_s)
    )


def _prediction(p_sight: Floats | None, n: int, k: int) -> float | None:
    return None if p_sight is None or math.isnan(p_sight[n, k]) else float(p_sight[n, k])


def _motions(
    drive: SimulatedDrive, noise: RangingNoise, generator: np.random.Generator
) -> list[OdometryIncrement | None]:
    """The motion before each epoch; the first has none. Wheels measure along the rover, so up counts as along."""
    if noise.wheel_sigma_m is None:
        return [None] * len(drive.times_s)
    steps_m = np.diff(drive.places_m, axis=0)
    along_m = np.linalg.norm(steps_m, axis=1)
    errors_m = noise.wheel_sigma_m * generator.standard_normal((len(steps_m), 2))
    turned_rad = (noise.heading_sigma_rad or 0.0) * generator.standard_normal(len(steps_m))
    turned_rad += noise.heading_offset_rad + noise.heading_drift_rad_per_s * (drive.times_s[1:] - drive.times_s[0])
    headings_rad = np.arctan2(steps_m[:, 0], steps_m[:, 1]) + turned_rad
    motions: list[OdometryIncrement | None] = [None]
    for n, duration_s in enumerate(np.diff(drive.times_s).tolist()):
        wheel_m = (float(along_m[n] + errors_m[n, 0]), float(errors_m[n, 1]))
        heading_rad = None if noise.heading_sigma_rad is None else float(headings_rad[n])
        motions.append(OdometryIncrement(duration_s, wheel_m, heading_rad=heading_rad))
    return motions


@dataclass(frozen=True, slots=True)
class Occlusion:
    """An anchor hidden in the epochs from ``from_s`` until before ``until_s``; excess_m: how much longer the way is."""

    anchor_id: str
    from_s: float
    until_s: float
    excess_m: float


def occluded_by(drive: SimulatedDrive, occlusions: Sequence[Occlusion]) -> SimulatedDrive:
    """The drive with these occlusions; where several of an anchor overlap, the longest way counts.

    Raises DetectionInputError.
    """
    numbers = {anchor.id: number for number, anchor in enumerate(drive.anchors)}
    excess_m = drive.excess_m.copy()
    for occlusion in occlusions:
        if occlusion.anchor_id not in numbers:
            raise DetectionInputError(f"The drive has no anchor {occlusion.anchor_id!r}.")
        if not occlusion.excess_m > 0.0:
            raise DetectionInputError(f"Anchor {occlusion.anchor_id}: excess_m must be > 0, not {occlusion.excess_m}.")
        column = excess_m[:, numbers[occlusion.anchor_id]]
        hidden = (drive.times_s >= occlusion.from_s) & (drive.times_s < occlusion.until_s)
        column[hidden] = np.maximum(column[hidden], occlusion.excess_m)  # NaN stays: what is not heard is not longer
    return replace(drive, excess_m=excess_m)


def random_occlusions(
    drive: SimulatedDrive,
    together: int,
    lasting_s: float,
    clear_s: float,
    excess_m: tuple[float, float],
    generator: np.random.Generator,
) -> list[Occlusion]:
    """Occlusions of ``together`` anchors at a time, drawn anew each time, with all anchors clear in between.

    lasting_s, clear_s: of each occlusion, and of the time before it; the drive begins clear. The beginning is shifted
    by up to one epoch, so that onsets fall between epochs. excess_m: drawn evenly between these.
    """
    every_s = float(np.median(np.diff(drive.times_s)))
    occlusions = []
    begin_s = float(drive.times_s[0]) + clear_s
    while begin_s + lasting_s < drive.times_s[-1]:
        from_s = begin_s + every_s * float(generator.uniform(-0.5, 0.5))
        for number in generator.choice(len(drive.anchors), size=together, replace=False).tolist():
            metres = float(generator.uniform(*excess_m))
            occlusions.append(Occlusion(drive.anchors[number].id, from_s, from_s + lasting_s, metres))
        begin_s += lasting_s + clear_s
    return occlusions
