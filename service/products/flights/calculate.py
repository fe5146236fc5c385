"""A planned flight as the service answers it: the outcome, its corners, and the air along it."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from planning.paths import FlightProblem, PathStatus, PlanBudget, plan_flight
from planning.validation import FlightSamples, fly_along
from service.files.missions import mission_warnings
from service.parts.map_facts import ground_of
from service.parts.plan_answers import finite, validation_answer
from service.parts.positions import resolve_point
from service.parts.ranging_sources import check_sources, limit_of, ranging_sources, sight_lines
from service.parts.sentences import told_as_asked
from service.products.flights.answer import AirPlaceOut, FlightCornerOut, FlightSummary, FlightTotalsOut
from service.products.flights.request import FlightParameters
from terrain import ElevationGrid, height_at
from visibility import Anchor, DistantAnchor, MorphingMap, morphing_map
from visibility.air.morphing_maps import check_ceiling

__all__ = ["AIR_COLUMNS", "FinishedFlight", "calculate_flight", "check_flight_request"]

Floats = npt.NDArray[np.float64]
# what is known along a flight, at fine steps
AIR_COLUMNS = ("distance_m", "altitude_m", "ground_m", "floor_m", "top_m", "clearance_m")
SHARE_OF_MAP = 0.5


@dataclass(frozen=True, eq=False)
class FinishedFlight:
    """A finished plan, also one that found no flight.

    anchors: none, for the map brings its own. corners_m: (m, 3) east, north, altitude. air: (n, columns) AIR_COLUMNS
    along the flight; both without rows where there is none.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: FlightParameters
    answer: FlightSummary
    corners_m: Floats
    air: Floats

    @property
    def found(self) -> bool:
        """Whether there is a flight."""
        return len(self.corners_m) > 0

    def column(self, name: str) -> Floats:
        """(n,) one of AIR_COLUMNS along the flight."""
        values: Floats = self.air[:, AIR_COLUMNS.index(name)]
        return values


@told_as_asked
def check_flight_request(grid: ElevationGrid, asked: FlightParameters) -> int:
    """Refuse what makes no question; how many anchors and satellites there are.

    Raises PathError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    _problem(grid, asked, None)
    if asked.morphing_map is None:
        return 0
    sources = ranging_sources(grid, asked.morphing_map).all
    check_sources(grid, sources, asked.morphing_map)
    check_ceiling(grid, *asked.morphing_map.ceiling())
    return len(sources)


@told_as_asked
def calculate_flight(
    grid: ElevationGrid,
    asked: FlightParameters,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> FinishedFlight:
    """The flight that the parameters ask for; progress is called with the finished share 0..1.

    stop: once it says True, the plan ends with the best flight that it has.
    Raises PathError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    started_s, told = time.perf_counter(), progress or (lambda _: None)
    above, lines = None, None
    of_map: tuple[str, ...] = ()
    if asked.morphing_map is not None:
        lines, sources = sight_lines(grid, asked.morphing_map, progress, SHARE_OF_MAP)
        ceiling_m, above_ground = asked.morphing_map.ceiling()
        limit = limit_of(asked.morphing_map)
        above = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
        of_map = (*lines.warnings, *above.warnings, *sources.warnings)
    told(SHARE_OF_MAP)
    problem = _problem(grid, asked, above)
    outcome = plan_flight(problem, stop=stop)
    found = outcome.status is PathStatus.FOUND
    air = fly_along(problem, outcome.corners_m) if found else None
    told(1.0)
    of_files = mission_warnings("flight", grid) if found else ()
    calculated = asked if asked.morphing_map is None else asked.morphing_map
    answer = FlightSummary(
        version=importlib.metadata.version("sightline"),
        mode=calculated.mode,
        error_statement="" if lines is None else lines.error_statement,
        curvature="" if lines is None else lines.curvature.sentence(),
        unknown=calculated.unknown,
        dem=ground_of(grid),
        warnings=list(dict.fromkeys((*grid.provenance.warnings, *of_map, *of_files))),
        timing={"calculation_s": time.perf_counter() - started_s, "plan_s": outcome.elapsed_s},
        parameters=asked.model_dump(mode="json", exclude_none=True),
        status=outcome.status,
        sentence=outcome.sentence,
        totals=None if air is None else _totals(problem, asked, air),
        cost=finite(outcome.cost),
        corners=_corners(grid, outcome.corners_m, asked.speed_m_per_s),
        validation=None if outcome.validation is None else validation_answer(outcome.validation),
        planner=outcome.planner,
        stopped_by=outcome.stopped_by,
        seed=outcome.seed,
        start=_place(problem.start),
        goal=_place(problem.goal),
    )
    return FinishedFlight(grid, (), asked, answer, outcome.corners_m, _table(air))


def _problem(grid: ElevationGrid, asked: FlightParameters, above: MorphingMap | None) -> FlightProblem:
    ceiling_m = asked.ceiling_altitude_m if asked.ceiling_above_ground_m is None else asked.ceiling_above_ground_m
    return FlightProblem(
        grid,
        resolve_point(grid, asked.start, "The start"),
        resolve_point(grid, asked.goal, "The goal"),
        above=above,
        ceiling_m=math.inf if ceiling_m is None else ceiling_m,
        ceiling_above_ground=asked.ceiling_above_ground_m is not None,
        bubble_m=asked.bubble_m,
        climb_weight=asked.climb_weight,
        seed=asked.seed,
        budget=PlanBudget(**asked.budget.model_dump()),
    )


def _table(air: FlightSamples | None) -> Floats:
    if air is None:
        return np.zeros((0, len(AIR_COLUMNS)))
    return np.column_stack([air.distance_m, air.point_m[:, 2], air.ground_m, air.floor_m, air.top_m, air.clearance_m])


def _place(point_m: tuple[float, float, float]) -> AirPlaceOut:
    return AirPlaceOut(east_m=point_m[0], north_m=point_m[1], altitude_m=point_m[2])


def _corners(grid: ElevationGrid, corners_m: Floats, speed_m_per_s: float) -> list[FlightCornerOut]:
    along_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1))])
    ground_m = height_at(grid, corners_m[:, 0], corners_m[:, 1])
    return [
        FlightCornerOut(
            east_m=east_m,
            north_m=north_m,
            altitude_m=up_m,
            above_ground_m=finite(up_m - under_m),
            time_s=flown_m / speed_m_per_s,
        )
        for (east_m, north_m, up_m), under_m, flown_m in zip(
            corners_m.tolist(), ground_m.tolist(), along_m.tolist(), strict=False
        )
    ]


def _totals(problem: FlightProblem, asked: FlightParameters, air: FlightSamples) -> FlightTotalsOut:
    up_m, length_m = air.point_m[:, 2], float(air.distance_m[-1])
    rises_m = np.diff(up_m)
    return FlightTotalsOut(
        length_m=length_m,
        climb_m=float(rises_m[rises_m > 0.0].sum()),
        descent_m=abs(float(rises_m[rises_m < 0.0].sum())),
        time_s=length_m / asked.speed_m_per_s,
        highest_m=float(up_m.max()),
        clearance_m=float(air.clearance_m.min()),
        margin_m=None if problem.above is None else float((up_m - air.floor_m).min()),
    )
