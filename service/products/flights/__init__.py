"""Flights through the air above a morphing map as a product."""

from __future__ import annotations

from service.errors import RequestError
from service.estimates import refuse_budget, refuse_map
from service.parts.sentences import on_morphing_map
from service.products import Given, Needs, Product
from service.settings import Settings
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


def _check(grid: ElevationGrid, asked: FlightParameters, settings: Settings) -> None:
    cells, above = grid.heights_m.size, asked.morphing_map
    refuse_map(cells, check_flight_request(grid, asked), asked.mode, settings)
    refuse_budget(asked.budget.seconds, settings)
    if above is not None:
        refuse_map(cells, len(above.anchors), above.mode, settings)


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
    check=_check,
    calculate=calculate_flight,
    layers=LAYERS,
    finished=FinishedFlight,
    arrays=("corners_m", "air"),
    needs=_needs,
    complete=_complete,
    searches=True,
)
