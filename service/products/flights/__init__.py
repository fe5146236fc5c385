"""Flights through the air above a morphing map as a product."""

from __future__ import annotations

from collections.abc import Iterator

from planning.paths import FlightProblem, PlanBudget, plan_flight
from service.errors import RequestError
from service.estimates import Demand, budget, sight_lines
from service.parts.sentences import on_morphing_map
from service.products import Given, Needs, Product, WarmUp
from service.products.in_common import signals_demand
from terrain import ElevationGrid

from .calculate import FinishedFlight, FlightSummary, calculate_flight, check_flight_request
from .files import LAYERS
from .request import REQUEST, FlightIn, FlightParameters

__all__ = ["FLIGHT"]


def _needs(asked: FlightIn) -> Needs | None:
    return None if asked.map_id is None else Needs(map_id=asked.map_id, map_kinds=("morphing-map",))


def _complete(asked: FlightParameters, given: Given) -> FlightParameters:
    """Raises RequestError, ValidationError."""
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if given.map_kind is not None:
        if given.map_parameters.get("frames") is not None:
            raise RequestError("The morphing map has frames; a flight is planned above one without.")
        fields = on_morphing_map(fields, given.map_parameters)
    return FlightParameters.model_validate(fields)


def _estimate(grid: ElevationGrid, asked: FlightParameters) -> Iterator[Demand]:
    cells, above = grid.heights_m.size, asked.morphing_map
    yield from sight_lines(cells, check_flight_request(grid, asked), asked.mode)
    yield budget(asked.budget.seconds)
    if above is not None:
        yield from sight_lines(cells, len(above.anchors), above.mode)
        yield from signals_demand(grid, above)


def _sampled(grid: ElevationGrid) -> None:
    few = PlanBudget(iterations=200)
    plan_flight(FlightProblem(grid, (60.0, -50.0, 90.0), (60.0, -225.0, 90.0), budget=few))


FLIGHT = Product(
    name="flight",
    title="flight",
    plural="flights",
    model="Flight",
    tag="Flights",
    summary="Which way a drone should fly above a morphing map, clear of the ground.",
    about="A flight for a drone above the morphing map, below the ceiling and a safety bubble away from the ground.",
    asked=FlightIn,
    parameters=FlightParameters,
    answer=FlightSummary,
    example=REQUEST,
    estimate=_estimate,
    warm_up=(WarmUp(_sampled, own_processes=True),),
    calculate=calculate_flight,
    layers=LAYERS,
    finished=FinishedFlight,
    arrays=("corners_m", "air"),
    needs=_needs,
    complete=_complete,
    searches=True,
)
