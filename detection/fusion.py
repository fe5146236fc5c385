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
    "normalised",
]

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


def normalised(weights: Sequence[float]) -> tuple[float, ...]:
    """Weights that sum to one; all zero stays all zero."""
    total = sum(weights)
    return tuple(weight / total if total > 0.0 else 0.0 for weight in weights)


def fused_probability(says: Sequence[WitnessSay]) -> float | None:
    """Weighted mean of what the witnesses that speak say, 1 or 0 or a probability (step 3); None where none does."""
    speaking = [say for say in says if say.says is not Say.SILENT and say.weight > 0.0]
    if not speaking:
        return None
    weights = normalised([say.weight for say in speaking])
    return sum(weight * say.probability for weight, say in zip(weights, speaking, strict=True))


def fuse(says: Sequence[WitnessSay], settings: DetectorSettings) -> tuple[Sight, float | None, bool]:
    """(sight, fused probability, whether the witnesses agree); cautious where they do not (step 4)."""
    probability = fused_probability(says)
    if probability is None:
        return Sight.UNKNOWN, None, True
    agree = len({say.says for say in says if say.says is not Say.SILENT and say.weight > 0.0}) == 1
    threshold = settings.occlusion_threshold if agree else settings.cautious_threshold
    return (Sight.OCCLUDED if probability > threshold else Sight.CLEAR), probability, agree
