"""Paths: ask for one, follow the planning, download it as GeoJSON, GPX, mission, table and pictures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response

from service.errors import NotFoundError, NotReadyError
from service.http.bodies import body_of
from service.http.context import Service, ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, add_stop_route, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind, JobRecord, JobStatus
from service.parts.map_answers import MapOut
from service.parts.maps_for_paths import MAP_KINDS
from service.products.paths.answer import PathIn, PathList, PathOut

__all__ = ["router"]

router = APIRouter(prefix="/paths", tags=["Paths"])
PATHS = MapResource(JobKind.PATH, "path", "paths", PathOut, PathList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a path",
    response_model=PathOut,
    responses=responses_of_asking(PATHS),
    openapi_extra=body_of(PathIn),
)
async def ask_for_path(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """A path for a rover that keeps every limit, or what blocks every path and the least that would open one."""
    return await ask_for_map(PATHS, request, response, service, wait_s, _map_under)


add_shared_routes(router, PATHS)
add_stop_route(router, PATHS)


async def _map_under(needed: Mapping[str, Any], service: Service) -> dict[str, Any]:
    """The finished map that the body names. Raises NotFoundError, NotReadyError."""
    on = await service.supervisor.in_store(_map_of, service, needed["map_id"])
    return {"kind": on.kind, "id": on.id, "dem_id": on.dem_id, "parameters": on.request["parameters"]}


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
