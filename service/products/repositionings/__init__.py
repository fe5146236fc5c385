"""Repositionings as a product: which drone moves where while a mission runs."""

from __future__ import annotations

from collections.abc import Iterator

from planning.placement import Goal, MoveQuestion, path_length_m, path_targets, reposition, straight_ahead
from service.estimates import Demand, sight_lines
from service.parts.sentences import told_as_asked
from service.parts.shapes_in_grid import anchors_in_grid
from service.products import Given, Needs, Product, WarmUp
from service.products.placements.question import goal_of, rules_of
from terrain import ElevationGrid
from visibility import Anchor
from visibility.sight import check_anchors

from .calculate import FinishedRepositioning, RepositioningSummary, calculate_repositioning, path_ahead
from .files import LAYERS
from .request import REQUEST, RepositioningIn, RepositioningParameters

__all__ = ["REPOSITIONING"]

SWEEPS_PER_STRETCH = 24
SECONDS_PER_CELL_AND_SWEEP = 40e-9
SECONDS_PER_CELL_AND_SEARCH = 4e-6


def _estimate(grid: ElevationGrid, parameters: RepositioningParameters) -> Iterator[Demand]:
    cells, anchors = grid.heights_m.size, len(parameters.anchors)
    yield from sight_lines(cells, anchors, parameters.mode)
    _check_question(grid, parameters)
    stretches = 1.0
    if parameters.stretch_m is not None:
        stretches = max(1.0, path_length_m(path_ahead(grid, parameters)) / parameters.stretch_m)
    per_cell_s = SWEEPS_PER_STRETCH * SECONDS_PER_CELL_AND_SWEEP + anchors * SECONDS_PER_CELL_AND_SEARCH
    seconds = cells * stretches * per_cell_s
    what = f"{stretches:,.0f} stretches over {cells:,} cells would take about {seconds:,.3g} s,"
    yield Demand("max_job_s", seconds, what, "; take longer stretches, a shorter max_flight_m or a smaller DEM")


@told_as_asked
def _check_question(grid: ElevationGrid, parameters: RepositioningParameters) -> None:
    """Raises PlacementError, FrameError, AnchorError for what makes no question."""
    path_targets(grid, path_ahead(grid, parameters), parameters.receiver_above_ground_m)
    goal_of(parameters.goal)
    rules_of(grid, parameters.rules)
    check_anchors(grid, anchors_in_grid(grid, parameters))


def _ahead(grid: ElevationGrid) -> None:
    ahead = straight_ahead(101.0, -100.0, 1.0, 60.0)
    reposition(grid, [Anchor("F", 101.0, -77.0, 60.0)], ahead, MoveQuestion(Goal("dop"), above_ground_m=[30.0]))


def _needs(asked: RepositioningIn) -> Needs | None:
    if asked.detector_id is None:
        return None
    return Needs(detector_id=asked.detector_id, persistent_s=asked.persistent_s)


def _complete(asked: RepositioningIn, given: Given) -> RepositioningParameters:
    """What is asked, with the anchors that a detector session finds occluded, as far as they are among the anchors."""
    ids = {anchor.id for anchor in asked.anchors}
    lasting = [one for one in given.occluded if one in ids]
    fields = asked.model_dump(exclude={"dem_id", "detector_id", "persistent_s"}, exclude_unset=True)
    return RepositioningParameters.model_validate(
        {**fields, "occluded": list(dict.fromkeys((*asked.occluded, *lasting)))}
    )


REPOSITIONING = Product(
    name="repositioning",
    title="repositioning",
    plural="repositionings",
    model="Repositioning",
    tag="Repositionings",
    summary="Which drone moves where while a mission runs.",
    about="Which drone moves where, the cheapest way to restore what shall hold ahead; with stretch_m along a "
    "long path.",
    asked=RepositioningIn,
    parameters=RepositioningParameters,
    answer=RepositioningSummary,
    example=REQUEST,
    estimate=_estimate,
    warm_up=(WarmUp(_ahead),),
    calculate=calculate_repositioning,
    layers=LAYERS,
    finished=FinishedRepositioning,
    arrays=("point_m", "good"),
    needs=_needs,
    complete=_complete,
    problems=(410,),
)
