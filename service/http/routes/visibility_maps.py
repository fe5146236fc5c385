"""Visibility maps: ask for one, follow its calculation, download its layers."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of
from service.http.context import ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.parts.map_answers import MapOut
from service.products.visibility.answer import VisibilityMapIn, VisibilityMapList, VisibilityMapOut

__all__ = ["router"]

router = APIRouter(prefix="/visibility-maps", tags=["Visibility maps"])
MAPS = MapResource(JobKind.VISIBILITY_MAP, "visibility map", "visibility_maps", VisibilityMapOut, VisibilityMapList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a visibility map",
    response_model=VisibilityMapOut,
    responses=responses_of_asking(MAPS),
    openapi_extra=body_of(VisibilityMapIn),
)
async def ask_for_visibility_map(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """Which anchors are seen from where, and from which altitude on, over a whole DEM."""
    return await ask_for_map(MAPS, request, response, service, wait_s)


add_shared_routes(router, MAPS)
