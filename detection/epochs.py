"""What comes in while a rover drives: ranges to anchors, the motion since the last ones, and when."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from .errors import DetectionInputError

__all__ = ["GroundHeight", "OdometryIncrement", "RangeEpoch", "RangeMeasurement", "RangingAnchor", "check_anchors"]


@dataclass(frozen=True, slots=True)
class RangingAnchor:
    """An anchor as the detector knows it: a place in a metric east, north, up frame, and how well it is known.

    altitude_m may stay 0 in two dimensions. sigma_m: one sigma of the place along a range. Raises DetectionInputError.
    """

    id: str
    east_m: float
    north_m: float
    altitude_m: float = 0.0
    sigma_m: float = 0.0

    def __post_init__(self) -> None:
        if not self.id:
            raise DetectionInputError("An anchor needs a non-empty id.")
        for name in ("east_m", "north_m", "altitude_m"):
            if not math.isfinite(getattr(self, name)):
                raise DetectionInputError(f"Anchor {self.id}: {name} must be finite, not {getattr(self, name)}.")
        if not (math.isfinite(self.sigma_m) and self.sigma_m >= 0.0):
            raise DetectionInputError(f"Anchor {self.id}: sigma_m must be >= 0 m, not {self.sigma_m}.")


@dataclass(frozen=True, slots=True)
class RangeMeasurement:
    """One measured range to one anchor, unchecked: the detector counts what is bad.

    sigma_m: one sigma of the ranging noise; None = the settings' range_sigma_m.
    p_sight: predicted probability that the anchor is in sight, 0 to 1, from wherever; None = none.
    time_s: when it was measured, on the ranging clock; None = the epoch's time.
    """

    anchor_id: str
    range_m: float
    sigma_m: float | None = None
    p_sight: float | None = None
    time_s: float | None = None


@dataclass(frozen=True, slots=True)
class OdometryIncrement:
    """Motion between the previous epoch and this one, by wheels, by accelerometer, or by both.

    duration_s: of the motion. wheel_m: (Δx, Δy) of the wheel encoders; accelerometer_m: (Δx, Δy, Δz), integrated. Both
        in the rover's own level frame, x forward, y to the left, z up; metres. Their lengths count.
    heading_rad: where the motion led, clockwise from north of the anchors' frame (driving backwards it is the tail's);
        None = unknown.
    """

    duration_s: float
    wheel_m: tuple[float, float] | None = None
    accelerometer_m: tuple[float, float, float] | None = None
    heading_rad: float | None = None


@dataclass(frozen=True, slots=True)
class GroundHeight:
    """How high the antenna of a rover that stands on known ground is: a plane about the place where it should be.

    altitude_m: of the antenna at (east_m, north_m); slope_east, slope_north: how that rises, metres per metre.
    sigma_m: one sigma of it. The same ground errs the same way epoch after epoch, so a track's height becomes no surer
    than that by it.
    """

    east_m: float
    north_m: float
    altitude_m: float
    slope_east: float
    slope_north: float
    sigma_m: float


@dataclass(frozen=True, slots=True)
class RangeEpoch:
    """Ranges that belong together, of one moment or of one round of the anchors.

    time_s: seconds on the ranging clock, the end of the round; any origin. sequence: the sender's number, if it counts.
    moved: anchors that are elsewhere from this epoch on (drones fly). ground: what a map knows of the antenna's height,
        in three dimensions; None = nothing.
    """

    time_s: float
    ranges: tuple[RangeMeasurement, ...]
    odometry: OdometryIncrement | None = None
    sequence: int | None = None
    moved: tuple[RangingAnchor, ...] = ()
    ground: GroundHeight | None = None


def check_anchors(anchors: Sequence[RangingAnchor]) -> None:
    """Raise DetectionInputError where two anchors share an id."""
    ids = [anchor.id for anchor in anchors]
    twice = sorted(i for i, count in Counter(ids).items() if count > 1)
    if twice:
        raise DetectionInputError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
