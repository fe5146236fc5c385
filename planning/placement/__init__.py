"""Where to put anchors before a mission, and where to move them while it runs."""

from .candidates import Candidates, candidate_grid, candidate_points, join_candidates
from .checking import Check, HoverSensitivity, check_placement, hover_sensitivity, value_of_anchors
from .cluster import Cluster
from .flights import Flight, flight_level_m
from .geometry import PlacementGeometry, placement_geometry
from .goals import Goal
from .leapfrog import Leapfrog, StretchPlan, TimedMove, leapfrog
from .links import Link
from .maps import PlacementMaps, placement_maps
from .placing import Placement, place_anchors
from .plans import RepositioningPlan, plan_repositioning
from .repositioning import Move, Repositioning, reposition
from .rules import Feasible, PlacementRules, feasible_candidates
from .searching import SearchOptions
from .sight import SightOptions
from .stretch_values import good_along
from .stretches import path_between, path_length_m, straight_ahead
from .targets import Targets, area_targets, corridor_targets, path_targets

__all__ = [
    "Candidates",
    "Check",
    "Cluster",
    "Feasible",
    "Flight",
    "Goal",
    "HoverSensitivity",
    "Leapfrog",
    "Link",
    "Move",
    "Placement",
    "PlacementGeometry",
    "PlacementMaps",
    "PlacementRules",
    "Repositioning",
    "RepositioningPlan",
    "SearchOptions",
    "SightOptions",
    "StretchPlan",
    "Targets",
    "TimedMove",
    "area_targets",
    "candidate_grid",
    "candidate_points",
    "check_placement",
    "corridor_targets",
    "feasible_candidates",
    "flight_level_m",
    "good_along",
    "hover_sensitivity",
    "join_candidates",
    "leapfrog",
    "path_between",
    "path_length_m",
    "path_targets",
    "place_anchors",
    "placement_geometry",
    "placement_maps",
    "plan_repositioning",
    "reposition",
    "straight_ahead",
    "value_of_anchors",
]
