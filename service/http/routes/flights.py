"""Flights: ask for one through the air above a morphing map, follow the planning, download mission and pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response

from service.errors import NotReadyError
from service.http.bodies import body_of
from service.http.context import Service, ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, add_stop_route, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind, JobStatus
from service.parts.map_answers import MapOut
from service.products.flights.request import FlightIn, FlightList, FlightOut

__all__ = ["router"]

router = APIRouter(prefix="/flights", tags=["Flights"])
FLIGHTS = MapResource(JobKind.FLIGHT, "flight", "flights", FlightOut, FlightList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a flight",
    response_model=FlightOut,
    responses=responses_of_asking(FLIGHTS),
    openapi_extra=body_of(FlightIn),
)
async def ask_for_flight(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """A flight for a drone above the morphing map, below the ceiling and a safety bubble away from the ground."""
    return await ask_for_map(FLIGHTS, request, response, service, wait_s, _map_under)


add_shared_routes(router, FLIGHTS)
add_stop_route(router, FLIGHTS)


async def _map_under(needed: Mapping[str, Any], service: Service) -> dict[str, Any]:
    """The finished morphing map that the body names. Raises NotFoundError, NotReadyError."""
    on = await service.supervisor.in_store(service.store.job, JobKind.MORPHING_MAP, needed["map_id"])
    if on.status is not JobStatus.SUCCEEDED:
        raise NotReadyError(f"The morphing map {on.id} is {on.status}, so no flight can be planned above it.")
    return {"kind": "morphing map", "id": on.id, "dem_id": on.dem_id, "parameters": on.request["parameters"]}
