"""Placements: ask where anchors should be, follow the calculation, download maps, plans and tables."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of
from service.http.context import ServiceDep
from service.http.map_routes import MapResource, add_shared_routes, add_stop_route, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.parts.map_answers import MapOut
from service.products.placements.answer import PlacementIn, PlacementList, PlacementOut

__all__ = ["router"]

router = APIRouter(prefix="/placements", tags=["Placements"])
PLACEMENTS = MapResource(JobKind.PLACEMENT, "placement", "placements", PlacementOut, PlacementList)


@router.post(
    "",
    status_code=201,
    summary="Ask for a placement",
    response_model=PlacementOut,
    responses=responses_of_asking(PLACEMENTS),
    openapi_extra=body_of(PlacementIn),
)
async def ask_for_placement(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """Where anchors should be put, so that as much as possible of the ground or of a path sees enough of them."""
    return await ask_for_map(PLACEMENTS, request, response, service, wait_s)


add_shared_routes(router, PLACEMENTS)
add_stop_route(router, PLACEMENTS)
