"""What a planner's outcome and a validator's report say, ready for JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from planning.paths import Grain, Path, PathOutcome, PathProblem, Reason, Relaxation, Unreachable
from planning.validation import PathLimit, PathValidation

__all__ = ["VERTEX_COLUMNS", "outcome_answer", "time_words", "validation_answer", "vertex_table"]

# fields of a path, one number for each vertex
VERTEX_COLUMNS = (
    "east_m",
    "north_m",
    "altitude_m",
    "heading_rad",
    "distance_m",
    "time_s",
    "slope_rad",
    "pitch_rad",
    "roll_rad",
    "anchor_count",
    "dop",
    "margin_m",
    "clearance_m",
    "position_sigma_m",
    "bubble_radius_m",
)
ANGLES = {PathLimit.SLOPE, PathLimit.PITCH, PathLimit.ROLL, PathLimit.START_HEADING}


def vertex_table(path: Path | None) -> npt.NDArray[np.float64]:
    """(n, columns) the path's VERTEX_COLUMNS; no rows without a path."""
    if path is None:
        return np.zeros((0, len(VERTEX_COLUMNS)))
    return np.column_stack([np.asarray(getattr(path, name), np.float64) for name in VERTEX_COLUMNS])


def outcome_answer(problem: PathProblem, outcome: PathOutcome) -> dict[str, Any]:
    """The outcome of a plan; what is no finite number is None."""
    path = outcome.path
    return {
        "status": str(outcome.status),
        "sentence": outcome.sentence,
        "start": _place(problem.start),
        "goals": [_goal(goal) for goal in problem.goals],
        "way_points": [_place(place) for place in problem.way_points],
        "ranged_to": [str(getattr(anchor, "id", "")) for anchor in problem.anchors],
        "needed_in_sight": problem.limits.needed_in_sight,
        "totals": None if path is None else _totals(path),
        "cost": None if path is None else path.cost,
        "cost_split": None if path is None else dict(path.cost_split),
        "reference_cost": _number(outcome.reference_cost),
        "ratio": _number(outcome.ratio),
        "unreachable": None if outcome.unreachable is None else _unreachable(outcome.unreachable),
        "planner": outcome.planner,
        "stopped_by": outcome.stopped_by,
        "seed": outcome.seed,
        "timing": {"first_path_s": _number(outcome.first_path_s), "plan_s": outcome.elapsed_s},
    }


def validation_answer(validation: PathValidation) -> dict[str, Any]:
    """The validator's report, angles in degrees."""
    return {
        "passed": validation.passed,
        "sentence": validation.sentence,
        "step_m": validation.step_m,
        "samples": validation.samples,
        "checks": [
            {
                "limit": str(check.limit),
                "kept": check.kept,
                **_value("worst", check.worst, check.limit),
                **_value("allowed", check.allowed, check.limit),
                "broken": check.broken,
                "where": _place(check.where_m),
            }
            for check in validation.checks
        ],
    }


def time_words(seconds: float) -> str:
    """A time on the way as people say it."""
    if seconds < 120.0:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60:02d} min"


def _totals(path: Path) -> dict[str, Any]:
    totals = path.totals
    return {
        "length_m": totals.length_m,
        "climb_m": totals.climb_m,
        "descent_m": totals.descent_m,
        "time_s": totals.time_s,
        "out_of_sight_s": totals.out_of_sight_s,
        "longest_out_of_sight_s": totals.longest_out_of_sight_s,
        "worst_dop": _number(totals.worst_dop),
        "fewest_anchors": totals.fewest_anchors,
        "mean_position_sigma_m": _number(totals.mean_position_sigma_m),
        "steepest_deg": math.degrees(totals.steepest_rad),
        "vertices": len(path.east_m),
    }


UNITS = {Reason.SLOPE: "deg", Reason.PITCH_OR_ROLL: "deg", Reason.STEP: "m"}


def _limits(one: Relaxation) -> dict[str, Any]:
    """What a relaxation asks and needs, and what is too little, in the unit of the limit, angles in degrees."""
    unit = UNITS.get(one.reason, "")
    factor = math.degrees(1.0) if unit == "deg" else 1.0
    numbers = {name: _number(getattr(one, name) * factor) for name in ("asked", "needed", "least")}
    return {**numbers, "unit": unit}


def _grain(grain: Grain) -> dict[str, float]:
    return {"width_m": grain.width_m, "slope_deg": math.degrees(grain.slope_rad)}


def _unreachable(found: Unreachable) -> dict[str, Any]:
    return {
        "reason": str(found.reason),
        "where": _place(found.where_m),
        "relaxations": [
            {
                "reason": str(one.reason),
                **_limits(one),
                "sentence": one.sentence,
                "shown": one.shown,
            }
            for one in found.relaxations
        ],
        "grain": None if found.grain is None else _grain(found.grain),
    }


def _value(name: str, value: float, limit: PathLimit) -> dict[str, float | None]:
    return {f"{name}_deg": _number(math.degrees(value))} if limit in ANGLES else {name: _number(value)}


def _place(place_m: tuple[float, float]) -> dict[str, float]:
    return {"east_m": place_m[0], "north_m": place_m[1]}


def _goal(goal: Any) -> dict[str, Any]:
    if isinstance(goal, shapely.Geometry):
        return {"area_m2": float(goal.area), **_place((goal.centroid.x, goal.centroid.y))}
    return _place(goal)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
