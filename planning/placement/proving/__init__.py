"""What no choice of anchors exceeds: a relaxation of the goal, and branch and bound over it."""

from .branching import Proof, prove
from .relaxation import Relaxation, fits, relaxation_of

__all__ = ["Proof", "Relaxation", "fits", "prove", "relaxation_of"]
