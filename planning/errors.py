"""What can go wrong with planning.

PlanningError
├── PlacementError           anchors, rules or a goal that make no question of placement
│   ├── NoCandidateError     no place is left for an anchor; carries how many each rule removed
│   └── ClusterError         the cluster that was asked for cannot be reached, or was lost
├── WatchError               a map, a place or anchors over which no rover can be watched
└── PathError                a path problem that cannot be asked
    ├── PathProblemError     rover, limits, weights or budget that make no question, or contradict one another
    ├── AreaError            no-go or keep-in areas that cross themselves, are empty, or are in another CRS
    ├── PlaceError           a start, way-point or goal that is outside, on unknown ground or forbidden; says why
    ├── NoCoverageError      limits on positioning that hold nowhere on the map
    └── PlanningProcessError the process that planned ended before its answer
"""

from collections.abc import Mapping

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


class WatchError(PlanningError):
    """A rover cannot be watched over this map with these anchors and settings."""


class PathError(PlanningError):
    """Base of everything that is wrong with a path problem."""


class PathProblemError(PathError):
    """Rover, limits, weights or budget make no question that can be answered."""


class AreaError(PathError):
    """A no-go or keep-in area cannot be used."""


class PlaceError(PathError):
    """A start, way-point or goal cannot be stood on.

    place: "start", "goal" or "way-point N". reasons: why, as in ``Reason``. nearest_m: (east_m, north_m) of the nearest
    place that can be stood on; None where there is none.
    """

    def __init__(
        self, message: str, place: str, reasons: tuple[str, ...], nearest_m: tuple[float, float] | None
    ) -> None:
        super().__init__(message)
        self.place = place
        self.reasons = reasons
        self.nearest_m = nearest_m


class NoCoverageError(PathError):
    """Limits on positioning hold nowhere on the map."""


class PlanningProcessError(PathError):
    """The process that planned ended before its answer."""
