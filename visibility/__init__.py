"""Who sees whom: anchors, line of sight and minimum visible altitude over a grid."""

from .anchors import ALL_ROUND, Anchor, AntennaLimits, anchor_above_ground, check_anchors
from .curvature import FLAT, Curvature
from .errors import AnchorError, MeshError, VisibilityError, VisibilityInputError
from .fresnel import fresnel_radius_m, knife_edge_loss_db
from .ground_profile import GroundProfile, profile
from .minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, MinimumVisibleAltitude, min_visible_altitude
from .sight_line import LineOfSight, line_of_sight
from .sight_lines import LinesOfSight, lines_of_sight

__all__ = [
    "ALL_ROUND",
    "FLAT",
    "HIDDEN",
    "UNKNOWN",
    "VISIBLE",
    "Anchor",
    "AnchorError",
    "AntennaLimits",
    "Curvature",
    "GroundProfile",
    "LineOfSight",
    "LinesOfSight",
    "MeshError",
    "MinimumVisibleAltitude",
    "VisibilityError",
    "VisibilityInputError",
    "anchor_above_ground",
    "check_anchors",
    "fresnel_radius_m",
    "knife_edge_loss_db",
    "line_of_sight",
    "lines_of_sight",
    "min_visible_altitude",
    "profile",
]
