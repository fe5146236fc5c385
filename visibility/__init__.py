"""Who sees whom: anchors, line of sight and minimum visible altitude over a grid."""

from .anchors import ALL_ROUND, Anchor, AntennaLimits, anchor_above_ground, check_anchors
from .building_sight import visible_with_buildings
from .buildings import BuildingHeights, Buildings, read_buildings
from .curvature import FLAT, Curvature
from .errors import AnchorError, MeshError, VisibilityError, VisibilityInputError
from .fresnel import fresnel_radius_m, knife_edge_loss_db
from .ground_profile import GroundProfile, profile
from .minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, MinimumVisibleAltitude, min_visible_altitude
from .ray_triangle import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks
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
    "BuildingHeights",
    "Buildings",
    "Curvature",
    "Engine",
    "GroundProfile",
    "LineOfSight",
    "LinesOfSight",
    "MeshError",
    "MeshHits",
    "MinimumVisibleAltitude",
    "VisibilityError",
    "VisibilityInputError",
    "anchor_above_ground",
    "check_anchors",
    "fresnel_radius_m",
    "grid_surface_mesh",
    "knife_edge_loss_db",
    "line_of_sight",
    "lines_of_sight",
    "lowered_m",
    "mesh_blocks",
    "min_visible_altitude",
    "profile",
    "read_buildings",
    "visible_with_buildings",
]
