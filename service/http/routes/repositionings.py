"""Repositionings: ask who shall move where, follow the calculation, download moves, plans and the picture."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.context import ServiceDep
from service.http.documented import problem_responses
from service.http.map_routes import MapResource, add_shared_routes, ask_for_map, responses_of_asking
from service.http.prefer import WaitDep
from service.jobs.records import JobKind
from service.schemas.map_answers import MapOut
from service.schemas.repositioning_answers import RepositioningIn, RepositioningList, RepositioningOut
from service.schemas.repositionings import RepositioningParameters

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
)
async def ask_for_repositioning(
    asked: RepositioningIn, request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> MapOut:
    """Which drone moves where, the cheapest way to restore what shall hold ahead; with stretch_m along a long path."""
    occluded = list(asked.occluded)
    if asked.detector_id is not None:
        ids = {anchor.id for anchor in asked.anchors}
        found = service.detectors.get(asked.detector_id).occlusions.lasting(asked.persistent_s)
        occluded += [one for one in found if one in ids and one not in occluded]
    # the session may be gone when the job runs: what it says now is what was asked
    fields = asked.model_dump(exclude={"dem_id", "detector_id", "persistent_s"}, exclude_unset=True)
    parameters = RepositioningParameters.model_validate({**fields, "occluded": occluded})
    return await ask_for_map(REPOSITIONINGS, parameters, asked.dem_id, request, response, service, wait_s)


add_shared_routes(router, REPOSITIONINGS)
