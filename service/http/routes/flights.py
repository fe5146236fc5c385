"""Flights: ask for one through the air above a morphing map, follow the planning, download mission and pictures."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.errors import NotReadyError, RequestError
from service.http.context import Service, ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, add_stop_route, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind, JobStatus
from service.schemas.flights import FlightIn, FlightList, FlightOut, FlightParameters
from service.schemas.map_answers import MapOut

__all__ = ["router"]

router = APIRouter(prefix="/flights", tags=["Flights"])
FLIGHTS = MapResource(JobKind.FLIGHT, "flight", "flights", FlightOut, FlightList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a flight",
    response_model=FlightOut,
    responses=responses_of_asking(FLIGHTS),
)
async def ask_for_flight(
    asked: FlightIn, request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> MapOut:
    """A flight for a drone above the morphing map, below the ceiling and a safety bubble away from the ground."""
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if asked.map_id is not None:
        fields["morphing_map"] = await service.supervisor.in_store(_asked_of_map, service, asked.map_id, asked.dem_id)
    parameters = FlightParameters.model_validate(fields)
    return await ask_for_map(FLIGHTS, parameters, asked.dem_id, request, response, service, wait_s)


add_shared_routes(router, FLIGHTS)
add_stop_route(router, FLIGHTS)


def _asked_of_map(service: Service, map_id: str, dem_id: str) -> object:
    """What a finished morphing map was asked for. Raises NotFoundError, NotReadyError, RequestError."""
    job = service.store.job(JobKind.MORPHING_MAP, map_id)
    if job.status is not JobStatus.SUCCEEDED:
        raise NotReadyError(f"The morphing map {map_id} is {job.status}, so no flight can be planned above it.")
    if job.dem_id != dem_id:
        raise RequestError(f"The morphing map {map_id} is of another DEM, {job.dem_id}.")
    asked = job.request["parameters"]
    if asked.get("frames") is not None:
        raise RequestError(f"The morphing map {map_id} has frames; a flight is planned above one without.")
    return asked
