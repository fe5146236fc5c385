"""A planned path as the service answers it: the outcome, what holds at each vertex, and the map it was planned on."""

from __future__ import annotations

import importlib.metadata
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.paths import PathProblem, plan_path
from service.estimates import refuse_budget, refuse_map
from service.files.missions import mission_warnings
from service.parts.areas_without_posts import told_of_areas
from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, dem_summary
from service.parts.ranging_sources import RangingSources, limit_of, lines_to, sight_lines, source_summary
from service.parts.satellites import ORBIT_TEXTS
from service.products.paths.answers import VERTEX_COLUMNS, outcome_answer, validation_answer, vertex_table
from service.products.paths.question import path_question, path_sources, path_tracks
from service.products.paths.request import PathParameters
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor, DistantAnchor, MinimumVisibleAltitude, dop_map, morphing_map

__all__ = ["FinishedPath", "calculate_path", "check_path_request", "refuse_path"]

SHARE_OF_SIGHT_LINES = 0.3
SHARE_OF_PLAN = 0.9

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class FinishedPath:
    """A finished plan, also one that found no path.

    answer: the outcome, ready for JSON. vertices: (n, columns) float64, VERTEX_COLUMNS of the path; none without one.
    visible: (n, anchors) uint8. corners: numbers of the vertices at which the way turns.
    dop: (rows, cols) float32 at the antenna, +inf = no fix, NaN = unknown. count: (rows, cols) uint16, surely in sight.
    reasons: (rows - 1, cols - 1) uint16, why each square may not be driven, 0 = it may.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: PathParameters
    calculation: Calculation
    vertices: npt.NDArray[np.float64]
    visible: npt.NDArray[np.uint8]
    corners: npt.NDArray[np.int64]
    dop: npt.NDArray[np.float32]
    count: npt.NDArray[np.uint16]
    reasons: npt.NDArray[np.uint16]
    answer: dict[str, Any]

    @property
    def found(self) -> bool:
        """Whether there is a path."""
        return len(self.vertices) > 0

    def column(self, name: str) -> npt.NDArray[np.float64]:
        """(n,) one of VERTEX_COLUMNS along the path."""
        values: npt.NDArray[np.float64] = self.vertices[:, VERTEX_COLUMNS.index(name)]
        return values

    def summary(self) -> dict[str, Any]:
        """What path.json says: plain values, ready for JSON, every number with its unit in its name."""
        asked, calculation = self.parameters, self.calculation
        orbits = {"satellites": set(ORBIT_TEXTS)}
        return {
            "version": calculation.version,
            "mode": asked.mode,
            "error_statement": calculation.error_statement,
            "curvature": calculation.curvature,
            "unknown": asked.unknown,
            "dem": dem_summary(self.grid),
            **source_summary(self.grid, self.anchors),
            "warnings": list(calculation.warnings),
            "parameters": asked.model_dump(mode="json", exclude_none=True, exclude={**orbits, "morphing_map": orbits}),
            **self.answer,
            "timing": {"calculation_s": calculation.elapsed_s, **self.answer["timing"]},
        }


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


def refuse_path(grid: ElevationGrid, asked: PathParameters, settings: Settings) -> None:
    """Raises LimitError for a plan that may take longer than a job may run."""
    refuse_budget(asked.budget.seconds, settings)
    if asked.morphing_map is not None:
        refuse_map(grid.heights_m.size, len(asked.morphing_map.anchors), asked.morphing_map.mode, settings)


@told_as_asked
def calculate_path(
    grid: ElevationGrid,
    asked: PathParameters,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
) -> FinishedPath:
    """The plan that the parameters ask for on this grid; progress is called with the finished share 0..1.

    stop: once it says True, the plan ends with the best path that it has.
    Raises PathError, RequestError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    started_s = time.perf_counter()
    mapped = _mapped(grid, asked, _part(progress, 0.0, SHARE_OF_SIGHT_LINES))
    problem, lines = mapped.problem, mapped.lines
    outcome = plan_path(problem, progress=_part(progress, SHARE_OF_SIGHT_LINES, SHARE_OF_PLAN), stop=stop)
    validation = outcome.validation
    rows, cols = grid.shape
    dop, count = np.full((rows, cols), np.nan, np.float32), np.zeros((rows, cols), np.uint16)
    if lines is not None:
        limits = problem.limits
        found = dop_map(
            *(lines, problem.rover.receiver_above_ground_m, limits.kind),
            measure=limits.measure,
            on_surface=limits.on_surface,
        )
        dop, count = found.dop, found.count
    answer = outcome_answer(problem, outcome)
    answer["validation"] = None if validation is None else validation_answer(validation)
    if progress is not None:
        progress(1.0)
    path = outcome.path
    told = told_of_areas(grid, {"no_go": asked.no_go, "keep_in": asked.keep_in})
    told += () if path is None else mission_warnings("path", grid)
    return FinishedPath(
        grid,
        mapped.standing,
        asked,
        Calculation(
            "" if lines is None else lines.error_statement,
            "" if lines is None else lines.curvature.sentence(),
            tuple(dict.fromkeys((*grid.provenance.warnings, *mapped.warnings, *outcome.warnings, *told))),
            time.perf_counter() - started_s,
            importlib.metadata.version("sightline"),
        ),
        vertex_table(path),
        np.zeros((0, 0), np.uint8) if path is None else path.visible.astype(np.uint8),
        np.zeros(0, np.int64) if path is None else path.corners,
        dop,
        count,
        outcome.reasons,
        answer,
    )


@dataclass(frozen=True, slots=True)
class _Mapped:
    """A problem, what stands of what it ranges to, and the sight lines that its picture shows."""

    problem: PathProblem
    standing: tuple[Anchor | DistantAnchor, ...]
    lines: MinimumVisibleAltitude | None
    warnings: tuple[str, ...]


def _mapped(grid: ElevationGrid, asked: PathParameters, progress: Progress | None) -> _Mapped:
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


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    if progress is None:
        return None
    return lambda share: progress(begin + (end - begin) * share)
