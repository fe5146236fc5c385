"""Anchor placement as the service answers it: chosen places, how good they are, maps before and after."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from planning.placement import (
    Cluster,
    Placement,
    PlacementGeometry,
    check_placement,
    feasible_candidates,
    hover_sensitivity,
    place_anchors,
    placement_geometry,
)
from planning.placement.placing import require_enough, require_sight
from service.errors import RequestError
from service.files.missions import above_sea_level, mission_warnings
from service.parts.areas_without_posts import areas_of_placement, told_of_areas
from service.parts.asked_frame import told_as_asked
from service.parts.map_facts import Calculation, curvature_of, dem_summary
from service.products.placements.question import placement_question
from service.products.placements.request import PlacementParameters
from terrain import ElevationGrid, height_at
from visibility import Anchor, check_anchors, dop_map, min_visible_altitude

__all__ = ["FinishedPlacement", "calculate_placement", "check_placement_request", "cluster_of", "place_of"]

HOVER_M = 10.0
SHARE_OF_SEARCH = 0.9


@dataclass(frozen=True, eq=False)
class FinishedPlacement:
    """A finished placement; arrays (rows, cols).

    anchors: those that were there before. answer: what was found, ready for JSON; ``chosen`` reads its anchors.
    count_before, count_after: uint8, anchors surely in sight. dop_before, dop_after: float32, +inf = no fix, NaN =
    unknown. is_target: uint8, 1 where a post counts.
    """

    grid: ElevationGrid
    anchors: tuple[Anchor, ...]
    parameters: PlacementParameters
    calculation: Calculation
    count_before: npt.NDArray[np.uint8]
    count_after: npt.NDArray[np.uint8]
    dop_before: npt.NDArray[np.float32]
    dop_after: npt.NDArray[np.float32]
    is_target: npt.NDArray[np.uint8]
    answer: dict[str, Any]

    @property
    def chosen(self) -> tuple[Anchor, ...]:
        """The anchors that were placed."""
        return tuple(
            Anchor(
                one["id"],
                one["east_m"],
                one["north_m"],
                one["altitude_m"],
                ranging_sigma_m=self.parameters.goal.ranging_sigma_m,
            )
            for one in self.answer["placed"]
        )

    def summary(self) -> dict[str, Any]:
        """What place.json says: plain values, ready for JSON, every number with its unit in its name."""
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
            "timing": {"calculation_s": calculation.elapsed_s, **self.answer["timing"]},
        }


@told_as_asked
def check_placement_request(grid: ElevationGrid, parameters: PlacementParameters) -> int:
    """Refuse what cannot be placed; how many candidates keep the cheap rules.

    Raises PlacementError, NoCandidateError, RequestError, FrameError, AnchorError.
    """
    question = placement_question(grid, parameters)
    if question.fixed:
        check_anchors(grid, question.fixed)
    # links take sight lines: that is for the calculation itself
    rules = replace(question.rules, link=None)
    feasible = feasible_candidates(grid, question.candidates, rules, question.targets)
    require_enough(parameters.count or 1, feasible)
    require_sight(parameters.count, len(question.fixed), question.goal)
    return len(feasible.candidates)


@told_as_asked
def calculate_placement(
    grid: ElevationGrid,
    parameters: PlacementParameters,
    progress: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
    scheduler: str | None = None,
) -> FinishedPlacement:
    """The placement that the parameters ask for on this grid; progress is called with the finished share 0..1.

    stop: once it says True, the best so far is the answer. scheduler: address of the Dask scheduler that the request
    may ask for. Raises PlacementError, ClusterError, RequestError, FrameError, AnchorError.
    """
    started_s = time.perf_counter()
    question = placement_question(grid, parameters)
    deadline_s = math.inf if parameters.time_limit_s is None else started_s + parameters.time_limit_s
    placement = place_anchors(
        grid,
        question.candidates,
        question.targets,
        parameters.count,
        question.goal,
        question.rules,
        reach=parameters.reach,
        fixed=question.fixed,
        sight=question.sight,
        options=question.options,
        progress=None if progress is None else lambda share: progress(SHARE_OF_SEARCH * share),
        cluster=cluster_of(parameters, scheduler),
        stop=lambda: time.perf_counter() > deadline_s or (stop is not None and stop()),
    )
    maps, error_statement, curvature = _maps(grid, placement, parameters)
    geometry = placement_geometry(grid, placement)
    answer = _answer(grid, placement, geometry)
    if progress is not None:
        progress(1.0)
    more = () if geometry.warning is None else (geometry.warning,)
    warnings = (*grid.provenance.warnings, *placement.warnings, *more, *_told(grid, parameters, answer))
    calculation = Calculation(error_statement, curvature, warnings, time.perf_counter() - started_s, placement.version)
    return FinishedPlacement(
        grid=grid, anchors=question.fixed, parameters=parameters, calculation=calculation, answer=answer, **maps
    )


def _told(grid: ElevationGrid, asked: PlacementParameters, answer: dict[str, Any]) -> tuple[str, ...]:
    """What to know about the question's areas and the answer's files."""
    told = (*told_of_areas(grid, areas_of_placement(asked)), *mission_warnings("placement", grid))
    nowhere = [one["id"] for one in answer["placed"] if one["above_ground_m"] is None and one["what"] != "mast"]
    if nowhere and not above_sea_level(grid):
        told += (f"No plan is written for {', '.join(nowhere)}: how high the ground below is, is not known.",)
    return told


def cluster_of(parameters: PlacementParameters, scheduler: str | None) -> Cluster | None:
    """The cluster that the request asks for, None for this machine. Raises RequestError where there is none."""
    if parameters.run_on == "here":
        return None
    if scheduler is None:
        raise RequestError(
            f"run_on {parameters.run_on!r} needs a Dask scheduler, and none is set: the service takes its address from "
            "SIGHTLINE_DASK_SCHEDULER, the command line from --scheduler."
        )
    return Cluster(scheduler, or_local=parameters.run_on == "cluster_or_here")


def _maps(
    grid: ElevationGrid, placement: Placement, parameters: PlacementParameters
) -> tuple[dict[str, Any], str, str]:
    """(arrays by name, error statement, curvature in words)."""
    is_target = np.zeros(grid.shape, np.uint8)
    targets, goal = placement.targets, placement.goal
    post = targets.post
    if post is None:
        row = np.rint((grid.origin_north_m - targets.point_m[:, 1]) / grid.cell_north_m).astype(np.intp)
        col = np.rint((targets.point_m[:, 0] - grid.origin_east_m) / grid.cell_east_m).astype(np.intp)
        post = row * grid.cols + col
    is_target.reshape(-1)[post] = 1
    arrays: dict[str, Any] = {"is_target": is_target}
    error_statement = curvature = ""
    for name, anchors in (("before", placement.fixed), ("after", (*placement.fixed, *placement.anchors))):
        count, dop = np.zeros(grid.shape, np.uint8), np.full(grid.shape, np.inf, np.float32)
        dop[np.isnan(grid.heights_m)] = np.nan
        if anchors:
            lines = min_visible_altitude(
                grid, anchors, parameters.mode, curvature_of(parameters), unknown=parameters.unknown
            )
            found = dop_map(
                lines, targets.above_ground_m, goal.kind, measure=goal.dilution, on_surface=goal.on_surface
            )
            count, dop = found.count.astype(np.uint8), found.dop
            error_statement, curvature = lines.error_statement, lines.curvature.sentence()
        arrays |= {f"count_{name}": count, f"dop_{name}": dop}
    return arrays, error_statement, curvature


def _answer(grid: ElevationGrid, placement: Placement, geometry: PlacementGeometry) -> dict[str, Any]:
    """What was found, ready for JSON."""
    check = check_placement(grid, placement)
    hover = hover_sensitivity(grid, placement, HOVER_M)
    goal = placement.goal
    unit = "share" if goal.is_share else "m"
    return {
        "objective": goal.objective,
        "goal": goal.sentence(),
        "placed": [
            {
                **place_of(grid, anchor),
                "what": what,
                f"marginal_{unit}": float(gain),
                f"after_loss_{unit}": check.after_loss[anchor.id],
            }
            for anchor, gain, what in zip(placement.anchors, placement.marginal, _whats(placement), strict=True)
        ],
        "fixed": [place_of(grid, anchor) for anchor in placement.fixed],
        f"before_{unit}": placement.before,
        f"value_{unit}": placement.value,
        f"bound_{unit}": placement.bound,
        f"gap_{unit}": placement.gap,
        f"greedy_{unit}": placement.greedy_value,
        f"exact_{unit}": check.value,
        f"least_after_loss_{unit}": check.least_after_loss,
        "dilution": {
            "measure": goal.dilution,
            "median": geometry.median if math.isfinite(geometry.median) else None,
            "within_limit_share": geometry.within_limit,
            "no_fix_share": geometry.no_fix,
            "useless_share": geometry.useless,
        },
        "fewest_possible": placement.needed,
        "method": placement.method,
        "proved": placement.proved,
        "stopped": placement.stopped,
        "statement": placement.statement,
        "targets": {
            "what": placement.targets.what,
            "points": len(placement.targets),
            "left_out": placement.targets.left_out,
            "within_limits_m": _metres_within(placement),
        },
        "candidates": {"left": len(placement.feasible.candidates), "removed": placement.feasible.removed},
        "hover": {
            "hover_m": hover.hover_m,
            f"mean_{unit}": hover.mean,
            f"worst_{unit}": hover.worst,
            f"lower_{unit}": hover.vertical_low,
            f"higher_{unit}": hover.vertical_high,
            "draws": hover.draws,
        },
        "timing": placement.timing_s,
    }


def _metres_within(placement: Placement) -> float | None:
    """Of a path: metres of it that reach the goal."""
    if placement.targets.what != "path" or not placement.goal.is_share:
        return None
    return placement.value * placement.targets.total


def _whats(placement: Placement) -> tuple[str, ...]:
    at = {
        int(number): what
        for number, what in zip(placement.feasible.number, placement.feasible.candidates.what, strict=True)
    }
    return tuple(at[int(number)] for number in placement.candidate)


def place_of(grid: ElevationGrid, anchor: Anchor) -> dict[str, Any]:
    """Where an anchor stands, ready for JSON."""
    ground_m = float(height_at(grid, anchor.east_m, anchor.north_m))
    return {
        "id": anchor.id,
        "east_m": anchor.east_m,
        "north_m": anchor.north_m,
        "altitude_m": anchor.altitude_m,
        "above_ground_m": None if math.isnan(ground_m) else anchor.altitude_m - ground_m,
    }
