"""Visibility maps: ask for one, follow its calculation, download its layers."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse, JSONResponse

from service.errors import LimitError, NotFoundError
from service.http.context import Service, ServiceDep
from service.http.documented import LOCATION, problem_responses
from service.http.files import file_answer
from service.http.jobs import after_waiting, finished, path_of, state_of
from service.http.prefer import WaitDep
from service.jobs.records import JobKind, JobRecord
from service.layers import LAYERS as LAYERS_OF
from service.schemas.pages import Limit, Offset
from service.schemas.visibility_map_answers import (
    LayerLink,
    VisibilityMapIn,
    VisibilityMapList,
    VisibilityMapOut,
    VisibilityMapSummary,
)

__all__ = ["router"]

router = APIRouter(prefix="/visibility-maps", tags=["Visibility maps"])
KIND = JobKind.VISIBILITY_MAP
LAYERS = LAYERS_OF[KIND]


@router.post(
    "",
    status_code=201,
    summary="Ask for a visibility map",
    responses={
        201: {"description": "Calculated within the wait.", "headers": LOCATION},
        202: {"description": "Taken in; follow Location.", "headers": LOCATION, "model": VisibilityMapOut},
        **problem_responses(400, 404, 413, 415, 422, 503, 507),
    },
)
async def ask_for_visibility_map(
    asked: VisibilityMapIn, request: Request, response: Response, service: ServiceDep, wait_s: WaitDep
) -> VisibilityMapOut:
    """Which anchors are seen from where, and from which altitude on, over a whole DEM."""
    _refuse_too_many(len(asked.anchors), service)
    parameters = asked.model_dump(mode="json", exclude={"dem_id"}, exclude_none=True)
    await service.supervisor.in_store(service.store.dem, asked.dem_id)
    await service.supervisor.ask("check-map", {"product": KIND, "dem_id": asked.dem_id, "parameters": parameters})
    job = await service.supervisor.submit(KIND, asked.dem_id, {"parameters": parameters})
    return _answer(service, await after_waiting(request, response, service, job, wait_s))


@router.get("", summary="List visibility maps", responses=problem_responses(422))
async def list_visibility_maps(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> VisibilityMapList:
    """Visibility maps, newest first."""
    jobs, total = await service.supervisor.in_store(service.store.jobs, KIND, limit, offset)
    return VisibilityMapList(
        visibility_maps=[_answer(service, job) for job in jobs], total=total, limit=limit, offset=offset
    )


@router.get("/{map_id}", summary="Follow a visibility map", responses=problem_responses(404))
async def get_visibility_map(map_id: str, service: ServiceDep) -> VisibilityMapOut:
    """How its calculation stands, its result, and links to its layers."""
    return _answer(service, await service.supervisor.in_store(service.store.job, KIND, map_id))


@router.delete(
    "/{map_id}",
    status_code=204,
    summary="Cancel or delete a visibility map",
    responses={
        200: {"description": "It was waiting or running and is cancelled now.", "model": VisibilityMapOut},
        204: {"description": "It was over; it and its files are gone."},
        **problem_responses(404),
    },
)
async def delete_visibility_map(map_id: str, service: ServiceDep) -> Response:
    """A map that waits or runs is cancelled and stays as `cancelled`; a finished one is deleted with its files."""
    cancelled = await service.supervisor.remove(KIND, map_id)
    if cancelled is None:
        return Response(status_code=204)
    return JSONResponse(_answer(service, cancelled).model_dump(mode="json"))


@router.head("/{map_id}/layers/{layer}", include_in_schema=False)
@router.get(
    "/{map_id}/layers/{layer}",
    summary="Download a layer",
    response_class=FileResponse,
    responses={
        200: {
            "description": "The file.",
            "content": {
                layer.media_type: {"schema": {"type": "string", "format": "binary"}} for layer in LAYERS.values()
            },
            "headers": {"ETag": {"description": "Changes when the file does.", "schema": {"type": "string"}}},
        },
        304: {"description": "You have it already (If-None-Match)."},
        **problem_responses(404, 409, 422, 503, 507),
    },
)
async def download_layer(map_id: str, layer: str, request: Request, service: ServiceDep) -> Response:
    """A file of the map. It is written when it is first asked for; ranges and If-None-Match are understood."""
    job = await finished(service, KIND, map_id)
    if layer not in LAYERS:
        raise NotFoundError("layer", layer)
    assert job.digest is not None
    path = await service.drawings.layer(job.digest, layer)
    return await file_answer(request, path, LAYERS[layer].media_type, f"{job.digest}-{layer}")


def _refuse_too_many(anchors: int, service: Service) -> None:
    if anchors > service.settings.max_anchors:
        raise LimitError(
            f"{anchors} anchors are more than the limit of {service.settings.max_anchors} in one request",
            limit_name="max_anchors",
            limit=service.settings.max_anchors,
            given=anchors,
        )


def _answer(service: Service, job: JobRecord) -> VisibilityMapOut:
    layers = [
        LayerLink(
            name=layer.name,
            href=f"{path_of(job)}/layers/{layer.name}",
            media_type=layer.media_type,
            description=layer.description,
        )
        for layer in LAYERS.values()
    ]
    told: dict[str, Any] = state_of(service, job)
    return VisibilityMapOut(
        **told,
        request={"dem_id": job.dem_id, **job.request["parameters"]},
        result=None if job.summary is None else VisibilityMapSummary.model_validate(job.summary),
        layers=layers if job.summary is not None else [],
    )
