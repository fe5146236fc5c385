"""Repositioning as the service answers it: who moves where and when, and what holds along the path before and after."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import AliasChoices, BaseModel, ConfigDict, Field

from planning.placement import Flight, MoveQuestion, RepositioningPlan, TimedMove, plan_repositioning, straight_ahead
from planning.placement.moves import USUAL_HEIGHTS_M
from service.files.mission_files import mission_warnings
from service.parts.doubts import doubted_anchors
from service.parts.map_area import MapArea, map_area, refuse_outside
from service.parts.map_facts import MapSummary, curvature_of, preamble
from service.parts.positioning_answers import PlacedAnchor, placed_anchors
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import anchors_in_grid, places_in_grid, told_of_areas
from service.products import UNWATCHED, Work
from service.products.placements.question import areas_of_rules, goal_of, rules_of, sight_of
from terrain import ElevationGrid
from visibility import Anchor, Curvature
from visibility.sight import check_anchors
from visibility.sight.sight_lines import ERROR_STATEMENT

from .request import DroneFlightIn, RepositioningParameters

__all__ = [
    "FinishedRepositioning",
    "MoveOut",
    "RepositioningSummary",
    "StretchOut",
    "calculate_repositioning",
    "path_ahead",
]

Floats = npt.NDArray[np.float64]


class MoveOut(BaseModel):
    """One drone's move."""

    model_config = ConfigDict(serialize_by_alias=True)

    anchor_id: str = Field(description="Which drone.")
    from_: PlacedAnchor = Field(
        validation_alias=AliasChoices("from", "from_"), serialization_alias="from", description="Where it stood."
    )
    to: PlacedAnchor = Field(description="Where it goes.")
    flight_m: float = Field(description="Metres of its flight: up, level, down.")
    flight_s: float = Field(description="Seconds that it takes.")
    start_s: float = Field(description="When it leaves, seconds since the rover's start.")
    end_s: float = Field(description="When it has arrived, seconds since the rover's start.")
    stretch: int = Field(description="Number of the stretch that it is for.")


class StretchOut(BaseModel):
    """A stretch of the path."""

    from_m: float = Field(description="Where it begins, metres along the path.")
    to_m: float = Field(description="Where it ends, metres along the path.")
    depart_s: float = Field(description="When the rover leaves its beginning, seconds since the start.")
    arrive_s: float = Field(description="When it reaches its end, seconds since the start.")
    waited_s: float = Field(description="How long it waits for drones before, seconds.")
    before_share: float = Field(description="Part of it that is good when nobody moves, 0..1.")
    after_share: float = Field(description="Part of it that is good with the moves, 0..1.")


class RepositioningSummary(MapSummary):
    """Who moves where, and what it brings."""

    goal: str = Field(description="What shall hold, in words.")
    occluded: list[str] = Field(description="Anchors that were taken as hidden for good.")
    heights: str = Field("", description="To which heights drones could move, in words.")
    before_share: float = Field(description="Part of the path where it holds when nobody moves, 0..1.")
    after_share: float = Field(description="Part of the path where it holds with the moves, 0..1.")
    restored: bool = Field(description="Whether the share asked for is reached, on every stretch.")
    sentence: str = Field(description="The answer in words.")
    moves: list[MoveOut]
    anchors: list[PlacedAnchor] = Field(description="All anchors after the last move.")
    stretches: list[StretchOut]
    flight_m: float = Field(description="Metres that all drones fly.")
    waited_s: float = Field(description="Seconds that the rover waits for them.")


@dataclass(frozen=True, slots=True)
class ExactSight:
    """What values along a path stand on: sight lines one by one."""

    curvature: Curvature
    error_statement: str = ERROR_STATEMENT


@dataclass(frozen=True, eq=False)
class FinishedRepositioning:
    """A finished repositioning.

    anchors: as they stood. point_m: (m, 3) places of the antenna along the path. good: (m, 2) uint8, 1 where the goal
    holds, before and after.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: RepositioningParameters
    answer: RepositioningSummary
    point_m: Floats
    good: npt.NDArray[np.uint8]


@told_as_asked
def calculate_repositioning(
    grid: ElevationGrid, parameters: RepositioningParameters, work: Work = UNWATCHED
) -> FinishedRepositioning:
    """Who moves where.

    Raises PlacementError, FrameError, AnchorError.
    """
    started_s = time.perf_counter()
    anchors, passed_over = doubted_anchors(grid, anchors_in_grid(grid, parameters), parameters.doubts)
    warnings = check_anchors(grid, anchors)
    plan = plan_repositioning(
        grid,
        anchors,
        path_ahead(grid, parameters),
        _question(grid, parameters),
        stretch_m=parameters.stretch_m,
        rover_m_per_s=parameters.rover_m_per_s,
        progress=work.progress,
    )
    told = (
        *passed_over,
        *told_of_areas(grid, areas_of_rules(parameters.rules)),
        *mission_warnings("repositioning", grid),
    )
    area = map_area(grid, parameters.area)
    answer = _answer(area, parameters, plan, (*warnings, *area.sentences(), *told), time.perf_counter() - started_s)
    return FinishedRepositioning(area.box, anchors, parameters, answer, plan.point_m, plan.good.astype(np.uint8))


def path_ahead(grid: ElevationGrid, parameters: RepositioningParameters) -> Floats:
    """(n, 2) the path ahead in the grid's frame. Raises AreaError, FrameError."""
    if parameters.path is not None:
        ahead_m = places_in_grid(grid, parameters.path)
    else:
        rover = parameters.rover
        assert rover is not None, "the schema has seen to it"
        east_m, north_m = places_in_grid(grid, [rover.place])[0]
        ahead_m = straight_ahead(float(east_m), float(north_m), math.radians(rover.heading_deg), rover.ahead_m)
    refuse_outside(grid, parameters.area, ahead_m, "Place {} of the path ahead")
    return ahead_m


def _question(grid: ElevationGrid, asked: RepositioningParameters) -> MoveQuestion:
    return MoveQuestion(
        goal_of(asked.goal),
        occluded=asked.occluded,
        movable=asked.movable,
        share=asked.share,
        above_ground_m=asked.heights_above_ground_m,
        receiver_above_ground_m=asked.receiver_above_ground_m,
        cheapest=asked.cheapest,
        flight=_flight(asked.flight),
        rules=rules_of(grid, asked.rules),
        sight=sight_of(asked),
    )


def _flight(asked: DroneFlightIn) -> Flight:
    longest_m = math.inf if asked.max_flight_m is None else asked.max_flight_m
    return Flight(asked.speed_m_per_s, asked.climb_m_per_s, asked.descent_m_per_s, asked.clearance_m, longest_m)


def _answer(
    area: MapArea,
    asked: RepositioningParameters,
    plan: RepositioningPlan,
    warnings: tuple[str, ...],
    elapsed_s: float,
) -> RepositioningSummary:
    grid, schedule = area.grid, plan.schedule
    return RepositioningSummary(
        **preamble(
            *(area.box, asked, ExactSight(curvature_of(asked) or Curvature.of(grid)), warnings),
            mode=asked.mode,
            unknown=asked.unknown,
        ),
        timing={"calculation_s": elapsed_s},
        goal=goal_of(asked.goal).sentence(asked.in_words),
        occluded=list(asked.occluded),
        heights=_heights(asked.heights_above_ground_m),
        before_share=schedule.share_unmoved,
        after_share=schedule.share,
        restored=plan.restored,
        sentence=plan.sentence,
        moves=[_move(grid, timed) for timed in schedule.moves],
        anchors=placed_anchors(grid, schedule.stretches[-1].anchors),
        stretches=[
            StretchOut(
                from_m=stretch.from_m,
                to_m=stretch.to_m,
                depart_s=stretch.depart_s,
                arrive_s=stretch.arrive_s,
                waited_s=stretch.waited_s,
                before_share=stretch.unmoved,
                after_share=stretch.value,
            )
            for stretch in schedule.stretches
        ],
        flight_m=schedule.flight_m,
        waited_s=schedule.waited_s,
    )


def _heights(asked_m: list[float] | None) -> str:
    *most, last = [f"{height_m:g}" for height_m in (USUAL_HEIGHTS_M if asked_m is None else asked_m)]
    told = f"{', '.join(most)} and {last}" if most else last
    return f"{told} m above ground" + (", and each drone's own altitude" if asked_m is None else "")


def _move(grid: ElevationGrid, timed: TimedMove) -> MoveOut:
    start, end = placed_anchors(grid, (timed.move.anchor, timed.move.to))
    return MoveOut(
        anchor_id=timed.move.anchor.id,
        from_=start,
        to=end,
        flight_m=timed.move.flight_m,
        flight_s=timed.move.flight_s,
        start_s=timed.start_s,
        end_s=timed.end_s,
        stretch=timed.stretch,
    )
