"""Who sees whom: anchors, lines of sight, minimum visible altitudes, curvature, cameras, reflections."""

from visibility.sight.anchor_tracks import AnchorTrack, MovingAnchor
from visibility.sight.anchors import Anchor, DistantAnchor, anchor_above_ground, check_anchors
from visibility.sight.antenna_limits import ALL_ROUND, AntennaLimits
from visibility.sight.camera import (
    OUTSIDE_DEM,
    OUTSIDE_VIEW,
    Camera,
    OccludedPoints,
    camera_for_anchor,
    occluded_points,
)
from visibility.sight.curvature import FLAT, Curvature
from visibility.sight.doubts import SightDoubt, doubted, weighed_sight
from visibility.sight.in_reach import Reach, Reached, ReachOptions, in_reach, reach_of
from visibility.sight.minimum_altitude import (
    HIDDEN,
    UNKNOWN,
    VISIBLE,
    MinimumVisibleAltitude,
    SurfaceCache,
    min_visible_altitude,
)
from visibility.sight.reflections import Reflections, reflections
from visibility.sight.sight_line import (
    GroundProfile,
    LineOfSight,
    fresnel_radius_m,
    knife_edge_loss_db,
    line_of_sight,
    profile,
)
from visibility.sight.sight_lines import LinesOfSight, lines_of_sight
from visibility.sight.sight_points import points_within_reach

__all__ = [
    "ALL_ROUND",
    "FLAT",
    "HIDDEN",
    "OUTSIDE_DEM",
    "OUTSIDE_VIEW",
    "UNKNOWN",
    "VISIBLE",
    "Anchor",
    "AnchorTrack",
    "AntennaLimits",
    "Camera",
    "Curvature",
    "DistantAnchor",
    "GroundProfile",
    "LineOfSight",
    "LinesOfSight",
    "MinimumVisibleAltitude",
    "MovingAnchor",
    "OccludedPoints",
    "Reach",
    "ReachOptions",
    "Reached",
    "Reflections",
    "SightDoubt",
    "SurfaceCache",
    "anchor_above_ground",
    "camera_for_anchor",
    "check_anchors",
    "doubted",
    "fresnel_radius_m",
    "in_reach",
    "knife_edge_loss_db",
    "line_of_sight",
    "lines_of_sight",
    "min_visible_altitude",
    "occluded_points",
    "points_within_reach",
    "profile",
    "reach_of",
    "reflections",
    "weighed_sight",
]
