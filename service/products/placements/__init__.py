"""Placements as a product: where to put anchors."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planning.placement import (
    Goal,
    PlacementRules,
    area_targets,
    candidate_grid,
    check_placement,
    feasible_candidates,
    path_targets,
    place_anchors,
)
from planning.placement.placing import require_enough, require_sight
from service.estimates import SECONDS_PER_CELL_AND_ANCHOR, Demand, calculation, sight_lines
from service.parts.sentences import told_as_asked
from service.products import Product, WarmUp
from service.products.in_common import signals_demand
from service.settings import Settings
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import check_anchors

from .answer import FinishedPlacement, PlacementSummary
from .calculate import calculate_placement, cluster_of
from .files import LAYERS
from .question import placement_question
from .request import REQUEST, PlacementIn, PlacementParameters

__all__ = ["PLACEMENT"]


# places, normals, weights and what each target has in sight
BYTES_PER_TARGET = 320


def _estimate(grid: ElevationGrid, parameters: PlacementParameters) -> Iterator[Demand]:
    """Surfaces are held for a few candidates at a time; what grows with both is one bit of sight for each pair."""
    cells = grid.heights_m.size
    yield from sight_lines(cells, len(parameters.anchors), parameters.mode)
    candidates = _candidates_left(grid, parameters)
    yield Demand("max_candidates", candidates, f"{candidates:,} candidates are")
    what, memory_bytes = f"{candidates:,} candidates over {cells:,} cells", cells * (BYTES_PER_TARGET + candidates // 4)
    seconds = cells * candidates * SECONDS_PER_CELL_AND_ANCHOR[parameters.mode]
    yield from calculation(what, memory_bytes, seconds, "fewer candidates, or a smaller DEM")
    yield from signals_demand(grid, parameters, candidates + len(parameters.anchors), one_height=True)


def _check(grid: ElevationGrid, parameters: PlacementParameters, settings: Settings) -> None:
    cluster_of(parameters, settings.dask_scheduler)


@told_as_asked
def _candidates_left(grid: ElevationGrid, parameters: PlacementParameters) -> int:
    """How many candidates keep the cheap rules. Raises what makes the question one that has no answer.

    Sites count as asked for: which they are, the calculation finds out.
    """
    question = placement_question(grid, parameters, propose=False)
    if question.fixed:
        check_anchors(grid, question.fixed)
    left = sum((some.best_sites or 0) * len(some.above_ground_m) for some in parameters.candidates)
    if left == 0:
        # links take sight lines: that is for the calculation itself
        rules = replace(question.rules, link=None)
        feasible = feasible_candidates(grid, question.candidates, rules, question.targets)
        require_enough(parameters.count or 1, feasible)
    require_sight(parameters.count, len(question.fixed), question.goal)
    return left + len(question.candidates) if left else len(feasible.candidates)


def _goals(grid: ElevationGrid) -> None:
    candidates = candidate_grid(grid, 110.0, above_ground_m=[30.0])
    fixed = Anchor("F", 101.0, -77.0, 60.0)
    weights = np.linspace(1.0, 2.0, grid.heights_m.size).reshape(grid.shape)
    rules = PlacementRules(max_range_m=1000.0)
    for goal, targets in (
        (Goal("coverage"), area_targets(grid, weight=weights)),
        (Goal("dop", spare=1), path_targets(grid, [(40.0, -40.0), (200.0, -200.0)])),
        (Goal(), area_targets(grid)),
    ):
        check_placement(grid, place_anchors(grid, candidates, targets, 4, goal, rules, fixed=[fixed]))


PLACEMENT = Product(
    name="placement",
    title="placement",
    plural="placements",
    model="Placement",
    tag="Placements",
    summary="Where to put anchors.",
    about="Where anchors should be put, so that as much as possible of the ground or of a path sees enough of them.",
    asked=PlacementIn,
    parameters=PlacementParameters,
    answer=PlacementSummary,
    example=REQUEST,
    estimate=_estimate,
    check=_check,
    warm_up=(WarmUp(_goals),),
    calculate=calculate_placement,
    layers=LAYERS,
    finished=FinishedPlacement,
    arrays=("count_before", "count_after", "dop_before", "dop_after", "is_target"),
    searches=True,
)
