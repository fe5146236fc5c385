"""What a detector is told before it runs, and the tolerances that follow from it (seed 000, "Error Propagation")."""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal

from .errors import DetectionInputError

__all__ = [
    "DetectorSettings",
    "false_positive_rate",
    "k_for_false_positive_rate",
    "sigma_geometric_m",
    "sigma_odometry_m",
]


def sigma_geometric_m(
    range_sigma_m: float,
    anchor_sigma_m: float = 0.0,
    calculation_sigma_m: float = 0.0,
    speed_m_per_s: float = 0.0,
    time_sigma_s: float = 0.0,
) -> float:
    """One sigma of a range against the geometry: ranging, the anchor's place along the range, and the calculation.

    A rover that moves adds what its speed makes of times that are not known better (seed 000 has that for odometry).
    """
    moved_m = speed_m_per_s * time_sigma_s
    return math.sqrt(range_sigma_m**2 + anchor_sigma_m**2 + calculation_sigma_m**2 + moved_m**2)


def sigma_odometry_m(
    wheel_sigma_m: float, accelerometer_sigma_m: float = 0.0, speed_m_per_s: float = 0.0, time_sigma_s: float = 0.0
) -> float:
    """One sigma of a displacement: wheels, accelerometer, and the time that speed turns into metres."""
    return math.sqrt(wheel_sigma_m**2 + accelerometer_sigma_m**2 + (speed_m_per_s * time_sigma_s) ** 2)


def false_positive_rate(k: float) -> float:
    """Share of clear ranges beyond k sigma: 4.6 % at 2, 0.27 % at 3, 0.0063 % at 4; raises DetectionInputError."""
    if not (math.isfinite(k) and k > 0.0):
        raise DetectionInputError(f"k must be a number > 0, not {k}.")
    return math.erfc(k / math.sqrt(2.0))


def k_for_false_positive_rate(rate: float) -> float:
    """How many sigmas a tolerance takes for so large a share of clear ranges beyond it; raises DetectionInputError."""
    if not 0.0 < rate < 1.0:
        raise DetectionInputError(f"A false-positive rate lies between 0 and 1, not at {rate}.")
    return -NormalDist().inv_cdf(rate / 2.0)


POSITIVE = (
    "range_sigma_m",
    "k_geometric",
    "k_odometry",
    "max_range_m",
    "max_speed_m_per_s",
    "acceleration_m_per_s2",
    "vertical_acceleration_m_per_s2",
    "excess_m",
    "start_sigma_m",
)
NOT_NEGATIVE = (
    "anchor_sigma_m",
    "calculation_sigma_m",
    "wheel_sigma_m",
    "accelerometer_sigma_m",
    "time_sigma_s",
    "heading_sigma_rad",
    "heading_offset_sigma_rad",
    "heading_drift_rad_per_s",
)
OPTIONAL_POSITIVE = ("geometric_tolerance_m", "odometry_tolerance_m", "harmful_m")
SHARES = ("persistence", "occlusion_threshold", "cautious_threshold")
FINITE = ("odometry_offset_s", "ranging_offset_s", "base_offset_s")


@dataclass(frozen=True, slots=True)
class DetectorSettings:
    """What a detector is told before it runs; every default is that of seed 000 where it gives one.

    dimension: 3, or 2 where all heights are known to be those of one plane.
    range_sigma_m, anchor_sigma_m, calculation_sigma_m: one sigma of a range (a measurement may bring its own), of an
        anchor's place (an anchor may bring its own) and of the calculation.
    wheel_sigma_m, accelerometer_sigma_m, time_sigma_s: of one odometry increment, and of the clocks against each other.
    heading_sigma_rad, heading_offset_sigma_rad, heading_drift_rad_per_s: one sigma of each heading, of what all are
        off by at the start (pi = a gyro that knows no north), and of how fast that drifts.
    k_geometric, k_odometry: tolerances in sigmas; ``k_for_false_positive_rate`` gives them for a rate.
    geometric_tolerance_m, odometry_tolerance_m: fixed tolerances instead of k sigma.
    harmful_m: a range is called occluded where it is too long by more than this; None = the geometric tolerance.
    max_range_m, max_speed_m_per_s: beyond them a range is rejected, odometry unreliable.
    window, persistence: a violation is confirmed by this share of the last so many epochs.
    occlusion_threshold, cautious_threshold: fused probability beyond which an anchor is occluded, where the witnesses
        agree and where they do not.
    terrain, criticality: scale the tolerances: complex ground and critical missions make the detector more sensitive.
    search_limit: sets of ranges fitted in one epoch before the search is cut short; its other work is bounded alike.
    altitude_hint_m, side_hint_m: which of two mirror solutions is the rover's: an altitude near it (3D), or a point on
        its side of the anchors (east, north).
    odometry_offset_s, ranging_offset_s, base_offset_s: seconds that the clock of each is ahead of a common one. Times
        come in on the ranging clock and leave on that of the base station.
    acceleration_m_per_s2, vertical_acceleration_m_per_s2: how hard the rover usually speeds up, brakes and turns, level
        and upright.
    excess_m: how much longer than the straight line an occluded range typically is.
    start_m, start_sigma_m: where the rover starts, if that is known: (d,) east, north, altitude.
    Raises DetectionInputError.
    """

    dimension: Literal[2, 3] = 3
    range_sigma_m: float = 0.1
    anchor_sigma_m: float = 0.0
    calculation_sigma_m: float = 0.0
    wheel_sigma_m: float = 0.02
    accelerometer_sigma_m: float = 0.0
    time_sigma_s: float = 0.0
    heading_sigma_rad: float = math.radians(1.0)
    heading_offset_sigma_rad: float = math.radians(6.0)
    heading_drift_rad_per_s: float = math.radians(0.06)
    k_geometric: float = 3.0
    k_odometry: float = 3.0
    geometric_tolerance_m: float | None = None
    odometry_tolerance_m: float | None = None
    harmful_m: float | None = None
    max_range_m: float = 100_000.0
    max_speed_m_per_s: float = 10.0
    window: int = 5
    persistence: float = 0.6
    occlusion_threshold: float = 0.6
    cautious_threshold: float = 0.4
    terrain: Literal["open", "mixed", "complex"] = "mixed"
    criticality: Literal["low", "normal", "high"] = "normal"
    search_limit: int = 1500
    altitude_hint_m: float | None = None
    side_hint_m: tuple[float, float] | None = None
    odometry_offset_s: float = 0.0
    ranging_offset_s: float = 0.0
    base_offset_s: float = 0.0
    acceleration_m_per_s2: float = 1.25
    vertical_acceleration_m_per_s2: float = 0.25
    excess_m: float = 0.7
    start_m: tuple[float, ...] | None = None
    start_sigma_m: float = 1.0

    def __post_init__(self) -> None:
        if self.dimension not in (2, 3):
            raise DetectionInputError(f"dimension must be 2 or 3, not {self.dimension}.")
        for name in POSITIVE:
            self._demand(name, getattr(self, name), "> 0")
        for name in OPTIONAL_POSITIVE:
            if getattr(self, name) is not None:
                self._demand(name, getattr(self, name), "> 0")
        for name in NOT_NEGATIVE:
            self._demand(name, getattr(self, name), ">= 0")
        for name in FINITE:
            self._demand(name, getattr(self, name), "finite")
        for name in SHARES:
            if not 0.0 < getattr(self, name) <= 1.0:
                raise DetectionInputError(f"{name} must lie above 0 and at most at 1, not at {getattr(self, name)}.")
        for name in ("window", "search_limit"):
            if getattr(self, name) < 1:
                raise DetectionInputError(f"{name} must be at least 1, not {getattr(self, name)}.")
        if self.start_m is not None and (
            len(self.start_m) != self.dimension or not all(map(math.isfinite, self.start_m))
        ):
            raise DetectionInputError(f"start_m must be {self.dimension} finite metres, not {self.start_m}.")
        if self.terrain not in ("open", "mixed", "complex"):
            raise DetectionInputError(f"terrain must be open, mixed or complex, not {self.terrain!r}.")
        if self.criticality not in ("low", "normal", "high"):
            raise DetectionInputError(f"criticality must be low, normal or high, not {self.criticality!r}.")

    @staticmethod
    def _demand(name: str, value: float, what: str) -> None:
        fits = {"> 0": value > 0.0, ">= 0": value >= 0.0, "finite": True}[what]
        if not (math.isfinite(value) and fits):
            raise DetectionInputError(f"{name} must be a number {what}, not {value}.")
