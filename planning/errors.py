"""What can go wrong with planning.

PlanningError
└── PlacementError         anchors, rules or a goal that make no question of placement
    ├── NoCandidateError   no place is left for an anchor; carries how many each rule removed
    └── ClusterError       the cluster that was asked for cannot be reached, or was lost
"""

from collections.abc import Mapping

__all__ = ["ClusterError", "NoCandidateError", "PlacementError", "PlanningError"]


class PlanningError(Exception):
    """Base of everything that planning raises on purpose."""


class PlacementError(PlanningError):
    """Candidates, rules or a goal make no question of placement that can be answered."""


class NoCandidateError(PlacementError):
    """No place is left for an anchor; ``removed`` counts how many each rule took away."""

    def __init__(self, message: str, removed: Mapping[str, int]) -> None:
        super().__init__(message)
        self.removed = dict(removed)


class ClusterError(PlacementError):
    """The cluster that was asked for cannot be reached, or was lost on the way."""
