"""A path as the service is asked for it, brought into the grid's frame for the planner."""

from __future__ import annotations

import math

import shapely

from planning.paths import CostWeights, PathLimits, PathProblem, PlanBudget, RoverModel
from terrain import ElevationGrid
from visibility import MinimumVisibleAltitude, MorphingMap, check_anchors

from .ranging_sources import RangingSources, ranging_sources
from .schemas.paths import PathLimitsIn, PathParameters, RoverIn
from .schemas.shapes import PlaceIn, PolygonIn
from .shapes_in_grid import places_in_grid, polygon_in_grid

__all__ = ["path_question", "path_sources"]


def path_sources(grid: ElevationGrid, asked: PathParameters) -> RangingSources:
    """What the rover ranges to, checked. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    sources = ranging_sources(grid, asked)
    if sources.all:
        check_anchors(grid, sources.all)
    return sources


def path_question(
    grid: ElevationGrid,
    asked: PathParameters,
    sources: RangingSources,
    maps: MinimumVisibleAltitude | MorphingMap | None = None,
) -> PathProblem:
    """The problem; maps: what was calculated of these sources. Raises PathError, RequestError, FrameError."""
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
        anchors=sources.all,
        maps=maps,
        no_go=_areas(grid, asked.no_go, "no_go"),
        keep_in=_areas(grid, asked.keep_in, "keep_in"),
        start_heading_rad=None if heading_deg is None else math.radians(heading_deg),
        seed=asked.seed,
        budget=PlanBudget(**asked.budget.model_dump()),
    )


def rover_of(asked: RoverIn) -> RoverModel:
    """The rover. Raises PathProblemError."""
    return RoverModel(
        footprint_radius_m=asked.footprint_radius_m,
        antenna_height_m=asked.antenna_height_m,
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
        max_dop=_unlimited(asked.max_dop),
        kind=asked.kind,
        dilution=asked.measure,
        on_surface=asked.on_surface,
        in_sight_from=asked.in_sight_from,
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
