"""Morphing maps: ask for one, follow its calculation, download its layers."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of
from service.http.context import ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.parts.map_answers import MapOut
from service.parts.positioning_answers import MorphingMapIn, MorphingMapList, MorphingMapOut

__all__ = ["router"]

router = APIRouter(prefix="/morphing-maps", tags=["Morphing maps"])
MAPS = MapResource(JobKind.MORPHING_MAP, "morphing map", "morphing_maps", MorphingMapOut, MorphingMapList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a morphing map",
    response_model=MorphingMapOut,
    responses=responses_of_asking(MAPS),
    openapi_extra=body_of(MorphingMapIn),
)
async def ask_for_morphing_map(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """Above which altitude positioning is good enough up to a ceiling, over a whole DEM."""
    return await ask_for_map(MAPS, request, response, service, wait_s)


add_shared_routes(router, MAPS)
