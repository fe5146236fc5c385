"""Probes: places and profiles, answered at once and kept nowhere."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.http.bodies import body_of, json_body
from service.http.context import Service, ServiceDep
from service.http.documented import problem_responses
from service.jobs.pool import Lane
from service.probes.answer import ProbeOut, ProfilesOut
from service.probes.request import ProbeIn, ProfilesIn

__all__ = ["router"]

router = APIRouter(tags=["Probes"])
PROBLEMS = problem_responses(400, 404, 413, 415, 422, 503)


@router.post(
    "/probe",
    summary="Probe places",
    response_model=None,
    responses={200: {"description": "The answer.", "model": ProbeOut}, **PROBLEMS},
    openapi_extra=body_of(ProbeIn),
)
async def probe_places(request: Request, service: ServiceDep) -> Response:
    """Ground, slope, who is in sight by how much, dilution and error at up to 100 places, without a job.

    Meant for a pointer over a map and for an autopilot: some milliseconds for 16 anchors, and nothing is kept.
    """
    return await _answered(service, "probe", await json_body(request))


@router.post(
    "/profiles",
    summary="See lines in profile",
    response_model=None,
    responses={200: {"description": "The answer.", "model": ProfilesOut}, **PROBLEMS},
    openapi_extra=body_of(ProfilesIn),
)
async def see_profiles(request: Request, service: ServiceDep) -> Response:
    """Ground, line, Fresnel zone and blocking point along up to 64 straight lines, without a job."""
    return await _answered(service, "profiles", await json_body(request))


async def _answered(service: Service, task: str, body: str) -> Response:
    found = await service.supervisor.ask(task, {"body": body}, lane=Lane.PROBES)
    return Response(found["json"], media_type="application/json")
