"""Probes: places, profiles, previews, canopies out of logs, paths from elsewhere: answered at once, kept nowhere."""

from __future__ import annotations

import asyncio
import uuid

from fastapi import APIRouter, Request, Response

from service.files.canopy_fits import CanopyFitOut
from service.jobs.channel import BodyArguments, ReplanArguments
from service.jobs.pool import Lane
from service.probes.canopy_fits import CanopyFitIn
from service.probes.replans import ReplanIn, ReplanOut
from service.probes.request import PREVIEW_FILE, PreviewIn, ProbeIn, ProbeOut, ProfilesIn, ProfilesOut

from .bodies import json_body
from .context import Service, ServiceDep
from .jobs import finished
from .meta import body_of, problem_responses

__all__ = ["router"]

router = APIRouter(tags=["Probes"])
PROBLEMS = problem_responses(400, 404, 409, 413, 415, 422, 503)


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


@router.post(
    "/previews",
    summary="Preview a map",
    response_class=Response,
    responses={
        200: {
            "description": "A line of JSON, then the arrays.",
            "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
        },
        **PROBLEMS,
    },
    openapi_extra=body_of(PreviewIn),
)
async def preview_map(request: Request, service: ServiceDep) -> Response:
    """What anchors see, or what positioning by them is worth, over a whole DEM: no job, and nothing is kept.

    Meant for whoever moves an anchor and looks at the map meanwhile. The answer is a line of JSON (`names`, `rows`,
    `cols`, `mode`, `error_statement`, `curvature`, `warnings`) and then, for each name, an array of float32,
    little-endian, rows from the north: NaN unknown, +infinity at no altitude or no fix. Surfaces of anchors that
    the last preview had as well are not calculated again.
    """
    token = uuid.uuid4().hex
    work = service.folder.work(token)
    try:
        await service.supervisor.ask("preview", BodyArguments(body=await json_body(request)), token, Lane.PROBES)
        found = await asyncio.to_thread((work / PREVIEW_FILE).read_bytes)
    finally:
        await asyncio.to_thread(service.folder.remove, work)
    return Response(found, media_type="application/octet-stream")


@router.post(
    "/canopy-fits",
    summary="Fit a canopy",
    response_model=None,
    responses={200: {"description": "The answer.", "model": CanopyFitOut}, **PROBLEMS},
    openapi_extra=body_of(CanopyFitIn),
)
async def fit_canopy(request: Request, service: ServiceDep) -> Response:
    """How dense trees are, with its error, out of a log of signal strengths or C/N0: one number, or a map by direction.

    Nothing is kept. `canopy` of the answer is as the `cover` of any request takes it.
    """
    return await _answered(service, "fit-canopy", await json_body(request))


@router.post(
    "/paths/{job_id}/replans",
    name="replan_path",
    summary="Plan a path again from where the rover is",
    response_model=None,
    responses={
        200: {"description": "The answer.", "model": ReplanOut},
        **problem_responses(400, 404, 409, 413, 415, 422, 503),
    },
    openapi_extra=body_of(ReplanIn),
)
async def replan(job_id: str, request: Request, service: ServiceDep) -> Response:
    """The path from another start, all else as the path was asked: no job, and nothing is kept.

    Meant for a rover that left its path. The first plan of a path works out the costs from everywhere to the goals,
    which may take seconds; those after it take a fraction of one, until plans of another path are asked for. For
    anchors that stand, without way-points, and for a rover that turns on the spot.
    """
    body = await json_body(request)
    job = await finished(service, "path", job_id)
    arguments = ReplanArguments(parameters=job.request["parameters"], dem_id=job.dem_id, job_id=job.id, body=body)
    found = await service.supervisor.ask("replan", arguments, lane=Lane.PROBES)
    return Response(str(found["json"]), media_type="application/json")


async def _answered(service: Service, task: str, body: str) -> Response:
    found = await service.supervisor.ask(task, BodyArguments(body=body), lane=Lane.PROBES)
    return Response(str(found["json"]), media_type="application/json")
