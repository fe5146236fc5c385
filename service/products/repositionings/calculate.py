"""Repositioning as the service answers it: who moves where and when, and what holds along the path before and after."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.placement import (
    Flight,
    Leapfrog,
    Repositioning,
    StretchPlan,
    TimedMove,
    good_along,
    leapfrog,
    path_between,
    path_targets,
    reposition,
    straight_ahead,
)
from service.errors import LimitError
from service.files.missions import mission_warnings
from service.parts.areas_without_posts import areas_of_rules, told_of_areas
from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, curvature_of, dem_summary
from service.parts.positions import resolve_anchor
from service.parts.shapes_in_grid import places_in_grid
from service.products.placements.calculate import place_of
from service.products.placements.question import goal_of, rules_of, sight_of
from service.products.repositionings.request import RepositioningParameters
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor, Curvature, check_anchors
from visibility.sight.sight_lines import ERROR_STATEMENT

__all__ = ["FinishedRepositioning", "calculate_repositioning", "check_repositioning_request", "refuse_repositioning"]

Floats = npt.NDArray[np.float64]
SWEEPS_PER_STRETCH = 24
SECONDS_PER_CELL_AND_SWEEP = 40e-9
SECONDS_PER_CELL_AND_SEARCH = 4e-6


@dataclass(frozen=True, eq=False)
class FinishedRepositioning:
    """A finished repositioning.

    anchors: as they stood. answer: what was found, ready for JSON. point_m: (m, 3) places of the antenna along the
    path. good: (m, 2) uint8, 1 where the goal holds, before and after.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: RepositioningParameters
    calculation: Calculation
    point_m: Floats
    good: npt.NDArray[np.uint8]
    answer: dict[str, Any]

    def summary(self) -> dict[str, Any]:
        """What reposition.json says: plain values, ready for JSON, every number with its unit in its name."""
        asked, calculation = self.parameters, self.calculation
        return {
            "version": calculation.version,
            "mode": asked.mode,
            "error_statement": calculation.error_statement,
            "curvature": calculation.curvature,
            "unknown": asked.unknown,
            "dem": dem_summary(self.grid),
            "warnings": list(calculation.warnings),
            "parameters": asked.model_dump(mode="json", exclude_none=True),
            **self.answer,
            "timing": {"calculation_s": calculation.elapsed_s},
        }


@told_as_asked
def check_repositioning_request(grid: ElevationGrid, parameters: RepositioningParameters) -> int:
    """Refuse what makes no question; how many anchors there are. Raises PlacementError, FrameError, AnchorError."""
    path_targets(grid, _path(grid, parameters), parameters.receiver_above_ground_m)
    goal_of(parameters.goal)
    rules_of(grid, parameters.rules)
    check_anchors(grid, [resolve_anchor(grid, anchor) for anchor in parameters.anchors])
    return len(parameters.anchors)


def refuse_repositioning(grid: ElevationGrid, parameters: RepositioningParameters, settings: Settings) -> None:
    """Raises LimitError where so many stretches over so many cells would take too long."""
    cells, stretches = grid.heights_m.size, 1.0
    if parameters.stretch_m is not None:
        stretches = max(1.0, _length_m(_path(grid, parameters)) / parameters.stretch_m)
    per_cell_s = SWEEPS_PER_STRETCH * SECONDS_PER_CELL_AND_SWEEP + len(parameters.anchors) * SECONDS_PER_CELL_AND_SEARCH
    seconds = cells * stretches * per_cell_s
    if seconds > settings.max_job_s:
        raise LimitError(
            f"{stretches:,.0f} stretches over {cells:,} cells would take about {seconds:,.3g} s, more than the limit "
            f"of {settings.max_job_s:g} s; take longer stretches, a shorter max_flight_m or a smaller DEM",
            limit_name="max_job_s",
            limit=settings.max_job_s,
            given=seconds,
        )


@told_as_asked
def calculate_repositioning(
    grid: ElevationGrid, parameters: RepositioningParameters, progress: Callable[[float], None] | None = None
) -> FinishedRepositioning:
    """Who moves where; progress is called with the finished share 0..1.

    Raises PlacementError, FrameError, AnchorError.
    """
    started_s = time.perf_counter()
    anchors = tuple(resolve_anchor(grid, anchor) for anchor in parameters.anchors)
    warnings = check_anchors(grid, anchors)
    path_m, goal, sight = _path(grid, parameters), goal_of(parameters.goal), sight_of(parameters)
    asked: dict[str, Any] = {
        "occluded": parameters.occluded,
        "movable": parameters.movable,
        "share": parameters.share,
        "above_ground_m": parameters.heights_above_ground_m,
        "receiver_above_ground_m": parameters.receiver_above_ground_m,
        "cheapest": parameters.cheapest,
        "flight": _flight(parameters),
        "rules": rules_of(grid, parameters.rules),
        "sight": sight,
    }
    if parameters.stretch_m is None:
        found = _as_plan(reposition(grid, anchors, path_m, goal, **asked), anchors, path_m, parameters)
    else:
        asked |= {"stretch_m": parameters.stretch_m, "rover_m_per_s": parameters.rover_m_per_s, "progress": progress}
        found = leapfrog(grid, anchors, path_m, goal, **asked)
    start = [anchor for anchor in anchors if anchor.id not in parameters.occluded]
    parts = [
        path_targets(grid, path_between(path_m, one.from_m, one.to_m), parameters.receiver_above_ground_m)
        for one in found.stretches
    ]
    good = [
        np.column_stack([good_along(grid, part, who, goal, sight) for who in (start, stretch.counted)])
        for part, stretch in zip(parts, found.stretches, strict=True)
    ]
    told = (*told_of_areas(grid, areas_of_rules(parameters.rules)), *mission_warnings("repositioning", grid))
    calculation = Calculation(
        ERROR_STATEMENT,
        (curvature_of(parameters) or Curvature.of(grid)).sentence(),
        (*grid.provenance.warnings, *warnings, *told),
        time.perf_counter() - started_s,
        importlib.metadata.version("sightline"),
    )
    return FinishedRepositioning(
        grid=grid,
        anchors=anchors,
        parameters=parameters,
        calculation=calculation,
        point_m=np.concatenate([part.point_m for part in parts]),
        good=np.concatenate(good).astype(np.uint8),
        answer=_answer(grid, parameters, found),
    )


def _path(grid: ElevationGrid, parameters: RepositioningParameters) -> Floats:
    """(n, 2) the path ahead in the grid's frame."""
    if parameters.path is not None:
        return places_in_grid(grid, parameters.path)
    rover = parameters.rover
    assert rover is not None, "the schema has seen to it"
    east_m, north_m = places_in_grid(grid, [rover.place])[0]
    return straight_ahead(float(east_m), float(north_m), math.radians(rover.heading_deg), rover.ahead_m)


def _length_m(path_m: Floats) -> float:
    return float(np.hypot(*np.diff(path_m, axis=0).T).sum())


def _flight(parameters: RepositioningParameters) -> Flight:
    asked = parameters.flight
    longest_m = math.inf if asked.max_flight_m is None else asked.max_flight_m
    return Flight(asked.speed_m_per_s, asked.climb_m_per_s, asked.descent_m_per_s, asked.clearance_m, longest_m)


def _as_plan(
    found: Repositioning, anchors: tuple[Anchor, ...], path_m: Floats, parameters: RepositioningParameters
) -> Leapfrog:
    """One move at once, as a plan of a single stretch for which the rover does not wait."""
    length_m = _length_m(path_m)
    moved = () if found.move is None else (TimedMove(found.move, 0.0, found.move.flight_s, 0),)
    after = found.anchors_after(anchors)
    hidden = set(parameters.occluded) - {timed.move.anchor.id for timed in moved}
    counted = tuple(anchor for anchor in after if anchor.id not in hidden)
    arrive_s = length_m / parameters.rover_m_per_s
    only = StretchPlan(0.0, length_m, 0.0, arrive_s, 0.0, after, counted, found.before, found.after)
    return Leapfrog((only,), moved)


def _answer(grid: ElevationGrid, parameters: RepositioningParameters, found: Leapfrog) -> dict[str, Any]:
    """What was found, ready for JSON."""
    return {
        "goal": goal_of(parameters.goal).sentence(),
        "occluded": list(parameters.occluded),
        "before_share": found.share_unmoved,
        "after_share": found.share,
        "restored": all(stretch.value >= parameters.share - 1e-9 for stretch in found.stretches),
        "sentence": _sentence(found),
        "moves": [
            {
                "anchor_id": timed.move.anchor.id,
                "from": place_of(grid, timed.move.anchor),
                "to": place_of(grid, timed.move.to),
                "flight_m": timed.move.flight_m,
                "flight_s": timed.move.flight_s,
                "start_s": timed.start_s,
                "end_s": timed.end_s,
                "stretch": timed.stretch,
            }
            for timed in found.moves
        ],
        "anchors": [place_of(grid, anchor) for anchor in found.stretches[-1].anchors],
        "stretches": [
            {
                "from_m": stretch.from_m,
                "to_m": stretch.to_m,
                "depart_s": stretch.depart_s,
                "arrive_s": stretch.arrive_s,
                "waited_s": stretch.waited_s,
                "before_share": stretch.unmoved,
                "after_share": stretch.value,
            }
            for stretch in found.stretches
        ],
        "flight_m": found.flight_m,
        "waited_s": found.waited_s,
    }


def _sentence(found: Leapfrog) -> str:
    gained = f"{found.share_unmoved:.1%} of the path before, {found.share:.1%} after"
    if not found.moves:
        why = (
            "nothing has to" if found.share_unmoved >= 1.0 - 1e-9 else "no move of one drone that is needed gives more"
        )
        return f"Nobody moves, since {why}: {gained}."
    if len(found.stretches) == 1 and len(found.moves) == 1:
        move = found.moves[0].move
        return (
            f"{move.anchor.id} flies {move.flight_m:.0f} m in {move.flight_s:.0f} s to {move.to.east_m:.0f}, "
            f"{move.to.north_m:.0f} at {move.to.altitude_m:.0f} m: {gained}."
        )
    return (
        f"{len(found.moves)} moves, {found.flight_m / 1000:.1f} km of flight, and the rover waits "
        f"{found.waited_s:.0f} s: {gained}."
    )
