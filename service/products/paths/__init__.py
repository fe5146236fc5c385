"""Paths on which the anchors stay in sight as a product."""

from __future__ import annotations

from service.estimates import refuse_budget, refuse_map
from service.parts.sentences import MAP_KINDS, with_map
from service.products import Given, Needs, Product
from service.settings import Settings
from terrain import ElevationGrid

from .answer import FinishedPath, PathSummary
from .calculate import calculate_path, check_path_request
from .files import LAYERS
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


def _check(grid: ElevationGrid, asked: PathParameters, settings: Settings) -> None:
    cells, on = grid.heights_m.size, asked.morphing_map
    refuse_map(cells, len(asked.anchors), asked.mode, settings)
    refuse_map(cells, check_path_request(grid, asked), asked.mode, settings)
    refuse_budget(asked.budget.seconds, settings)
    if on is not None:
        refuse_map(cells, len(on.anchors), on.mode, settings)


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
    check=_check,
    calculate=calculate_path,
    layers=LAYERS,
    finished=FinishedPath,
    arrays=("vertices", "visible", "corners", "dop", "count", "reasons"),
    needs=_needs,
    complete=_complete,
    searches=True,
)
