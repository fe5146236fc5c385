"""A planned flight as the service answers it: the outcome, its corners, and the air along it."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, Field

from planning.paths import FlightProblem, PathStatus, PlanBudget, plan_flight
from planning.validation import FlightSamples, fly_along
from service.files.mission_files import mission_warnings
from service.parts.map_area import map_area, refuse_outside
from service.parts.map_facts import MapSummary, preamble
from service.parts.plan_answers import ValidationOut, finite, validation_answer
from service.parts.ranging_sources import check_sources, limit_of, ranging_sources, sight_lines
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import resolve_point
from service.products import UNWATCHED, Work
from terrain import ElevationGrid, height_at
from visibility import Anchor, DistantAnchor, morphing_map
from visibility.air import MorphingMap
from visibility.air.morphing_maps import check_ceiling
from visibility.cover import canopy_paths
from visibility.signal import foliage_of

from .request import FlightParameters

__all__ = [
    "AIR_COLUMNS",
    "AirPlaceOut",
    "FinishedFlight",
    "FlightCornerOut",
    "FlightSummary",
    "FlightTotalsOut",
    "calculate_flight",
    "check_flight_request",
]

Floats = npt.NDArray[np.float64]
# what is known along a flight, at fine steps
AIR_COLUMNS = ("distance_m", "altitude_m", "ground_m", "floor_m", "top_m", "clearance_m")
SHARE_OF_MAP = 0.5
START, GOAL = "The start", "The goal"
LEAST_TREES_M = 0.1  # of a flight, to be told


class AirPlaceOut(BaseModel):
    """A place in the air."""

    east_m: float = Field(description="East in the DEM's metric CRS, metres.")
    north_m: float = Field(description="North in the DEM's metric CRS, metres.")
    altitude_m: float = Field(description="Height in the DEM's vertical datum, metres.")


class FlightCornerOut(AirPlaceOut):
    """Where a flight turns, and when it is there."""

    above_ground_m: float | None = Field(description="Height above known ground, metres.")
    time_s: float = Field(description="Since the start, seconds.")


class FlightTotalsOut(BaseModel):
    """What the whole flight amounts to."""

    length_m: float = Field(description="Through the air, metres.")
    climb_m: float = Field(description="Metres up.")
    descent_m: float = Field(description="Metres down.")
    time_s: float = Field(description="Seconds at the speed asked for.")
    highest_m: float = Field(description="Highest altitude, metres.")
    clearance_m: float = Field(description="Least distance to the ground, metres.")
    margin_m: float | None = Field(description="Least height over the morphing map, metres; null without one.")


class FlightSummary(MapSummary):
    """How the plan ended, and the flight."""

    status: PathStatus = Field(
        description="found: a flight that the validator passed; unreachable: proved; undecided: neither a flight nor "
        "that proof was found; refused: the validator found a fault."
    )
    sentence: str = Field(description="The outcome in words.")
    totals: FlightTotalsOut | None
    cost: float | None = Field(description="Of the flight, in metres.")
    corners: list[FlightCornerOut] = Field(description="Where the flight turns, from its start to its goal.")
    validation: ValidationOut | None
    planner: str = Field(description="Which planner the flight came from.")
    stopped_by: str = Field(
        description="count: the iterations; time: the time-out; stop: a request; proof: no flight; "
        "grain: it was searched as finely as it is."
    )
    seed: int = Field(description="The seed, a number.")
    start: AirPlaceOut
    goal: AirPlaceOut


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
def calculate_flight(grid: ElevationGrid, asked: FlightParameters, work: Work = UNWATCHED) -> FinishedFlight:
    """The flight that the parameters ask for, or the best found until work.stop.

    Raises PathError, FrameError, AnchorError, AlmanacError, VisibilityInputError.
    """
    started_s = time.perf_counter()
    area = map_area(grid, asked.area)
    above, lines = None, None
    of_map: tuple[str, ...] = ()
    if asked.morphing_map is not None:
        lines, sources = sight_lines(grid, asked.morphing_map, work.progress, SHARE_OF_MAP)
        ceiling_m, above_ground = asked.morphing_map.ceiling()
        limit = limit_of(asked.morphing_map)
        above = morphing_map(lines, limit, ceiling_m=ceiling_m, ceiling_above_ground=above_ground)
        of_map = (*lines.warnings, *above.warnings, *sources.warnings)
    work.progress(SHARE_OF_MAP)
    problem = _problem(grid, asked, above)
    outcome = plan_flight(problem, stop=work.stop)
    found = outcome.status is PathStatus.FOUND
    air = fly_along(problem, outcome.corners_m) if found else None
    work.progress(1.0)
    of_files = (*area.sentences(), *(mission_warnings("flight", grid) if found else ()), *_through_trees(grid, air))
    calculated = asked if asked.morphing_map is None else asked.morphing_map
    answer = FlightSummary(
        **preamble(*(area.box, asked, lines, (*of_map, *of_files)), mode=calculated.mode, unknown=calculated.unknown),
        timing={"calculation_s": time.perf_counter() - started_s, "plan_s": outcome.elapsed_s},
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
    return FinishedFlight(area.box, (), asked, answer, outcome.corners_m, _table(air))


def _problem(grid: ElevationGrid, asked: FlightParameters, above: MorphingMap | None) -> FlightProblem:
    ceiling_m = asked.ceiling_altitude_m if asked.ceiling_above_ground_m is None else asked.ceiling_above_ground_m
    start, goal = resolve_point(grid, asked.start, START), resolve_point(grid, asked.goal, GOAL)
    for end, called in ((start, START), (goal, GOAL)):
        refuse_outside(grid, asked.area, np.array([end]), called)
    return FlightProblem(
        grid,
        start,
        goal,
        above=above,
        ceiling_m=math.inf if ceiling_m is None else ceiling_m,
        ceiling_above_ground=asked.ceiling_above_ground_m is not None,
        bubble_m=asked.bubble_m,
        climb_weight=asked.climb_weight,
        keep_in=map_area(grid, asked.area).within((), "the DEM"),
        seed=asked.seed,
        budget=PlanBudget(**asked.budget.model_dump()),
    )


def _through_trees(grid: ElevationGrid, air: FlightSamples | None) -> tuple[str, ...]:
    """That a flight leads through crowns: distances are kept to ground and buildings alone."""
    foliage = foliage_of(grid)
    if air is None or foliage is None:
        return ()
    way_m = float(np.nansum(canopy_paths(foliage.canopy, air.point_m[:-1], air.point_m[1:])))
    told = f"The flight leads through {way_m:.0f} m of trees: it keeps its distance to ground and buildings alone."
    return (told,) if way_m > LEAST_TREES_M else ()


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
