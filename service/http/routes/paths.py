"""Paths: ask for one, follow the planning, download it as GeoJSON, GPX, mission, table and pictures."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from pydantic import ValidationError

from service.errors import NotFoundError, NotReadyError, NotValidError, RequestError
from service.http.context import Service, ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, add_stop_route, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind, JobRecord, JobStatus
from service.maps_for_paths import MAP_KINDS, with_map
from service.schemas import sentence_of
from service.schemas.map_answers import MapOut
from service.schemas.path_answers import PathIn, PathList, PathOut
from service.schemas.paths import PathParameters

__all__ = ["router"]

router = APIRouter(prefix="/paths", tags=["Paths"])
PATHS = MapResource(JobKind.PATH, "path", "paths", PathOut, PathList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a path",
    response_model=PathOut,
    responses=responses_of_asking(PATHS),
)
async def ask_for_path(
    asked: PathIn, request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> MapOut:
    """A path for a rover that keeps every limit, or what blocks every path and the least that would open one."""
    parameters = await _parameters(asked, service)
    return await ask_for_map(PATHS, parameters, asked.dem_id, request, response, service, wait_s)


add_shared_routes(router, PATHS)
add_stop_route(router, PATHS)


async def _parameters(asked: PathIn, service: Service) -> PathParameters:
    """What is asked, with what its map gives. Raises NotFoundError, NotReadyError, RequestError, NotValidError."""
    fields = asked.model_dump(mode="json", exclude={"dem_id", "map_id"}, exclude_unset=True, exclude_none=True)
    if asked.map_id is not None:
        on = await service.supervisor.in_store(_map_of, service, asked.map_id)
        if on.dem_id != asked.dem_id:
            raise RequestError(f"The {on.kind} {on.id} is of another DEM, {on.dem_id}.")
        fields = with_map(fields, on.kind, on.request["parameters"])
    try:
        return PathParameters.model_validate(fields)
    except ValidationError as error:
        raise NotValidError(sentence_of(error)) from error


def _map_of(service: Service, map_id: str) -> JobRecord:
    for kind in MAP_KINDS:
        try:
            job = service.store.job(JobKind(kind), map_id)
        except NotFoundError:
            continue
        if job.status is not JobStatus.SUCCEEDED:
            raise NotReadyError(f"The {kind} {map_id} is {job.status}, so no path can be planned on it.")
        return job
    raise NotFoundError("map", map_id)
