"""What to do about it: where to put anchors (``planning.placement``), and which way to go (``planning.paths``)."""

from .errors import (
    AreaError,
    ClusterError,
    NoCandidateError,
    NoCoverageError,
    PathError,
    PathProblemError,
    PlaceError,
    PlacementError,
    PlanningError,
    PlanningProcessError,
    WatchError,
)

__all__ = [
    "AreaError",
    "ClusterError",
    "NoCandidateError",
    "NoCoverageError",
    "PathError",
    "PathProblemError",
    "PlaceError",
    "PlacementError",
    "PlanningError",
    "PlanningProcessError",
    "WatchError",
]
