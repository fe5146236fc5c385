"""Who sees whom: anchors, line of sight and minimum visible altitude over a grid."""

from .anchors import ALL_ROUND, Anchor, AntennaLimits, anchor_above_ground
from .curvature import FLAT, Curvature
from .errors import AnchorError, MeshError, VisibilityError, VisibilityInputError
from .minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, MinimumVisibleAltitude, min_visible_altitude

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
    "MeshError",
    "MinimumVisibleAltitude",
    "VisibilityError",
    "VisibilityInputError",
    "anchor_above_ground",
    "min_visible_altitude",
]
