"""How well ranges fix a position: dilution of precision, position errors, go and no-go ground."""

from visibility.dilution.dop import Dop, dop, dop_at_points, dop_per_visible_set
from visibility.dilution.dop_maps import GO, NO_GO, DopMap, Zone, contour_lines, dop_map, zones
from visibility.dilution.dop_questions import DopKind, DopReason, FlightLimit, least_anchors, pack_sets
from visibility.dilution.ground_normals import rover_normals, surface_normals
from visibility.dilution.position_errors import (
    PositionError,
    PositionErrorMap,
    position_error,
    position_error_along,
    position_error_map,
)
from visibility.dilution.sets_in_sight import VisibleSets, dop_along, visible_sets

__all__ = [
    "GO",
    "NO_GO",
    "Dop",
    "DopKind",
    "DopMap",
    "DopReason",
    "FlightLimit",
    "PositionError",
    "PositionErrorMap",
    "VisibleSets",
    "Zone",
    "contour_lines",
    "dop",
    "dop_along",
    "dop_at_points",
    "dop_map",
    "dop_per_visible_set",
    "least_anchors",
    "pack_sets",
    "position_error",
    "position_error_along",
    "position_error_map",
    "rover_normals",
    "surface_normals",
    "visible_sets",
    "zones",
]
