"""A planned path: the question in the grid's frame, the outcome, what holds at each vertex, and the map below."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from planning.alternatives import Alternatives, Departures, alternatives_to, plan_departures
from planning.paths import PathOutcome, PathProblem, PathStatus, plan_path
from service.files.mission_files import mission_warnings
from service.parts.map_area import MapArea, map_area
from service.parts.map_facts import preamble
from service.parts.plan_answers import finite, place_answer, validation_answer
from service.parts.positioning import ORBIT_TEXTS
from service.parts.positioning_answers import placed_anchors, placed_satellites, range_sigmas_told
from service.parts.ranging_sources import RangingSources, limit_of, lines_to, sight_lines
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import told_of_areas
from service.products import UNWATCHED, Work
from service.products.paths.answer import (
    FinishedPath,
    PathSummary,
    alternative_answer,
    departures_answer,
    goal_answer,
    totals_answer,
    unreachable_answer,
    vertex_table,
)
from service.products.paths.question import path_question, path_sources, path_tracks
from service.products.paths.request import PathParameters
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, dop_map, morphing_map

__all__ = ["MappedQuestion", "calculate_path", "mapped_question"]

SHARE_OF_DEPARTURES, SHARE_OF_SIGHT_LINES = 0.2, 0.3
SHARE_OF_PLAN, SHARE_WITH_ALTERNATIVES = 0.9, 0.6
ORBITS = {"satellites": set(ORBIT_TEXTS)}
Progress = Callable[[float], None]


@told_as_asked
def calculate_path(grid: ElevationGrid, asked: PathParameters, work: Work = UNWATCHED) -> FinishedPath:
    """The plan that the parameters ask for on this grid, or the best found until work.stop.

    Raises PathError, RequestError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    started_s = time.perf_counter()
    begin = 0.0 if asked.leave_by_s is None else SHARE_OF_DEPARTURES
    when = _departures(grid, asked, work.part(0.0, begin), work.stop)
    taken = None if when is None else when.best
    leaving = asked if taken is None else asked.model_copy(update={"departure_s": taken.departure_s})
    mapped = mapped_question(grid, leaving, work.part(begin, SHARE_OF_SIGHT_LINES))
    problem, lines = mapped.problem, mapped.lines
    planned = SHARE_OF_PLAN if asked.alternatives is None else SHARE_WITH_ALTERNATIVES
    outcome = plan_path(problem, progress=work.part(SHARE_OF_SIGHT_LINES, planned), stop=work.stop)
    if when is not None:
        outcome = _in_time(outcome, when, math.inf if asked.arrive_by_s is None else asked.arrive_by_s)
    others = None
    if asked.alternatives is not None:
        told = work.part(planned, SHARE_OF_PLAN)
        within_s = math.inf if asked.arrive_by_s is None else asked.arrive_by_s - problem.departure_s
        others = alternatives_to(problem, outcome, asked.alternatives, within_s=within_s, progress=told, stop=work.stop)
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
    answer = _answer(area, asked, mapped, outcome, (others, when), started_s)
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


def _departures(
    grid: ElevationGrid, asked: PathParameters, progress: Progress, stop: Callable[[], bool]
) -> Departures | None:
    """The times at which it may leave, tried; None where one is given."""
    if asked.leave_by_s is None:
        return None
    problem = path_question(grid, asked, path_sources(grid, asked), tracks=path_tracks(grid, asked))
    arrive_by_s = math.inf if asked.arrive_by_s is None else asked.arrive_by_s
    return plan_departures(problem, asked.leave_by_s, arrive_by_s=arrive_by_s, progress=progress, stop=stop)


def _in_time(outcome: PathOutcome, when: Departures, arrive_by_s: float) -> PathOutcome:
    """The outcome where it arrives in time; else that of the departure taken, which does, or that there is none."""
    best, found = when.best, outcome.status is PathStatus.FOUND
    if best is not None:
        assert best.outcome is not None, "as every departure that arrives in time has one"
        # a way that costs less may take longer
        late = outcome.path is None or best.departure_s + outcome.path.totals.time_s > arrive_by_s
        return best.outcome if late else outcome
    if not found:
        # what the departure asked for lacks, and what the others do: each may be mended
        told = when.sentence if outcome.sentence in when.sentence else f"{outcome.sentence} {when.sentence}"
        return replace(outcome, sentence=told)
    outcome = replace(outcome, status=PathStatus.UNDECIDED, sentence=when.sentence, path=None, validation=None)
    return replace(outcome, reference_cost=math.nan, ratio=math.nan)


@dataclass(frozen=True, slots=True)
class MappedQuestion:
    """A problem, what stands of what it ranges to, and the sight lines that its picture shows."""

    problem: PathProblem
    standing: tuple[Anchor | DistantAnchor, ...]
    lines: MinimumVisibleAltitude | None
    warnings: tuple[str, ...]


def mapped_question(grid: ElevationGrid, asked: PathParameters, progress: Progress) -> MappedQuestion:
    """The problem, with sight worked out where all anchors stand. Raises what ``calculate_path`` raises."""
    if asked.morphing_map is not None:
        lines, sources = sight_lines(grid, asked.morphing_map, progress, 1.0)
        ceiling_m, above_ground = asked.morphing_map.ceiling()
        limit = limit_of(asked.morphing_map)
        air = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
        problem = path_question(grid, asked, RangingSources(()), air)
        return MappedQuestion(problem, (), lines, (*air.warnings, *sources.warnings))
    sources, tracks = path_sources(grid, asked), path_tracks(grid, asked)
    here = (*sources.all, *(track.at(asked.departure_s) for track in tracks))
    antenna_m = asked.rover.receiver_above_ground_m
    lines_here = lines_to(grid, here, asked, progress, only_above_ground_m=antenna_m) if here else None
    # the maps of anchors that move are the planner's own: one for each time
    problem = path_question(grid, asked, sources, None if tracks else lines_here, tracks)
    warnings = () if lines_here is None else lines_here.warnings
    return MappedQuestion(problem, sources.all, lines_here, (*warnings, *sources.warnings))


def _answer(
    area: MapArea,
    asked: PathParameters,
    mapped: MappedQuestion,
    outcome: PathOutcome,
    besides: tuple[Alternatives | None, Departures | None],
    started_s: float,
) -> PathSummary:
    """The outcome of a plan; what is no finite number is None."""
    grid, (others, when) = area.grid, besides
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
        alternatives=[] if others is None else [alternative_answer(one) for one in others.paths],
        alternatives_sentence="" if others is None else others.sentence,
        departures=[] if when is None else departures_answer(when),
        departures_sentence="" if when is None else when.sentence,
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
