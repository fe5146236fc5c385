"""Who sees whom: anchors, line of sight and minimum visible altitude over a grid."""

from visibility.air.control_volumes import (
    ControlVolume,
    VoxelBlock,
    control_volume,
    volume_blocks,
    volume_slabs,
    whole_volume,
)
from visibility.air.isosurfaces import Isosurface, isosurface
from visibility.air.morphing_maps import ColumnState, MorphingMap, morphing_map
from visibility.air.morphing_times import Availability, MorphingFrame, availability, morphing_frames
from visibility.air.volume_datasets import volume_dataset
from visibility.air.volume_layers import AltitudeLayers, altitude_layers
from visibility.air.volume_sections import HorizontalSection, VerticalSection, horizontal_section, vertical_section
from visibility.cover.building_distance import NearestBuilding, nearest_building
from visibility.cover.building_sight import clear_of_buildings, visible_with_buildings
from visibility.cover.buildings import BuildingHeights, Buildings, parse_buildings, read_buildings
from visibility.cover.ray_triangle import Engine, MeshHits, grid_surface_mesh, lowered_m, mesh_blocks
from visibility.dilution.dop import Dop, dop, dop_at_points
from visibility.dilution.dop_maps import GO, NO_GO, DopMap, dop_map
from visibility.dilution.dop_per_set import dop_per_visible_set
from visibility.dilution.dop_questions import DopKind, DopReason, least_anchors, pack_sets
from visibility.dilution.flight_limits import FlightLimit
from visibility.dilution.ground_normals import rover_normals, surface_normals
from visibility.dilution.no_go import Zone, contour_lines, zones
from visibility.dilution.position_error_maps import PositionErrorMap, position_error_along, position_error_map
from visibility.dilution.position_errors import PositionError, position_error
from visibility.dilution.sets_in_sight import VisibleSets, dop_along, visible_sets
from visibility.sight.anchor_tracks import AnchorTrack, MovingAnchor
from visibility.sight.anchors import ALL_ROUND, Anchor, AntennaLimits, anchor_above_ground, check_anchors
from visibility.sight.camera import Camera, camera_for_anchor
from visibility.sight.curvature import FLAT, Curvature
from visibility.sight.distant import DistantAnchor
from visibility.sight.fresnel import fresnel_radius_m, knife_edge_loss_db
from visibility.sight.ground_profile import GroundProfile, profile
from visibility.sight.minimum_altitude import HIDDEN, UNKNOWN, VISIBLE, MinimumVisibleAltitude, min_visible_altitude
from visibility.sight.occluded_points import OUTSIDE_DEM, OUTSIDE_VIEW, OccludedPoints, occluded_points
from visibility.sight.reach import points_within_reach
from visibility.sight.reflections import Reflections, reflections
from visibility.sight.sight_line import LineOfSight, line_of_sight
from visibility.sight.sight_lines import LinesOfSight, lines_of_sight
from visibility.sight.surface_cache import SurfaceCache

from .errors import AnchorError, MeshError, VisibilityError, VisibilityInputError

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
    "AltitudeLayers",
    "Anchor",
    "AnchorError",
    "AnchorTrack",
    "AntennaLimits",
    "Availability",
    "BuildingHeights",
    "Buildings",
    "Camera",
    "ColumnState",
    "ControlVolume",
    "Curvature",
    "DistantAnchor",
    "Dop",
    "DopKind",
    "DopMap",
    "DopReason",
    "Engine",
    "FlightLimit",
    "GroundProfile",
    "HorizontalSection",
    "Isosurface",
    "LineOfSight",
    "LinesOfSight",
    "MeshError",
    "MeshHits",
    "MinimumVisibleAltitude",
    "MorphingFrame",
    "MorphingMap",
    "MovingAnchor",
    "NearestBuilding",
    "OccludedPoints",
    "PositionError",
    "PositionErrorMap",
    "Reflections",
    "SurfaceCache",
    "VerticalSection",
    "VisibilityError",
    "VisibilityInputError",
    "VisibleSets",
    "VoxelBlock",
    "Zone",
    "altitude_layers",
    "anchor_above_ground",
    "availability",
    "camera_for_anchor",
    "check_anchors",
    "clear_of_buildings",
    "contour_lines",
    "control_volume",
    "dop",
    "dop_along",
    "dop_at_points",
    "dop_map",
    "dop_per_visible_set",
    "fresnel_radius_m",
    "grid_surface_mesh",
    "horizontal_section",
    "isosurface",
    "knife_edge_loss_db",
    "least_anchors",
    "line_of_sight",
    "lines_of_sight",
    "lowered_m",
    "mesh_blocks",
    "min_visible_altitude",
    "morphing_frames",
    "morphing_map",
    "nearest_building",
    "occluded_points",
    "pack_sets",
    "parse_buildings",
    "points_within_reach",
    "position_error",
    "position_error_along",
    "position_error_map",
    "profile",
    "read_buildings",
    "reflections",
    "rover_normals",
    "surface_normals",
    "vertical_section",
    "visible_sets",
    "visible_with_buildings",
    "volume_blocks",
    "volume_dataset",
    "volume_slabs",
    "whole_volume",
    "zones",
]
