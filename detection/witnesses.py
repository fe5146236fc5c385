"""What each witness says about the ranges of an epoch, in numbers and in words: one say per range, in their order."""

from __future__ import annotations

import math
from collections.abc import Iterable

from .geometric import GeometricDetection
from .range_changes import Change
from .verdicts import Classification, Say, Witness, WitnessSay

__all__ = ["geometry_says", "motion_says", "odometry_says", "prediction_says"]

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
