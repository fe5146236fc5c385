"""What each witness says about the ranges of an epoch, in numbers and in words: one say per range, in their order.

The witness of motion holds each range against a trusted one (step 7). A range that stays too long changes only once, at
the onset. So each new range is held against the last one that was trusted, and against all the way driven since; then a
lasting occlusion violates again and again, as the window asks.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

from .geometric import GeometricDetection
from .motion.odometry import Motion
from .settings import DetectorSettings
from .verdicts import Classification, Say, Witness, WitnessSay

__all__ = ["Change", "Trusted", "geometry_says", "motion_says", "odometry_says", "prediction_says"]


@dataclass(frozen=True, slots=True)
class Change:
    """What odometry says of one range.

    over_m: by how much the change exceeds what the motion allows, NaN = nothing to compare with; tolerance_m: ε of the
    test. violated: beyond it. confirmed: in enough of the window. high: by more than twice the tolerance. shorter: the
    range fell by more than the rover moved, so it was the trusted one that was too long.
    """

    over_m: float
    tolerance_m: float
    violated: bool
    confirmed: bool
    high: bool
    shorter: bool = False


@dataclass(slots=True)
class Trusted:
    """The last trusted range of an anchor, the motion since, and the window of violations; changed in place.

    direction: unit vector (east, north, up) from the rover to the anchor then, for the law of cosines; None = unknown.
    """

    window: deque[bool]
    range_m: float = math.nan
    variance_m2: float = 0.0
    direction: tuple[float, float, float] | None = None
    length_m: float = 0.0
    motion_variance_m2: float = 0.0
    displacement_m: tuple[float, float] | None = (0.0, 0.0)
    across_m: float = 0.0
    broken: bool = field(default=False)  # odometry was missing or unreliable since

    def drive(self, motion: Motion | None) -> None:
        """Add a reliable increment to the motion since the trusted range; None = there is none."""
        if motion is None:
            self.broken = True
            return
        self.length_m += motion.length_m
        self.motion_variance_m2 += motion.sigma_m**2
        self.across_m += motion.across_m  # a heading errs one way
        if self.displacement_m is None or motion.displacement_m is None:
            self.displacement_m = None
        else:
            self.displacement_m = (
                self.displacement_m[0] + motion.displacement_m[0],
                self.displacement_m[1] + motion.displacement_m[1],
            )

    def trust(self, range_m: float, sigma_m: float, direction: tuple[float, float, float] | None) -> None:
        """Take a range as the one to compare with from now on."""
        self.range_m, self.variance_m2, self.direction = range_m, sigma_m**2, direction
        self.length_m, self.motion_variance_m2, self.displacement_m, self.broken = 0.0, 0.0, (0.0, 0.0), False
        self.across_m = 0.0

    def judge(self, range_m: float, sigma_m: float, settings: DetectorSettings, scale: float) -> Change | None:
        """Hold a new range against the trusted one; None where there is none, or no odometry to bridge the time.

        The noise of both ranges belongs to the tolerance as much as that of the odometry does.
        """
        if math.isnan(self.range_m) or self.broken:
            return None
        variance_m2 = self.variance_m2 + sigma_m**2 + self.motion_variance_m2
        expected_m = self._expected_m()
        if expected_m is not None:
            variance_m2 += self.across_m**2
        tolerance_m = scale * settings.k_odometry * math.sqrt(variance_m2)
        if settings.odometry_tolerance_m is not None:
            tolerance_m = scale * settings.odometry_tolerance_m
        change_m = range_m - self.range_m
        over_m = abs(change_m) - self.length_m
        if expected_m is not None:
            # the triangle test stays the bound; the law of cosines is sharper where the way is known
            over_m = max(over_m, abs(range_m - expected_m))
            change_m = range_m - expected_m
        violated = over_m > tolerance_m
        self.window.append(violated)
        confirmed = sum(self.window) >= settings.persistence * (self.window.maxlen or 1)
        high = confirmed and over_m > 2.0 * tolerance_m
        return Change(over_m, tolerance_m, violated, confirmed, high, violated and change_m < 0.0)

    def _expected_m(self) -> float | None:
        if self.direction is None or self.displacement_m is None:
            return None
        east_m, north_m = self.displacement_m
        along_m = east_m * self.direction[0] + north_m * self.direction[1]
        return math.sqrt(max(self.range_m**2 + east_m**2 + north_m**2 - 2.0 * self.range_m * along_m, 0.0))


# A track is settled that knows a distance to this share of what is harmful.
SETTLED = 0.5
SURELY = 0.9987  # three sigma beyond what is harmful

GEOMETRY, ODOMETRY, MOTION, PREDICTION = Witness.GEOMETRY, Witness.ODOMETRY, Witness.MOTION, Witness.PREDICTION
CLEAR, OCCLUDED, TOO_SHORT, SILENT = Say.CLEAR, Say.OCCLUDED, Say.TOO_SHORT, Say.SILENT
NO_ODOMETRY = WitnessSay(ODOMETRY, SILENT, math.nan, 0.0, "no odometry since a range that was trusted")
NO_PREDICTION = WitnessSay(PREDICTION, SILENT, math.nan, 0.0, "no prediction")


def geometry_says(geometry: GeometricDetection, weight: float) -> list[WitnessSay]:
    """Whether each range meets the others of its epoch."""
    untold = "the ranges of the epoch do not tell"
    if geometry.classification is Classification.UNDETERMINED and geometry.needed:
        untold = "the ranges of the epoch do not tell which are too long"
    count, says = geometry.count, []
    for unknown, off, excess_m, statistic in zip(
        geometry.unknown.tolist(), geometry.off.tolist(), geometry.excess_m.tolist(), geometry.statistic.tolist(),
        strict=True,
    ):  # fmt: skip
        if unknown:
            says.append(WitnessSay(GEOMETRY, SILENT, statistic, 0.0, untold))
        elif off:
            why = f"it misses by {excess_m:+.2f} m the point where {count} others meet"
            word = TOO_SHORT if excess_m < 0.0 else OCCLUDED
            says.append(WitnessSay(GEOMETRY, word, statistic, weight, why, 1.0))
        else:
            why = f"it meets {count - 1} others to {abs(excess_m):.2f} m"
            says.append(WitnessSay(GEOMETRY, CLEAR, statistic, weight, why, 0.0))
    return says


def odometry_says(changes: Iterable[Change | None], weight: float) -> list[WitnessSay]:
    """Whether each range changed by more than the rover moved."""
    return [NO_ODOMETRY if change is None else _change_says(change, weight) for change in changes]


def _change_says(change: Change, weight: float) -> WitnessSay:
    evidence = change.over_m / change.tolerance_m
    if change.shorter:
        why = f"it fell {change.over_m:.2f} m more than the rover moved: it was too long before"
        return WitnessSay(ODOMETRY, CLEAR, evidence, weight, why, 0.0)
    if change.confirmed:
        surely = "by far " if change.high else ""
        why = f"it is {change.over_m:.2f} m off what the motion allows, {surely}and keeps being so"
        return WitnessSay(ODOMETRY, OCCLUDED, evidence, weight, why, 1.0)
    if change.violated:
        why = f"it is {change.over_m:.2f} m off what the motion allows, which is not confirmed yet"
        return WitnessSay(ODOMETRY, SILENT, evidence, 0.0, why)
    return WitnessSay(ODOMETRY, CLEAR, evidence, weight, "it changed no more than the rover moved", 0.0)


def motion_says(
    excess_m: Iterable[float],
    sigma_m: Iterable[float],
    least_m: Iterable[float],
    harmful_m: Iterable[float],
    weight: float,
) -> list[WitnessSay]:
    """Whether each range fits where the track leads: by how much it does not, and how surely that is too much.

    sigma_m: of the distance from the track, inf without one; it counts as ``least_m`` at least. A track that is not
    settled speaks only of what is surely too much.
    """
    says = []
    for over_m, from_track_m, at_least_m, harm_m in zip(excess_m, sigma_m, least_m, harmful_m, strict=True):
        size_m = abs(over_m)
        unsure_m = max(from_track_m, at_least_m)
        probability = 0.5 * math.erfc((harm_m - size_m) / (unsure_m * math.sqrt(2.0)))
        if not (from_track_m <= SETTLED * harm_m or probability > SURELY):
            says.append(WitnessSay(MOTION, SILENT, size_m / harm_m, 0.0, "the track is not settled yet"))
            continue
        say = CLEAR if not probability > 0.5 else TOO_SHORT if over_m < 0.0 else OCCLUDED
        why = f"it is {over_m:+.2f} m off where the track leads"
        says.append(WitnessSay(MOTION, say, size_m / harm_m, weight, why, probability))
    return says


def prediction_says(p_sights: Iterable[float | None]) -> list[WitnessSay]:
    """What was predicted: a prior that the others have already weighed in, so it has no vote of its own."""
    return [NO_PREDICTION if p_sight is None else _predicted(p_sight) for p_sight in p_sights]


def _predicted(p_sight: float) -> WitnessSay:
    say = CLEAR if p_sight > 0.5 else OCCLUDED
    why = f"a probability of sight of {p_sight:.0%} was predicted"
    return WitnessSay(PREDICTION, say, math.nan, 0.0, why, 1.0 - p_sight)
