"""What no choice of anchors exceeds: branch and bound over a relaxation of the goal, or all sets gone through."""

from .branching import Proof, prove
from .exact import ExactAnswer, every_set, number_of_sets
from .relaxation import Relaxation, fits, relaxation_of

__all__ = [
    "ExactAnswer",
    "Proof",
    "Relaxation",
    "every_set",
    "fits",
    "number_of_sets",
    "prove",
    "relaxation_of",
]
