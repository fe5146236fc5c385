"""A planned path: the question in the grid's frame, the outcome, what holds at each vertex, and the map below."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from navigation import MotionNoise
from planning.paths import (
    CostWeights,
    NavigationModel,
    PathLimits,
    PathOutcome,
    PathProblem,
    PlanBudget,
    RoverModel,
    plan_path,
)
from service.files.mission_files import mission_warnings
from service.parts.map_area import MapArea, map_area, refuse_outside
from service.parts.map_facts import preamble
from service.parts.plan_answers import finite, place_answer, validation_answer
from service.parts.points import PlaceIn, PolygonIn
from service.parts.positioning import ORBIT_TEXTS
from service.parts.positioning_answers import placed_anchors, placed_satellites, range_sigmas_told
from service.parts.ranging_sources import RangingSources, limit_of, lines_to, ranging_sources, sight_lines, track_of
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import places_in_grid, polygon_in_grid, told_of_areas
from service.products import UNWATCHED, Work
from service.products.paths.answer import (
    FinishedPath,
    PathSummary,
    goal_answer,
    totals_answer,
    unreachable_answer,
    vertex_table,
)
from service.products.paths.request import NavigationIn, PathLimitsIn, PathParameters, RoverIn
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, dop_map, morphing_map
from visibility.air import MorphingMap
from visibility.sight import AnchorTrack, check_anchors

__all__ = [
    "calculate_path",
    "check_path_request",
    "limits_of",
    "navigation_of",
    "path_question",
    "path_sources",
    "path_tracks",
    "rover_of",
]

SHARE_OF_SIGHT_LINES = 0.3
SHARE_OF_PLAN = 0.9
ORBITS = {"satellites": set(ORBIT_TEXTS)}
Progress = Callable[[float], None]


def path_sources(grid: ElevationGrid, asked: PathParameters) -> RangingSources:
    """What the rover ranges to, checked. Raises AnchorError, FrameError, AlmanacError, VisibilityInputError."""
    sources = ranging_sources(grid, asked)
    if sources.all:
        check_anchors(grid, sources.all)
    return sources


def path_tracks(grid: ElevationGrid, asked: PathParameters) -> tuple[AnchorTrack, ...]:
    """The anchors that move. Raises AnchorError, FrameError, VisibilityInputError."""
    return tuple(track_of(grid, track, heard=asked.usable) for track in asked.tracks)


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
    for track in tracks:
        track.at(asked.departure_s)
    path_question(grid, asked, sources, tracks=tracks)
    return len(sources.all) + len(tracks)


@told_as_asked
def calculate_path(grid: ElevationGrid, asked: PathParameters, work: Work = UNWATCHED) -> FinishedPath:
    """The plan that the parameters ask for on this grid, or the best found until work.stop.

    Raises PathError, RequestError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    started_s = time.perf_counter()
    mapped = _mapped(grid, asked, work.part(0.0, SHARE_OF_SIGHT_LINES))
    problem, lines = mapped.problem, mapped.lines
    outcome = plan_path(problem, progress=work.part(SHARE_OF_SIGHT_LINES, SHARE_OF_PLAN), stop=work.stop)
    dop, count = np.full(grid.shape, np.nan, np.float32), np.zeros(grid.shape, np.uint16)
    if lines is not None:
        limits = problem.limits
        found = dop_map(
            *(lines, problem.rover.receiver_above_ground_m, limits.kind),
            measure=limits.measure,
            on_surface=limits.on_surface,
        )
        dop, count = found.dop, found.count
    path, area = outcome.path, map_area(grid, asked.area)
    answer = _answer(area, asked, mapped, outcome, started_s)
    work.progress(1.0)
    return FinishedPath(
        area.box,
        mapped.standing,
        asked,
        answer,
        vertex_table(path),
        np.zeros((0, 0), np.uint8) if path is None else path.visible.astype(np.uint8),
        np.zeros(0, np.int64) if path is None else path.corners,
        area.cut(dop),
        area.cut(count),
        area.cut_squares(outcome.reasons),
    )


@dataclass(frozen=True, slots=True)
class _Mapped:
    """A problem, what stands of what it ranges to, and the sight lines that its picture shows."""

    problem: PathProblem
    standing: tuple[Anchor | DistantAnchor, ...]
    lines: MinimumVisibleAltitude | None
    warnings: tuple[str, ...]


def _mapped(grid: ElevationGrid, asked: PathParameters, progress: Progress) -> _Mapped:
    if asked.morphing_map is not None:
        lines, sources = sight_lines(grid, asked.morphing_map, progress, 1.0)
        ceiling_m, above_ground = asked.morphing_map.ceiling()
        limit = limit_of(asked.morphing_map)
        air = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
        problem = path_question(grid, asked, RangingSources(()), air)
        return _Mapped(problem, (), lines, (*air.warnings, *sources.warnings))
    sources, tracks = path_sources(grid, asked), path_tracks(grid, asked)
    here = (*sources.all, *(track.at(asked.departure_s) for track in tracks))
    antenna_m = asked.rover.receiver_above_ground_m
    lines_here = lines_to(grid, here, asked, progress, only_above_ground_m=antenna_m) if here else None
    # the maps of anchors that move are the planner's own: one for each time
    problem = path_question(grid, asked, sources, None if tracks else lines_here, tracks)
    warnings = () if lines_here is None else lines_here.warnings
    return _Mapped(problem, sources.all, lines_here, (*warnings, *sources.warnings))


def _answer(
    area: MapArea, asked: PathParameters, mapped: _Mapped, outcome: PathOutcome, started_s: float
) -> PathSummary:
    """The outcome of a plan; what is no finite number is None."""
    grid = area.grid
    problem, lines, path, cut = mapped.problem, mapped.lines, outcome.path, outcome.unreachable
    told = told_of_areas(grid, {"no_go": asked.no_go, "keep_in": asked.keep_in})
    told += () if path is None else mission_warnings("path", grid)
    return PathSummary(
        **preamble(
            *(area.box, asked, lines, (*mapped.warnings, *outcome.warnings, *area.sentences(), *told)),
            mode=asked.mode,
            unknown=asked.unknown,
            besides={**ORBITS, "morphing_map": ORBITS},
        ),
        timing={
            "calculation_s": time.perf_counter() - started_s,
            "first_path_s": finite(outcome.first_path_s),
            "plan_s": outcome.elapsed_s,
        },
        status=outcome.status,
        sentence=outcome.sentence,
        totals=None if path is None else totals_answer(path),
        cost=None if path is None else path.cost,
        cost_split=None if path is None else dict(path.cost_split),
        reference_cost=finite(outcome.reference_cost),
        ratio=finite(outcome.ratio),
        unreachable=None if cut is None else unreachable_answer(cut),
        validation=None if outcome.validation is None else validation_answer(outcome.validation),
        planner=outcome.planner,
        stopped_by=outcome.stopped_by,
        seed=outcome.seed,
        anchors=placed_anchors(grid, mapped.standing),
        satellites=placed_satellites(mapped.standing),
        start=place_answer(problem.start),
        goals=[goal_answer(goal) for goal in problem.goals],
        way_points=[place_answer(place) for place in problem.way_points],
        ranged_to=[str(getattr(anchor, "id", "")) for anchor in problem.anchors],
        needed_in_sight=problem.limits.needed_in_sight,
        sigmas=range_sigmas_told((*mapped.standing, *path_tracks(grid, asked))),
    )
