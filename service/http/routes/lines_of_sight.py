"""Lines of sight: pairs of points in, clearance and verdict of each out."""

from __future__ import annotations

import uuid
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse, JSONResponse

from service.errors import NotFoundError
from service.http.bodies import body_of, long_body
from service.http.context import Service, ServiceDep
from service.http.documented import LOCATION, problem_responses
from service.http.files import file_answer
from service.http.jobs import after_waiting, finished, path_of, state_of
from service.http.prefer import WaitDep
from service.http.spliced import spliced_answer
from service.jobs.records import JobKind, JobRecord
from service.schemas.lines_of_sight import (
    LinesOfSightIn,
    LinesOfSightList,
    LinesOfSightOut,
    LinesOfSightState,
)
from service.schemas.pages import Limit, Offset

__all__ = ["router"]

router = APIRouter(prefix="/lines-of-sight", tags=["Lines of sight"])
KIND = JobKind.LINES_OF_SIGHT
FILES = {"lines.json": "application/json", "lines.npz": "application/x-npz"}


@router.post(
    "",
    status_code=201,
    response_model=None,
    summary="Ask for lines of sight",
    responses={
        201: {"description": "Calculated within the wait.", "headers": LOCATION, "model": LinesOfSightOut},
        202: {"description": "Taken in; follow Location.", "headers": LOCATION, "model": LinesOfSightOut},
        **problem_responses(400, 404, 413, 415, 422, 503, 507),
    },
    openapi_extra=body_of(LinesOfSightIn),
)
async def ask_for_lines_of_sight(
    request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> Response:
    """Clearance, verdict and blocking point of many straight lines at once; exact on the triangulated surface."""
    token = uuid.uuid4().hex
    async with long_body(request, service) as (body, big):
        asked = await service.checks.ask("check-lines-of-sight", body, token, big=big)
    job = await service.supervisor.submit(
        KIND,
        asked["dem_id"],
        {"options": asked["options"], "pairs": asked["pairs"]},
        inputs=service.folder.work(token),
    )
    job = await after_waiting(request, response, service, job, wait_s)
    return _with_lines(service, job, response.status_code or 201, dict(response.headers))


@router.get("", summary="List lines of sight", responses=problem_responses(422))
async def list_lines_of_sight(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> LinesOfSightList:
    """Calculations of lines of sight, newest first, without their lines."""
    jobs, total = await service.supervisor.in_store(service.store.jobs, KIND, limit, offset)
    return LinesOfSightList(
        lines_of_sight=[_state(service, job) for job in jobs], total=total, limit=limit, offset=offset
    )


@router.get(
    "/{lines_id}",
    response_model=None,
    summary="Follow lines of sight",
    responses={
        200: {"description": "The state, and the lines when done.", "model": LinesOfSightOut},
        **problem_responses(404),
    },
)
async def get_lines_of_sight(lines_id: str, service: ServiceDep) -> Response:
    """How the calculation stands, and every line once it is done."""
    job = await service.supervisor.in_store(service.store.job, KIND, lines_id)
    return _with_lines(service, job, 200, {})


@router.delete(
    "/{lines_id}",
    status_code=204,
    summary="Cancel or delete lines of sight",
    responses={
        200: {"description": "It was waiting or running and is cancelled now.", "model": LinesOfSightState},
        204: {"description": "It was over; it and its files are gone."},
        **problem_responses(404),
    },
)
async def delete_lines_of_sight(lines_id: str, service: ServiceDep) -> Response:
    """Lines that wait or run are cancelled and stay as `cancelled`; finished ones are deleted with their files."""
    cancelled = await service.supervisor.remove(KIND, lines_id)
    if cancelled is None:
        return Response(status_code=204)
    return JSONResponse(_state(service, cancelled).model_dump(mode="json"))


@router.get(
    "/{lines_id}/files/{name}",
    summary="Download lines of sight",
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
async def download_lines(lines_id: str, name: str, request: Request, service: ServiceDep) -> Response:
    """lines.json: the lines alone; lines.npz: the same as arrays for numpy, NaN and infinities included."""
    job = await finished(service, KIND, lines_id)
    if name not in FILES:
        raise NotFoundError("file", name)
    assert job.digest is not None
    path = service.folder.result(job.digest) / name
    return await file_answer(request, path, FILES[name], f"{job.digest}-{name}")


def _state(service: Service, job: JobRecord) -> LinesOfSightState:
    told: dict[str, Any] = state_of(service, job)
    return LinesOfSightState.model_validate(
        {
            **told,
            "request": {"dem_id": job.dem_id, "pairs": job.request["pairs"], **job.request["options"]},
            "result": job.summary,
            "files": [] if job.summary is None else [f"{path_of(job)}/files/{name}" for name in FILES],
        }
    )


def _with_lines(service: Service, job: JobRecord, status: int, headers: dict[str, str]) -> Response:
    path = None if job.digest is None else service.folder.result(job.digest) / "lines.json"
    return spliced_answer(_state(service, job), "lines", path, status, headers)
