"""Placements as a product: where to put anchors."""

from __future__ import annotations

from dataclasses import replace

from planning.placement import feasible_candidates
from planning.placement.placing import require_enough, require_sight
from service.estimates import refuse_map, refuse_placement
from service.parts.sentences import told_as_asked
from service.products import Product
from service.settings import Settings
from terrain import ElevationGrid
from visibility.sight import check_anchors

from .calculate import FinishedPlacement, calculate_placement, cluster_of
from .files import LAYERS
from .question import PlacementSummary, placement_question
from .request import REQUEST, PlacementIn, PlacementParameters

__all__ = ["PLACEMENT"]


def _check(grid: ElevationGrid, parameters: PlacementParameters, settings: Settings) -> None:
    cluster_of(parameters, settings.dask_scheduler)
    cells = grid.heights_m.size
    refuse_map(cells, len(parameters.anchors), parameters.mode, settings)
    refuse_placement(cells, _candidates_left(grid, parameters), parameters.mode, settings)


@told_as_asked
def _candidates_left(grid: ElevationGrid, parameters: PlacementParameters) -> int:
    """How many candidates keep the cheap rules. Raises what makes the question one that has no answer."""
    question = placement_question(grid, parameters)
    if question.fixed:
        check_anchors(grid, question.fixed)
    # links take sight lines: that is for the calculation itself
    rules = replace(question.rules, link=None)
    feasible = feasible_candidates(grid, question.candidates, rules, question.targets)
    require_enough(parameters.count or 1, feasible)
    require_sight(parameters.count, len(question.fixed), question.goal)
    return len(feasible.candidates)


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
    check=_check,
    calculate=calculate_placement,
    layers=LAYERS,
    finished=FinishedPlacement,
    arrays=("count_before", "count_after", "dop_before", "dop_after", "is_target"),
    searches=True,
)
