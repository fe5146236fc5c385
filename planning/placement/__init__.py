"""Where to put anchors before a mission, and where to move them while it runs."""

from .by_windows import WindowPlacement, WindowQuestion, place_by_windows
from .candidates import Candidates, candidate_grid, candidate_points, join_candidates
from .checking import (
    Check,
    HoverSensitivity,
    PlacementGeometry,
    PlacementMaps,
    check_placement,
    hover_sensitivity,
    placement_geometry,
    placement_maps,
    value_of_anchors,
)
from .cluster import Cluster
from .goals import Goal
from .leapfrog import Leapfrog, StretchPlan, TimedMove, leapfrog
from .moves import Move, MoveQuestion
from .placing import Placement, place_anchors
from .plans import RepositioningPlan, plan_repositioning
from .proposing import candidate_sites
from .repositioning import Repositioning, reposition
from .rules import Feasible, Link, PlacementRules, feasible_candidates
from .searching import SearchOptions
from .sight import SightOptions
from .stretches import Flight, flight_level_m, good_along, path_between, path_length_m, straight_ahead
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
    "MoveQuestion",
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
    "WindowPlacement",
    "WindowQuestion",
    "area_targets",
    "candidate_grid",
    "candidate_points",
    "candidate_sites",
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
    "place_by_windows",
    "placement_geometry",
    "placement_maps",
    "plan_repositioning",
    "reposition",
    "straight_ahead",
    "value_of_anchors",
]
