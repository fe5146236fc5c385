"""Where to put anchors before a mission, and where to move them while it runs."""

from .candidates import Candidates, candidate_grid, candidate_points, join_candidates
from .checking import Check, HoverSensitivity, check_placement, hover_sensitivity, value_of_anchors
from .goals import Goal
from .links import Link
from .placing import Placement, place_anchors
from .rules import Feasible, PlacementRules, feasible_candidates
from .searching import SearchOptions
from .sight import SightOptions
from .targets import Targets, area_targets, corridor_targets, path_targets

__all__ = [
    "Candidates",
    "Check",
    "Feasible",
    "Goal",
    "HoverSensitivity",
    "Link",
    "Placement",
    "PlacementRules",
    "SearchOptions",
    "SightOptions",
    "Targets",
    "area_targets",
    "candidate_grid",
    "candidate_points",
    "check_placement",
    "corridor_targets",
    "feasible_candidates",
    "hover_sensitivity",
    "join_candidates",
    "path_targets",
    "place_anchors",
    "value_of_anchors",
]
