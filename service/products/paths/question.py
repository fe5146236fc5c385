"""A path as it is asked, brought into the grid's frame for the planner, and refused where it cannot be planned."""

from __future__ import annotations

import math

import numpy as np
import shapely

from navigation import MotionNoise
from planning.paths import CostWeights, NavigationModel, PathLimits, PathProblem, PlanBudget, RoverModel
from service.parts.map_area import map_area, refuse_outside
from service.parts.points import PlaceIn, PolygonIn
from service.parts.ranging_sources import RangingSources, ranging_sources, track_of
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import places_in_grid, polygon_in_grid
from service.products.paths.request import NavigationIn, PathLimitsIn, PathParameters, RoverIn
from terrain import ElevationGrid
from visibility import MinimumVisibleAltitude
from visibility.air import MorphingMap
from visibility.sight import AnchorTrack, check_anchors

__all__ = [
    "check_path_request",
    "limits_of",
    "navigation_of",
    "path_question",
    "path_sources",
    "path_tracks",
    "rover_of",
]


def path_sources(grid: ElevationGrid, asked: PathParameters) -> RangingSources:
    """What the rover ranges to, checked. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    sources = ranging_sources(grid, asked)
    if sources.all:
        check_anchors(grid, sources.all)
    return sources


def path_tracks(grid: ElevationGrid, asked: PathParameters) -> tuple[AnchorTrack, ...]:
    """The anchors that move, each known when the rover leaves. Raises AnchorError, FrameError, VisibilityInputError."""
    tracks = tuple(track_of(grid, track, heard=asked.usable) for track in asked.tracks)
    for track in tracks:
        for leaves_s in (asked.departure_s, asked.leave_by_s):
            if leaves_s is not None:
                track.at(leaves_s)
    return tracks


def path_question(
    grid: ElevationGrid,
    asked: PathParameters,
    sources: RangingSources,
    maps: MinimumVisibleAltitude | MorphingMap | None = None,
    tracks: tuple[AnchorTrack, ...] = (),
) -> PathProblem:
    """The problem; maps: what was calculated of these sources; tracks: anchors that move.

    Raises PathError, RequestError, FrameError.
    """
    start, *way_points = [(e, n) for e, n in places_in_grid(grid, [asked.start, *asked.way_points]).tolist()]
    area = map_area(grid, asked.area)
    goals = tuple(_goal(grid, goal, number) for number, goal in enumerate(asked.goals))
    refuse_outside(grid, asked.area, np.array([start]), "The start")
    refuse_outside(grid, asked.area, np.reshape(way_points, (-1, 2)), "way_points[{}]")
    for number, goal in enumerate(goals):
        if isinstance(goal, shapely.Geometry):
            area.within([goal], f"goals[{number}]")
        else:
            refuse_outside(grid, asked.area, np.array([goal]), f"goals[{number}]")
    heading_deg = asked.start_heading_deg
    return PathProblem(
        grid,
        start,
        goals,
        tuple(way_points),
        rover=rover_of(asked.rover),
        limits=limits_of(asked.limits),
        weights=CostWeights(**asked.weights.model_dump()),
        anchors=(*sources.all, *tracks),
        maps=maps,
        no_go=_areas(grid, asked.no_go, "no_go"),
        keep_in=area.within(_areas(grid, asked.keep_in, "keep_in"), "keep_in"),
        start_heading_rad=None if heading_deg is None else math.radians(heading_deg),
        navigation=navigation_of(asked.navigation),
        departure_s=asked.departure_s,
        frame_s=asked.frame_s,
        seed=asked.seed,
        budget=PlanBudget(**asked.budget.model_dump()),
    )


def rover_of(asked: RoverIn) -> RoverModel:
    """The rover. Raises PathProblemError."""
    return RoverModel(
        footprint_radius_m=asked.footprint_radius_m,
        receiver_above_ground_m=asked.receiver_above_ground_m,
        max_slope_rad=math.radians(asked.max_slope_deg),
        max_pitch_rad=math.radians(asked.max_pitch_deg),
        max_roll_rad=math.radians(asked.max_roll_deg),
        max_step_m=_unlimited(asked.max_step_m),
        min_turning_radius_m=asked.min_turning_radius_m,
        can_reverse=asked.can_reverse,
        speed_m_per_s=asked.speed_m_per_s,
        speed_over_slope=tuple((math.radians(one.slope_deg), one.speed_m_per_s) for one in asked.speed_over_slope),
    )


def limits_of(asked: PathLimitsIn) -> PathLimits:
    """The limits on positioning. Raises PathProblemError."""
    return PathLimits(**asked.model_dump(exclude={"dop_limit"}), dop_limit=_unlimited(asked.dop_limit))


def navigation_of(asked: NavigationIn) -> NavigationModel:
    """The filter. Raises PathProblemError."""
    motion = MotionNoise(*[asked.motion_m2_per_s3] * 3)
    return NavigationModel(
        motion, asked.interval_s, asked.initial_sigma_m, asked.ground_sigma_m, asked.initial_velocity_sigma_m_per_s
    )


def _goal(grid: ElevationGrid, goal: PlaceIn | PolygonIn, number: int) -> tuple[float, float] | shapely.Polygon:
    if isinstance(goal, PolygonIn):
        return polygon_in_grid(grid, goal, f"goals[{number}]")
    east_m, north_m = places_in_grid(grid, [goal])[0].tolist()
    return east_m, north_m


def _areas(grid: ElevationGrid, polygons: list[PolygonIn], called: str) -> tuple[shapely.Polygon, ...]:
    return tuple(polygon_in_grid(grid, polygon, f"{called}[{n}]") for n, polygon in enumerate(polygons))


def _unlimited(value: float | None) -> float:
    return math.inf if value is None else value


@told_as_asked
def check_path_request(grid: ElevationGrid, asked: PathParameters) -> int:
    """Refuse what cannot be planned, as far as it shows without maps; how many anchors and satellites there are.

    Raises PathError, RequestError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    if asked.morphing_map is not None:
        path_question(grid, asked, RangingSources(()))
        return len(asked.morphing_map.anchors)
    sources, tracks = path_sources(grid, asked), path_tracks(grid, asked)
    path_question(grid, asked, sources, tracks=tracks)
    return len(sources.all) + len(tracks)
