"""Several witnesses, one verdict per anchor (seed 000, "Fusion Detection Algorithm", steps 1-4)."""

from __future__ import annotations

from collections.abc import Sequence

from .settings import DetectorSettings
from .verdicts import Say, Sight, WitnessSay

__all__ = [
    "GEOMETRY_WEIGHTS",
    "MOTION_WEIGHT",
    "ODOMETRY_WEIGHTS",
    "fuse",
    "fused_probability",
    "is_good_geometry",
]

SILENT = Say.SILENT
CLEAR, OCCLUDED, UNKNOWN = Sight.CLEAR, Sight.OCCLUDED, Sight.UNKNOWN

# of good and poor geometry, of reliable and unreliable odometry, before they are normalised (step 2)
GEOMETRY_WEIGHTS = (0.7, 0.3)
ODOMETRY_WEIGHTS = (0.8, 0.2)
# The track has weighed all ranges so far; it outvotes one epoch's geometry, but not geometry and odometry together.
MOTION_WEIGHT = 2.0
# Position dilution (of the ranges that meet) up to which their geometry is good.
GOOD_DILUTION = 4.0


def is_good_geometry(dilution: float) -> bool:
    """Whether a dilution of precision stands for good anchor geometry."""
    return dilution <= GOOD_DILUTION


def fused_probability(says: Sequence[WitnessSay]) -> float | None:
    """Mean of what the witnesses that vote say, 1 or 0 or a probability, by their weights, normalised (steps 2 and 3).

    None where no witness votes.
    """
    voting = _voting(says)
    return _mean(voting) if voting else None


def fuse(says: Sequence[WitnessSay], settings: DetectorSettings) -> tuple[Sight, float | None, bool]:
    """(sight, fused probability, whether the witnesses agree); cautious where they do not (step 4)."""
    voting = _voting(says)
    if not voting:
        return UNKNOWN, None, True
    probability = _mean(voting)
    agree = len({say.says is Say.CLEAR for say in voting}) == 1
    threshold = settings.occlusion_threshold if agree else settings.cautious_threshold
    return (OCCLUDED if probability > threshold else CLEAR), probability, agree


def _voting(says: Sequence[WitnessSay]) -> list[WitnessSay]:
    return [say for say in says if say.weight > 0.0 and say.says is not SILENT]


def _mean(voting: Sequence[WitnessSay]) -> float:
    total = sum([say.weight for say in voting])
    return sum([say.weight / total * say.probability for say in voting])
