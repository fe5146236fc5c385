"""The routes that maps of every kind share: asking, listing, following, deleting, downloading layers."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any

from fastapi import APIRouter, Request, Response
from fastapi.responses import FileResponse, JSONResponse

from service.errors import NotFoundError
from service.jobs.records import JobKind, JobRecord
from service.layers import LAYERS, Layer
from service.schemas.map_answers import LayerLink, MapOut
from service.schemas.pages import Limit, Offset, Page
from service.schemas.satellites import ORBIT_TEXTS

from .bodies import json_body
from .context import Service, ServiceDep
from .documented import LOCATION, problem_responses
from .files import file_answer
from .jobs import after_waiting, finished, path_of, state_of

__all__ = ["Find", "MapResource", "add_shared_routes", "add_stop_route", "ask_for_map", "responses_of_asking"]

Find = Callable[[Mapping[str, Any], Service], Awaitable[Mapping[str, Any]]]


@dataclass(frozen=True, slots=True)
class MapResource:
    """A kind of map as a resource. name: as in "DOP map"; listed: the page whose field ``plural`` holds the maps."""

    kind: JobKind
    name: str
    plural: str
    out: type[MapOut]
    listed: type[Page]

    @property
    def operation(self) -> str:
        """The name in operation ids."""
        return self.plural.removesuffix("s")


def responses_of_asking(resource: MapResource) -> dict[int | str, dict[str, Any]]:
    """What POST documents."""
    return {
        201: {"description": "Calculated within the wait.", "headers": LOCATION},
        202: {"description": "Taken in; follow Location.", "headers": LOCATION, "model": resource.out},
        **problem_responses(400, 404, 413, 415, 422, 503, 507),
    }


async def ask_for_map(
    resource: MapResource,
    request: Request,
    response: Response,
    service: Service,
    wait_s: float | None,
    find: Find | None = None,
) -> MapOut:
    """Have the body read and checked in a worker, take the job in, and wait as long as the client wants.

    find: what the service knows besides, by the fields of the body that tell of it.
    """
    check = {"product": resource.kind, "body": await json_body(request)}
    asked = await service.checks.ask("check-map", check)
    if find is not None and "needed" in asked:
        found = await find(asked["needed"], service)
        asked = await service.checks.ask("check-map", {**check, "found": found})
    job = await service.supervisor.submit(resource.kind, asked["dem_id"], {"parameters": asked["parameters"]})
    return _answer(resource, service, await after_waiting(request, response, service, job, wait_s))


def add_shared_routes(router: APIRouter, resource: MapResource) -> None:
    """Add everything but POST, whose body differs from kind to kind."""
    kind, name, layers = resource.kind, resource.name, LAYERS[resource.kind]
    one, many = resource.operation, resource.plural

    @router.get(
        "",
        name=f"list_{many}",
        summary=f"List {name}s",
        description=f"{name[0].upper()}{name[1:]}s, newest first.",
        response_model=resource.listed,
        responses=problem_responses(422),
    )
    async def list_maps(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> Response:
        jobs, total = await service.supervisor.in_store(service.store.jobs, kind, limit, offset)
        page = Page(total=total, limit=limit, offset=offset).model_dump_json().removesuffix("}")
        # what was asked may be long, and there may be many: written one by one, beside whoever else is answered
        maps = await asyncio.to_thread(lambda: ",".join(_as_json(_answer(resource, service, job)) for job in jobs))
        return Response(f'{page},"{many}":[{maps}]}}', media_type="application/json")

    @router.get(
        "/{map_id}",
        name=f"get_{one}",
        summary=f"Follow a {name}",
        description="How its calculation stands, its result, and links to its layers.",
        response_model=resource.out,
        responses=problem_responses(404),
    )
    async def get_map(map_id: str, service: ServiceDep) -> MapOut:
        return _answer(resource, service, await service.supervisor.in_store(service.store.job, kind, map_id))

    @router.delete(
        "/{map_id}",
        status_code=204,
        name=f"delete_{one}",
        summary=f"Cancel or delete a {name}",
        description="A map that waits or runs is cancelled and stays as `cancelled`; a finished one is deleted with "
        "its files.",
        responses={
            200: {"description": "It was waiting or running and is cancelled now.", "model": resource.out},
            204: {"description": "It was over; it and its files are gone."},
            **problem_responses(404),
        },
    )
    async def delete_map(map_id: str, service: ServiceDep) -> Response:
        cancelled = await service.supervisor.remove(kind, map_id)
        if cancelled is None:
            return Response(status_code=204)
        return JSONResponse(_answer(resource, service, cancelled).model_dump(mode="json"))

    @router.get(
        "/{map_id}/layers/{layer}",
        name=f"download_{one}_layer",
        summary=f"Download a layer of a {name}",
        description="A file of the map. It is written when it is first asked for; ranges and If-None-Match are "
        "understood.",
        response_class=FileResponse,
        responses={
            200: {
                "description": "The file.",
                "content": {
                    layer.media_type: {"schema": {"type": "string", "format": "binary"}} for layer in layers.values()
                },
                "headers": {"ETag": {"description": "Changes when the file does.", "schema": {"type": "string"}}},
            },
            304: {"description": "You have it already (If-None-Match)."},
            **problem_responses(404, 409, 416, 422, 503, 507),
        },
    )
    async def download_layer(map_id: str, layer: str, request: Request, service: ServiceDep) -> Response:
        job = await finished(service, kind, map_id)
        if layer not in layers or not _has(job, layers[layer]):
            raise NotFoundError("layer", layer)
        assert job.digest is not None
        path = await service.drawings.layer(job.digest, layer)
        return await file_answer(request, path, layers[layer].media_type, f"{job.digest}-{layer}")


def add_stop_route(router: APIRouter, resource: MapResource) -> None:
    """Add the request that ends a search with the best that it has so far."""

    @router.post(
        "/{map_id}/stop",
        status_code=202,
        name=f"stop_{resource.operation}",
        summary=f"End a {resource.name} early",
        description="The best that was found so far becomes the result, which says so; follow it until it is over.",
        response_model=resource.out,
        responses={202: {"description": "It was told.", "headers": LOCATION}, **problem_responses(404, 409)},
    )
    async def stop_map(map_id: str, response: Response, service: ServiceDep) -> MapOut:
        job = await service.supervisor.finish_early(resource.kind, map_id)
        response.headers["Location"] = path_of(job)
        return _answer(resource, service, job)


def _has(job: JobRecord, layer: Layer) -> bool:
    return layer.is_of(job.request["parameters"]) and layer.is_in(job.summary or {})


def _answer(resource: MapResource, service: Service, job: JobRecord) -> MapOut:
    layers = [
        LayerLink(
            name=layer.name,
            href=f"{path_of(job)}/layers/{layer.name}",
            media_type=layer.media_type,
            description=layer.description,
        )
        for layer in LAYERS[resource.kind].values()
        if _has(job, layer)
    ]
    told: dict[str, Any] = state_of(service, job)
    return resource.out.model_validate(
        {
            **told,
            "request": {"dem_id": job.dem_id, **_without_orbits(job.request["parameters"])},
            "result": job.summary,
            "layers": layers if job.summary is not None else [],
        }
    )


def _as_json(answer: MapOut) -> str:
    return answer.model_dump_json(by_alias=True)


def _without_orbits(parameters: dict[str, Any]) -> dict[str, Any]:
    """What was asked, without the text of satellites' orbits, which is long and the client's own."""
    satellites = parameters.get("satellites")
    if satellites is None:
        return parameters
    kept = {name: value for name, value in satellites.items() if name not in ORBIT_TEXTS}
    return {**parameters, "satellites": kept}
