"""DOP maps: ask for one, follow its calculation, download its layers."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of
from service.http.context import ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.parts.map_answers import MapOut
from service.parts.positioning_answers import DopMapIn, DopMapList, DopMapOut

__all__ = ["router"]

router = APIRouter(prefix="/dop-maps", tags=["DOP maps"])
MAPS = MapResource(JobKind.DOP_MAP, "DOP map", "dop_maps", DopMapOut, DopMapList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a DOP map",
    response_model=DopMapOut,
    responses=responses_of_asking(MAPS),
    openapi_extra=body_of(DopMapIn),
)
async def ask_for_dop_map(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """How good positioning is for a rover at one antenna height, and where it is not good enough."""
    return await ask_for_map(MAPS, request, response, service, wait_s)


add_shared_routes(router, MAPS)
