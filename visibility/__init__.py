"""Who sees whom: anchors, line of sight and minimum visible altitude over a grid."""

from .anchors import ALL_ROUND, Anchor, AntennaLimits, anchor_above_ground, check_anchors
from .building_sight import visible_with_buildings
from .buildings import BuildingHeights, Buildings, read_buildings
from .camera import Camera, camera_for_anchor
from .curvature import FLAT, Curvature
from .distant import DistantAnchor
from .dop import Dop, dop, dop_at_points
from .dop_maps import GO, NO_GO, DopMap, dop_map
from .dop_per_set import dop_per_visible_set
from .dop_questions import DopKind, DopReason, least_anchors, pack_sets
from .errors import AlmanacError, AlmanacFileError, AnchorError, MeshError, VisibilityError, VisibilityInputError
from .fresnel import fresnel_radius_m, knife_edge_loss_db
from .ground_normals import surface_normals
from .ground_profile import GroundProfile, profile
from .minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, MinimumVisibleAltitude, min_visible_altitude
from .occluded_points import OUTSIDE_DEM, OUTSIDE_VIEW, OccludedPoints, occluded_points
from .position_errors import PositionError, position_error
from .ray_triangle import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks
from .sets_in_sight import VisibleSets, dop_along, visible_sets
from .sight_line import LineOfSight, line_of_sight
from .sight_lines import LinesOfSight, lines_of_sight

__all__ = [
    "ALL_ROUND",
    "FLAT",
    "GO",
    "HIDDEN",
    "NO_GO",
    "OUTSIDE_DEM",
    "OUTSIDE_VIEW",
    "UNKNOWN",
    "VISIBLE",
    "AlmanacError",
    "AlmanacFileError",
    "Anchor",
    "AnchorError",
    "AntennaLimits",
    "BuildingHeights",
    "Buildings",
    "Camera",
    "Curvature",
    "DistantAnchor",
    "Dop",
    "DopKind",
    "DopMap",
    "DopReason",
    "Engine",
    "GroundProfile",
    "LineOfSight",
    "LinesOfSight",
    "MeshError",
    "MeshHits",
    "MinimumVisibleAltitude",
    "OccludedPoints",
    "PositionError",
    "VisibilityError",
    "VisibilityInputError",
    "VisibleSets",
    "anchor_above_ground",
    "camera_for_anchor",
    "check_anchors",
    "dop",
    "dop_along",
    "dop_at_points",
    "dop_map",
    "dop_per_visible_set",
    "fresnel_radius_m",
    "grid_surface_mesh",
    "knife_edge_loss_db",
    "least_anchors",
    "line_of_sight",
    "lines_of_sight",
    "lowered_m",
    "mesh_blocks",
    "min_visible_altitude",
    "occluded_points",
    "pack_sets",
    "position_error",
    "profile",
    "read_buildings",
    "surface_normals",
    "visible_sets",
    "visible_with_buildings",
]
