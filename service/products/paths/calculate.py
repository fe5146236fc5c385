"""A planned path as the service answers it: the outcome, what holds at each vertex, and the map it was planned on."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.paths import Path, PathOutcome, PathProblem, plan_path
from service.files.missions import mission_warnings
from service.parts.plan_answers import finite, place_answer, validation_answer
from service.parts.positioning import ORBIT_TEXTS
from service.parts.positioning_answers import placed_anchors, placed_satellites, range_sigmas_told
from service.parts.product_parts import preamble
from service.parts.ranging_sources import RangingSources, limit_of, lines_to, sight_lines
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import told_of_areas
from service.products import UNWATCHED, Work
from service.products.paths.answer import PathSummary, goal_answer, totals_answer, unreachable_answer
from service.products.paths.question import path_question, path_sources, path_tracks
from service.products.paths.request import PathParameters
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, dop_map, morphing_map

__all__ = ["VERTEX_COLUMNS", "FinishedPath", "calculate_path", "check_path_request"]

# fields of a path, one number for each vertex
VERTEX_COLUMNS = (
    *("east_m", "north_m", "altitude_m", "heading_rad", "distance_m", "time_s", "slope_rad", "pitch_rad", "roll_rad"),
    *("anchor_count", "dop", "margin_m", "clearance_m", "position_sigma_m", "bubble_radius_m"),
)
SHARE_OF_SIGHT_LINES = 0.3
SHARE_OF_PLAN = 0.9
ORBITS = {"satellites": set(ORBIT_TEXTS)}

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class FinishedPath:
    """A finished plan, also one that found no path.

    vertices: (n, columns) float64, VERTEX_COLUMNS of the path; none without one.
    visible: (n, anchors) uint8. corners: numbers of the vertices at which the way turns.
    dop: (rows, cols) float32 at the antenna, +inf = no fix, NaN = unknown. count: (rows, cols) uint16, surely in sight.
    reasons: (rows - 1, cols - 1) uint16, why each square may not be driven, 0 = it may.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: PathParameters
    answer: PathSummary
    vertices: npt.NDArray[np.float64]
    visible: npt.NDArray[np.uint8]
    corners: npt.NDArray[np.int64]
    dop: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint16]
    reasons: npt.NDArray[np.uint16]

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return len(self.vertices) > 0

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """(n,) one of VERTEX_COLUMNS along the path."""
        values: npt.NDArray[np.float64] = self.vertices[:, VERTEX_COLUMNS.index(name)]
        return values


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
    path = outcome.path
    answer = _answer(grid, asked, mapped, outcome, started_s)
    work.progress(1.0)
    return FinishedPath(
        grid,
        mapped.standing,
        asked,
        answer,
        _vertex_table(path),
        np.zeros((0, 0), np.uint8) if path is None else path.visible.astype(np.uint8),
        np.zeros(0, np.int64) if path is None else path.corners,
        dop,
        count,
        outcome.reasons,
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
    lines_here = lines_to(grid, here, asked, progress) if here else None
    # the maps of anchors that move are the planner's own: one for each time
    problem = path_question(grid, asked, sources, None if tracks else lines_here, tracks)
    warnings = () if lines_here is None else lines_here.warnings
    return _Mapped(problem, sources.all, lines_here, (*warnings, *sources.warnings))


def _answer(
    grid: ElevationGrid, asked: PathParameters, mapped: _Mapped, outcome: PathOutcome, started_s: float
) -> PathSummary:
    """The outcome of a plan; what is no finite number is None."""
    problem, lines, path, cut = mapped.problem, mapped.lines, outcome.path, outcome.unreachable
    told = told_of_areas(grid, {"no_go": asked.no_go, "keep_in": asked.keep_in})
    told += () if path is None else mission_warnings("path", grid)
    return PathSummary(
        **preamble(
            *(grid, asked, lines, (*mapped.warnings, *outcome.warnings, *told)),
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


def _vertex_table(path: Path | None) -> npt.NDArray[np.float64]:
    """(n, columns) the path's VERTEX_COLUMNS; no rows without a path."""
    if path is None:
        return np.zeros((0, len(VERTEX_COLUMNS)))
    return np.column_stack([np.asarray(getattr(path, name), np.float64) for name in VERTEX_COLUMNS])
