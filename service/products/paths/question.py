"""A path as the service is asked for it, brought into the grid's frame for the planner."""

from __future__ import annotations

import math

import shapely

from navigation import MotionNoise
from planning.paths import CostWeights, NavigationModel, PathLimits, PathProblem, PlanBudget, RoverModel
from service.parts.points import PlaceIn, PolygonIn
from service.parts.ranging_sources import RangingSources, ranging_sources, track_of
from service.parts.shapes_in_grid import places_in_grid, polygon_in_grid
from service.products.paths.request import NavigationIn, PathLimitsIn, PathParameters, RoverIn
from terrain import ElevationGrid
from visibility import AnchorTrack, MinimumVisibleAltitude, MorphingMap, check_anchors

__all__ = ["limits_of", "navigation_of", "path_question", "path_sources", "path_tracks", "rover_of"]


def path_sources(grid: ElevationGrid, asked: PathParameters) -> RangingSources:
    """What the rover ranges to, checked. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    sources = ranging_sources(grid, asked)
    if sources.all:
        check_anchors(grid, sources.all)
    return sources


def path_tracks(grid: ElevationGrid, asked: PathParameters) -> tuple[AnchorTrack, ...]:
    """The anchors that move. Raises AnchorError, FrameError, VisibilityInputError."""
    return tuple(track_of(grid, track) for track in asked.tracks)


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
    heading_deg = asked.start_heading_deg
    return PathProblem(
        grid,
        start,
        tuple(_goal(grid, goal, number) for number, goal in enumerate(asked.goals)),
        tuple(way_points),
        rover=rover_of(asked.rover),
        limits=limits_of(asked.limits),
        weights=CostWeights(**asked.weights.model_dump()),
        anchors=(*sources.all, *tracks),
        maps=maps,
        no_go=_areas(grid, asked.no_go, "no_go"),
        keep_in=_areas(grid, asked.keep_in, "keep_in"),
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
    return PathLimits(
        min_anchors=asked.min_anchors,
        dop_limit=_unlimited(asked.dop_limit),
        kind=asked.kind,
        measure=asked.measure,
        on_surface=asked.on_surface,
        in_sight_from=asked.in_sight_from,
        bubble_epsilon=asked.bubble_epsilon,
        dem_sigma_m=asked.dem_sigma_m,
    )


def navigation_of(asked: NavigationIn) -> NavigationModel:
    """The filter. Raises PathProblemError."""
    motion = MotionNoise(*[asked.motion_m2_per_s3] * 3)
    return NavigationModel(
        motion,
        asked.interval_s,
        asked.initial_sigma_m,
        asked.ground_sigma_m,
        asked.initial_velocity_sigma_m_per_s,
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
