"""A planned flight as the service answers it: the outcome, its corners, and the air along it."""

from __future__ import annotations

import importlib.metadata
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.paths import FlightOutcome, FlightProblem, PathStatus, PlanBudget, plan_flight
from planning.validation import FlightSamples, fly_along
from service.estimates import refuse_budget, refuse_map
from service.files.missions import mission_warnings
from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, dem_summary
from service.parts.positions import resolve_point
from service.parts.ranging_sources import check_sources, limit_of, ranging_sources, sight_lines
from service.products.flights.request import FlightParameters
from service.products.paths.answers import validation_answer
from service.settings import Settings
from terrain import ElevationGrid, height_at
from visibility import Anchor, DistantAnchor, MorphingMap, morphing_map
from visibility.air.morphing_maps import check_ceiling

__all__ = ["AIR_COLUMNS", "FinishedFlight", "calculate_flight", "check_flight_request", "refuse_flight"]

Floats = npt.NDArray[np.float64]
# what is known along a flight, at fine steps
AIR_COLUMNS = ("distance_m", "altitude_m", "ground_m", "floor_m", "top_m", "clearance_m")
SHARE_OF_MAP = 0.5


@dataclass(frozen=True, eq=False)
class FinishedFlight:
    """A finished plan, also one that found no flight.

    anchors: none, for the map brings its own. answer: the outcome, ready for JSON. corners_m: (m, 3) east, north,
    altitude. air: (n, columns) AIR_COLUMNS along the flight; both without rows where there is none.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor | DistantAnchor, ...]
    parameters: FlightParameters
    calculation: Calculation
    corners_m: Floats
    air: Floats
    answer: dict[str, Any]

    @property
    def found(self) -> bool:
        """Whether there is a flight."""
        return len(self.corners_m) > 0

    def column(self, name: str) -> Floats:
        """(n,) one of AIR_COLUMNS along the flight."""
        values: Floats = self.air[:, AIR_COLUMNS.index(name)]
        return values

    def summary(self) -> dict[str, Any]:
        """What flight.json says: plain values, ready for JSON, every number with its unit in its name."""
        asked, calculation = self.parameters, self.calculation
        above = asked if asked.morphing_map is None else asked.morphing_map
        return {
            "version": calculation.version,
            "mode": above.mode,
            "error_statement": calculation.error_statement,
            "curvature": calculation.curvature,
            "unknown": above.unknown,
            "dem": dem_summary(self.grid),
            "warnings": list(calculation.warnings),
            "parameters": asked.model_dump(mode="json", exclude_none=True),
            **self.answer,
            "timing": {"calculation_s": calculation.elapsed_s, **self.answer["timing"]},
        }


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


def refuse_flight(grid: ElevationGrid, asked: FlightParameters, settings: Settings) -> None:
    """Raises LimitError for a plan that may take longer than a job may run."""
    refuse_budget(asked.budget.seconds, settings)
    if asked.morphing_map is not None:
        refuse_map(grid.heights_m.size, len(asked.morphing_map.anchors), asked.morphing_map.mode, settings)


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
    above, error_statement, curvature = None, "", ""
    warnings: tuple[str, ...] = ()
    if asked.morphing_map is not None:
        lines, sources = sight_lines(grid, asked.morphing_map, progress, SHARE_OF_MAP)
        ceiling_m, above_ground = asked.morphing_map.ceiling()
        above = morphing_map(
            lines, limit_of(asked.morphing_map), ceiling_m=ceiling_m, ceiling_above_ground=above_ground
        )
        warnings = (*lines.warnings, *above.warnings, *sources.warnings)
        error_statement, curvature = lines.error_statement, lines.curvature.sentence()
    told(SHARE_OF_MAP)
    problem = _problem(grid, asked, above)
    outcome = plan_flight(problem, stop=stop)
    found = outcome.status is PathStatus.FOUND
    air = fly_along(problem, outcome.corners_m) if found else None
    told(1.0)
    told_of_files = mission_warnings("flight", grid) if found else ()
    return FinishedFlight(
        grid,
        (),
        asked,
        Calculation(
            error_statement,
            curvature,
            tuple(dict.fromkeys((*grid.provenance.warnings, *warnings, *told_of_files))),
            time.perf_counter() - started_s,
            importlib.metadata.version("sightline"),
        ),
        outcome.corners_m,
        _table(air),
        _answer(problem, asked, outcome, air),
    )


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


def _answer(
    problem: FlightProblem, asked: FlightParameters, outcome: FlightOutcome, air: FlightSamples | None
) -> dict[str, Any]:
    """The outcome, ready for JSON; what is no finite number is None."""
    names = ("east_m", "north_m", "altitude_m")
    corners_m = outcome.corners_m
    along_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners_m, axis=0), axis=1))])
    ground_m = height_at(problem.grid, corners_m[:, 0], corners_m[:, 1])
    return {
        "status": str(outcome.status),
        "sentence": outcome.sentence,
        "start": dict(zip(names, problem.start, strict=True)),
        "goal": dict(zip(names, problem.goal, strict=True)),
        "totals": None if air is None else _totals(problem, asked, air),
        "cost": _number(outcome.cost),
        "corners": [
            {
                **dict(zip(names, corner, strict=True)),
                "above_ground_m": _number(corner[2] - ground),
                "time_s": along / asked.speed_m_per_s,
            }
            for corner, ground, along in zip(corners_m.tolist(), ground_m.tolist(), along_m.tolist(), strict=False)
        ],
        "validation": None if outcome.validation is None else validation_answer(outcome.validation),
        "planner": outcome.planner,
        "stopped_by": outcome.stopped_by,
        "seed": outcome.seed,
        "timing": {"plan_s": outcome.elapsed_s},
    }


def _totals(problem: FlightProblem, asked: FlightParameters, air: FlightSamples) -> dict[str, float | None]:
    up_m, length_m = air.point_m[:, 2], float(air.distance_m[-1])
    rises_m = np.diff(up_m)
    return {
        "length_m": length_m,
        "climb_m": float(rises_m[rises_m > 0.0].sum()),
        "descent_m": abs(float(rises_m[rises_m < 0.0].sum())),
        "time_s": length_m / asked.speed_m_per_s,
        "highest_m": float(up_m.max()),
        "clearance_m": float(air.clearance_m.min()),
        "margin_m": None if problem.above is None else float((up_m - air.floor_m).min()),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
