"""Repositionings: ask who shall move where, follow the calculation, download moves, plans and the picture."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of
from service.http.context import Service, ServiceDep
from service.http.documented import problem_responses
from service.http.map_routes import MapResource, add_shared_routes, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.parts.map_answers import MapOut
from service.products.repositionings.answer import RepositioningIn, RepositioningList, RepositioningOut

__all__ = ["router"]

router = APIRouter(prefix="/repositionings", tags=["Repositionings"])
REPOSITIONINGS = MapResource(
    JobKind.REPOSITIONING, "repositioning", "repositionings", RepositioningOut, RepositioningList
)


@router.post(
    "",
    status_code=201,
    summary="Ask for a repositioning",
    response_model=RepositioningOut,
    responses={**responses_of_asking(REPOSITIONINGS), **problem_responses(410)},
    openapi_extra=body_of(RepositioningIn),
)
async def ask_for_repositioning(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> MapOut:
    """Which drone moves where, the cheapest way to restore what shall hold ahead; with stretch_m along a long path."""
    return await ask_for_map(REPOSITIONINGS, request, response, service, wait_s, _occluded)


add_shared_routes(router, REPOSITIONINGS)


async def _occluded(needed: Mapping[str, Any], service: Service) -> dict[str, Any]:
    """Which anchors the detector that the body names finds occluded. Raises NotFoundError, GoneError."""
    # the session may be gone when the job runs: what it says now is what was asked
    occlusions = service.detectors.get(needed["detector_id"]).occlusions
    return {"occluded": occlusions.lasting(needed["persistent_s"])}
