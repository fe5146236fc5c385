"""Paths on which the anchors stay in sight as a product."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from functools import partial

import numpy as np

from planning import PathError
from planning.alternatives import prepare_replanning
from planning.paths import PathLimits, PathProblem, PlanBudget, RoverModel, plan_path
from service.estimates import Demand, budget, sight_lines
from service.parts.sentences import MAP_KINDS, with_map
from service.products import Given, Needs, Product, WarmUp
from service.products.in_common import signals_demand
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import AnchorTrack

from .answer import FinishedPath, PathSummary
from .calculate import calculate_path
from .files import LAYERS
from .question import check_path_request
from .request import REQUEST, PathIn, PathParameters, PathQuestion

__all__ = ["PATH"]


def _needs(asked: PathIn) -> Needs | None:
    return None if asked.map_id is None else Needs(map_id=asked.map_id, map_kinds=MAP_KINDS)


def _complete(asked: PathQuestion, given: Given) -> PathParameters:
    """Raises RequestError, ValidationError."""
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if given.map_kind is not None:
        fields = with_map(fields, given.map_kind, given.map_parameters)
    return PathParameters.model_validate(fields)


def _estimate(grid: ElevationGrid, asked: PathParameters) -> Iterator[Demand]:
    cells, on = grid.heights_m.size, asked.morphing_map
    yield from sight_lines(cells, len(asked.anchors), asked.mode)
    yield from sight_lines(cells, check_path_request(grid, asked), asked.mode)
    yield from signals_demand(grid, asked, len(asked.anchors) + len(asked.tracks), one_height=True)
    # departures are tried first, for as long at most
    yield budget(asked.budget.seconds * (1.0 if asked.leave_by_s is None else 2.0))
    if on is not None:
        yield from sight_lines(cells, len(on.anchors), on.mode)
        yield from signals_demand(grid, on)


def _on_the_grid(grid: ElevationGrid) -> None:
    anchors = tuple(Anchor(f"A{n}", 60.0 * n, -50.0 * n, 90.0 + n) for n in range(4))
    rover = RoverModel(max_slope_rad=1.2, max_step_m=80.0)
    plan = partial(PathProblem, budget=PlanBudget(sampling=False))
    for dop_limit, goal in ((1e6, (60.0, -225.0)), (1e6, (210.0, -225.0)), (0.1, (60.0, -225.0))):
        limits = PathLimits(min_anchors=0, dop_limit=dop_limit)
        with contextlib.suppress(PathError):
            plan_path(plan(grid, (60.0, -50.0), goal, rover=rover, anchors=anchors, limits=limits))
    standing = plan(grid, (60.0, -50.0), (60.0, -225.0), rover=rover, anchors=anchors)
    prepare_replanning(standing).plan_from((210.0, -225.0), anew=False)
    cliff_m = np.zeros((12, 10), np.float32)
    cliff_m[6:] = 900.0
    plan_path(plan(ElevationGrid(cliff_m, 30.0, 25.0), (60.0, -50.0), (60.0, -225.0)))
    track = AnchorTrack("T", np.array([0.0, 900.0]), np.array([[60.0, -50.0, 90.0], [90.0, -50.0, 90.0]]))
    plan_path(plan(grid, (60.0, -50.0), (60.0, -225.0), anchors=(track,)))


def _sampled(grid: ElevationGrid) -> None:
    plan = partial(PathProblem, grid, (60.0, -50.0), (60.0, -225.0), budget=PlanBudget(iterations=200))
    plan_path(plan())
    plan_path(plan(rover=RoverModel(min_turning_radius_m=5.0)))


PATH = Product(
    name="path",
    title="path",
    plural="paths",
    model="Path",
    tag="Paths",
    summary="Which way a rover should go so that the anchors stay in sight.",
    about="A path for a rover that keeps every limit, or what blocks every path and the least that would open one.",
    asked=PathIn,
    parameters=PathParameters,
    answer=PathSummary,
    example=REQUEST,
    estimate=_estimate,
    warm_up=(WarmUp(_on_the_grid), WarmUp(_sampled, own_processes=True)),
    calculate=calculate_path,
    layers=LAYERS,
    finished=FinishedPath,
    arrays=("vertices", "visible", "corners", "dop", "count", "reasons"),
    needs=_needs,
    complete=_complete,
    searches=True,
)
