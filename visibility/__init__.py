"""Who sees whom: anchors, lines of sight, minimum visible altitudes, and what follows from them.

The names that most scripts need are here. They and the others are in the rooms: ``sight``, ``dilution``, ``air``,
``cover``, ``signal``, ``satellites`` and ``sites``.
"""

from visibility.air import altitude_layers, control_volume, morphing_map
from visibility.cover import Buildings, read_buildings
from visibility.dilution import FlightLimit, dop, dop_along, dop_map, position_error_map, visible_sets
from visibility.sight import (
    FLAT,
    HIDDEN,
    UNKNOWN,
    VISIBLE,
    Anchor,
    AntennaLimits,
    Curvature,
    DistantAnchor,
    MinimumVisibleAltitude,
    MovingAnchor,
    anchor_above_ground,
    line_of_sight,
    lines_of_sight,
    min_visible_altitude,
    profile,
)

from .errors import AnchorError, CoverError, MeshError, SignalError, VisibilityError, VisibilityInputError

__all__ = [
    "FLAT",
    "HIDDEN",
    "UNKNOWN",
    "VISIBLE",
    "Anchor",
    "AnchorError",
    "AntennaLimits",
    "Buildings",
    "CoverError",
    "Curvature",
    "DistantAnchor",
    "FlightLimit",
    "MeshError",
    "MinimumVisibleAltitude",
    "MovingAnchor",
    "SignalError",
    "VisibilityError",
    "VisibilityInputError",
    "altitude_layers",
    "anchor_above_ground",
    "control_volume",
    "dop",
    "dop_along",
    "dop_map",
    "line_of_sight",
    "lines_of_sight",
    "min_visible_altitude",
    "morphing_map",
    "position_error_map",
    "profile",
    "read_buildings",
    "visible_sets",
]
