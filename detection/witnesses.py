"""What each witness says about one range, in a number and in words."""

from __future__ import annotations

import math

from .geometric import GeometricDetection
from .range_changes import Change
from .verdicts import Classification, Say, Witness, WitnessSay

__all__ = ["geometry_says", "motion_says", "odometry_says", "prediction_says"]

# A track is settled that knows a distance to this share of what is harmful.
SETTLED = 0.5
SURELY = 0.9987  # three sigma beyond what is harmful


def geometry_says(geometry: GeometricDetection, i: int, weight: float) -> WitnessSay:
    """Whether range i meets the others of its epoch."""
    statistic = float(geometry.statistic[i])
    if geometry.unknown[i]:
        why = "the ranges of the epoch do not tell"
        if geometry.classification is Classification.UNDETERMINED and geometry.needed:
            why = "the ranges of the epoch do not tell which are too long"
        return WitnessSay(Witness.GEOMETRY, Say.SILENT, statistic, 0.0, why)
    excess_m = float(geometry.excess_m[i])
    if geometry.occluded[i]:
        why = f"it misses by {excess_m:+.2f} m the point where {geometry.count} others meet"
        return WitnessSay(Witness.GEOMETRY, Say.OCCLUDED, statistic, weight, why, 1.0)
    why = f"it meets {geometry.count - 1} others to {abs(excess_m):.2f} m"
    return WitnessSay(Witness.GEOMETRY, Say.CLEAR, statistic, weight, why, 0.0)


def odometry_says(change: Change | None, weight: float) -> WitnessSay:
    """Whether the range changed by more than the rover moved."""
    if change is None:
        return WitnessSay(Witness.ODOMETRY, Say.SILENT, math.nan, 0.0, "no odometry since a range that was trusted")
    evidence = change.over_m / change.tolerance_m
    if change.shorter:
        why = f"it fell {change.over_m:.2f} m more than the rover moved: it was too long before"
        return WitnessSay(Witness.ODOMETRY, Say.CLEAR, evidence, weight, why, 0.0)
    if change.confirmed:
        surely = "by far " if change.high else ""
        why = f"it is {change.over_m:.2f} m off what the motion allows, {surely}and keeps being so"
        return WitnessSay(Witness.ODOMETRY, Say.OCCLUDED, evidence, weight, why, 1.0)
    if change.violated:
        why = f"it is {change.over_m:.2f} m off what the motion allows, which is not confirmed yet"
        return WitnessSay(Witness.ODOMETRY, Say.SILENT, evidence, 0.0, why)
    return WitnessSay(Witness.ODOMETRY, Say.CLEAR, evidence, weight, "it changed no more than the rover moved", 0.0)


def motion_says(excess_m: float, sigma_m: float, least_m: float, harmful_m: float, weight: float) -> WitnessSay:
    """Whether the range fits where the track leads: by how much it does not, and how surely that is too much.

    sigma_m: of the distance from the track, inf without one; it counts as ``least_m`` at least. A track that is not
    settled speaks only of what is surely too much.
    """
    evidence = abs(excess_m) / harmful_m
    unsure_m = max(sigma_m, least_m)
    probability = 0.5 * math.erfc((harmful_m - abs(excess_m)) / (unsure_m * math.sqrt(2.0)))
    settled = sigma_m <= SETTLED * harmful_m
    if not settled and not probability > SURELY:
        return WitnessSay(Witness.MOTION, Say.SILENT, evidence, 0.0, "the track is not settled yet")
    says = Say.OCCLUDED if probability > 0.5 else Say.CLEAR
    why = f"it is {excess_m:+.2f} m off where the track leads"
    return WitnessSay(Witness.MOTION, says, evidence, weight, why, probability)


def prediction_says(p_sight: float | None) -> WitnessSay:
    """What was predicted: a prior that the others have already weighed in, so it has no vote of its own."""
    if p_sight is None:
        return WitnessSay(Witness.PREDICTION, Say.SILENT, math.nan, 0.0, "no prediction")
    says = Say.CLEAR if p_sight > 0.5 else Say.OCCLUDED
    why = f"a probability of sight of {p_sight:.0%} was predicted"
    return WitnessSay(Witness.PREDICTION, says, math.nan, 0.0, why, 1.0 - p_sight)
