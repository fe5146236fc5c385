"""Safety bubbles: a path or a history of poses in; radius, clearance, margin and verdict of each point out."""

from __future__ import annotations

import uuid
from pathlib import Path
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse, JSONResponse

from service.bubble_files import BUBBLE_FILES, MEDIA_TYPES
from service.errors import NotFoundError
from service.http.bodies import body_of, long_body
from service.http.context import Service, ServiceDep
from service.http.documented import LOCATION, problem_responses
from service.http.files import file_answer
from service.http.jobs import after_waiting, finished, path_of, state_of
from service.http.prefer import WaitDep
from service.http.spliced import spliced_answer
from service.jobs.records import JobKind, JobRecord
from service.schemas.pages import Limit, Offset
from service.schemas.safety_bubble_answers import SafetyBubblesList, SafetyBubblesOut, SafetyBubblesState
from service.schemas.safety_bubbles import SafetyBubblesIn

__all__ = ["router"]

router = APIRouter(prefix="/safety-bubbles", tags=["Safety bubbles"])
KIND = JobKind.SAFETY_BUBBLES
FILES = {name: MEDIA_TYPES[Path(name).suffix] for name in BUBBLE_FILES}


@router.post(
    "",
    status_code=201,
    response_model=None,
    summary="Ask for safety bubbles",
    responses={
        201: {"description": "Calculated within the wait.", "headers": LOCATION, "model": SafetyBubblesOut},
        202: {"description": "Taken in; follow Location.", "headers": LOCATION, "model": SafetyBubblesOut},
        **problem_responses(400, 404, 413, 415, 422, 503, 507),
    },
    openapi_extra=body_of(SafetyBubblesIn),
)
async def ask_for_safety_bubbles(
    request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> Response:
    """Per point of a path, or of a history of poses: radius of the bubble, clearance to the ground, and the verdict."""
    token = uuid.uuid4().hex
    async with long_body(request, service) as (body, big):
        asked = await service.checks.ask("check-safety-bubbles", body, token, big=big)
    job = await service.supervisor.submit(
        KIND,
        asked["dem_id"],
        {"options": asked["options"], "points": asked["points"]},
        inputs=service.folder.work(token),
    )
    job = await after_waiting(request, response, service, job, wait_s)
    return _with_points(service, job, response.status_code or 201, dict(response.headers))


@router.get("", summary="List safety bubbles", responses=problem_responses(422))
async def list_safety_bubbles(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> SafetyBubblesList:
    """Safety bubbles, newest first, without their points."""
    jobs, total = await service.supervisor.in_store(service.store.jobs, KIND, limit, offset)
    return SafetyBubblesList(
        safety_bubbles=[_state(service, job) for job in jobs], total=total, limit=limit, offset=offset
    )


@router.get(
    "/{bubbles_id}",
    response_model=None,
    summary="Follow safety bubbles",
    responses={
        200: {"description": "The state, and the points when done.", "model": SafetyBubblesOut},
        **problem_responses(404),
    },
)
async def get_safety_bubbles(bubbles_id: str, service: ServiceDep) -> Response:
    """How the calculation stands, and every point once it is done."""
    job = await service.supervisor.in_store(service.store.job, KIND, bubbles_id)
    return _with_points(service, job, 200, {})


@router.delete(
    "/{bubbles_id}",
    status_code=204,
    summary="Cancel or delete safety bubbles",
    responses={
        200: {"description": "It was waiting or running and is cancelled now.", "model": SafetyBubblesState},
        204: {"description": "It was over; it and its files are gone."},
        **problem_responses(404),
    },
)
async def delete_safety_bubbles(bubbles_id: str, service: ServiceDep) -> Response:
    """What waits or runs is cancelled and stays as `cancelled`; finished bubbles are deleted with their files."""
    cancelled = await service.supervisor.remove(KIND, bubbles_id)
    if cancelled is None:
        return Response(status_code=204)
    return JSONResponse(_state(service, cancelled).model_dump(mode="json"))


@router.get(
    "/{bubbles_id}/files/{name}",
    summary="Download safety bubbles",
    response_class=FileResponse,
    responses={
        200: {
            "description": "The file.",
            "content": {
                media_type: {"schema": {"type": "string", "format": "binary"}} for media_type in FILES.values()
            },
        },
        304: {"description": "You have it already (If-None-Match)."},
        **problem_responses(404, 409, 416),
    },
)
async def download_bubbles(bubbles_id: str, name: str, request: Request, service: ServiceDep) -> Response:
    """Points as JSON, CSV, GeoJSON or arrays for numpy (with covariances); the pictures profile.png and map.png."""
    job = await finished(service, KIND, bubbles_id)
    if name not in FILES:
        raise NotFoundError("file", name)
    assert job.digest is not None
    path = service.folder.result(job.digest) / name
    return await file_answer(request, path, FILES[name], f"{job.digest}-{name}")


def _state(service: Service, job: JobRecord) -> SafetyBubblesState:
    told: dict[str, Any] = state_of(service, job)
    return SafetyBubblesState.model_validate(
        {
            **told,
            "request": {"dem_id": job.dem_id, **job.request["options"], "points": job.request["points"]},
            "result": job.summary,
            "files": [] if job.summary is None else [f"{path_of(job)}/files/{name}" for name in FILES],
        }
    )


def _with_points(service: Service, job: JobRecord, status: int, headers: dict[str, str]) -> Response:
    path = None if job.digest is None else service.folder.result(job.digest) / "points.json"
    return spliced_answer(_state(service, job), "points", path, status, headers)
