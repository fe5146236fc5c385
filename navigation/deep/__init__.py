"""Deep integration: an inertial filter foretells a receiver's replicas, and what these measure corrects the filter."""

from .channels import Heard, combined, heard
from .epochs import DeepRules, DeepTrack, integrate
from .judging import Judged, judge

__all__ = ["DeepRules", "DeepTrack", "Heard", "Judged", "combined", "heard", "integrate", "judge"]
