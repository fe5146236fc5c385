"""What to do about it: where to put anchors (``planning.placement``)."""

from .errors import ClusterError, NoCandidateError, PlacementError, PlanningError

__all__ = ["ClusterError", "NoCandidateError", "PlacementError", "PlanningError"]
