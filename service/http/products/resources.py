"""Products as resources: asking, listing, following, stopping, deleting and downloading are the same for all."""

from __future__ import annotations

import uuid
from collections.abc import Mapping, Sequence
from typing import Annotated, cast

from fastapi import APIRouter, Query, Request, Response

from service.errors import NotFoundError, NotReadyError, RequestError
from service.jobs.channel import BodyArguments, CheckArguments, Checked, GivenFields, NeedsFields
from service.jobs.records import JobRecord, JobStatus
from service.products import Product

from ..answers import list_model, list_name, out_name, state_name
from ..bodies import WaitDep, json_body, long_body
from ..context import Service, ServiceDep
from ..guard.routing import Router
from ..jobs import (
    EVENT,
    EVENT_STREAM,
    after_waiting,
    answer_of,
    events_of,
    path_of,
    request_answer,
    state_of,
    whole_answer,
)
from ..lists import TurnDep
from ..meta import LOCATION, answer_like, body_of, problem_responses
from .layers import add_layers, add_tiles

__all__ = ["product_router"]

JSON = "application/json"


def product_router(product: Product) -> APIRouter:
    """All routes of one product."""
    router = Router(prefix=product.path, tags=[product.tag])
    _add_asking(router, product)
    _add_following(router, product)
    add_layers(router, product, _singular(product), _article(product))
    add_tiles(router, product, _singular(product))
    _add_pins(router, product)
    if product.searches:
        _add_stop(router, product)
    return router


def _add_asking(router: APIRouter, product: Product) -> None:
    answers = {"headers": LOCATION, **answer_like(out_name(product))}

    @router.post(
        "",
        status_code=201,
        response_model=None,
        name=f"ask_for_{_singular(product)}",
        summary=f"Ask for {_article(product)}",
        description=product.about,
        responses={
            201: {"description": "Calculated within the wait.", **answers},
            202: {"description": "Taken in; follow Location.", **answers},
            **problem_responses(400, 404, 409, 413, 415, 422, 503, 507, *product.problems),
        },
        openapi_extra=body_of(product.asked),
    )
    async def ask(request: Request, response: Response, service: ServiceDep, wait_s: WaitDep) -> Response:
        token = uuid.uuid4().hex
        if product.long_body:
            async with long_body(request, service) as (body, big):
                checked = await _checked(service, product, body, token, big)
        else:
            checked = await _checked(service, product, {"body": await json_body(request)}, token, False)
        job = await service.supervisor.submit(
            product.name,
            checked["dem_id"],
            checked["request"],
            inputs=service.folder.work(token) if checked["request"].get("has_inputs") else None,
        )
        job = await after_waiting(request, response, service, job, wait_s)
        return whole_answer(service, product, job, response.status_code or 201, dict(response.headers))


async def _checked(service: Service, product: Product, body: BodyArguments, token: str, big: bool) -> Checked:
    """What a worker makes of a body: parameters that can be calculated. Raises what is wrong with it."""
    asked = CheckArguments(product=product.name, body=body)
    checked = cast(Checked, await service.checks.ask("check-request", asked, token, big=big))
    if "needs" in checked:
        asked["given"] = await _found(service, checked["needs"], checked["dem_id"])
        checked = cast(Checked, await service.checks.ask("check-request", asked, token, big=big))
    return checked


async def _found(service: Service, needs: NeedsFields, dem_id: str) -> GivenFields:
    """What a request refers to. Raises NotFoundError, GoneError, NotReadyError, RequestError."""
    given = GivenFields()
    if needs["map_id"] is not None:
        job = await service.supervisor.in_store(_map_of, service, needs["map_id"], needs["map_kinds"])
        if job.dem_id != dem_id:
            raise RequestError(f"The {service.products[job.kind].title} {job.id} is of another DEM, {job.dem_id}.")
        given["map_kind"], given["map_parameters"] = job.kind, job.request["parameters"]
    if needs["detector_id"] is not None:
        given["occluded"] = service.detectors.get(needs["detector_id"]).memory.occlusions.lasting(needs["persistent_s"])
    return given


def _map_of(service: Service, map_id: str, kinds: Sequence[str]) -> JobRecord:
    for kind in kinds:
        try:
            job = service.store.job(kind, map_id)
        except NotFoundError:
            continue
        if job.status is not JobStatus.SUCCEEDED:
            raise NotReadyError(
                f"The {service.products[kind].title} {map_id} is {job.status}, so nothing can be planned on it."
            )
        return job
    raise NotFoundError(kinds[0] if len(kinds) == 1 else "map", map_id)


def _add_following(router: APIRouter, product: Product) -> None:
    one, many, title = _singular(product), product.plural, product.title
    state = answer_like(state_name(product))

    @router.get(
        "",
        name=f"list_{many}",
        summary=f"List {product.tag[0].lower()}{product.tag[1:]}" if product.inline else f"List {title}s",
        description=f"{product.tag}, newest first, without what was asked and what came out. `next` leads to the page "
        "after.",
        response_model=None,
        responses={200: {"description": "The page.", **answer_like(list_name(product))}, **problem_responses(422)},
    )
    async def list_all(service: ServiceDep, turn: TurnDep) -> Response:
        asked = (product.name, turn.limit + 1, turn.offset, turn.after)
        jobs, total = await service.look_up(service.store.jobs, *asked)
        following = turn.cursor([job.place for job in jobs])
        entries = {many: [state_of(service, job) for job in jobs[: turn.limit]]}
        page = list_model(product).model_construct(
            None, total=total, limit=turn.limit, offset=turn.offset, next=following, **entries
        )
        return Response(page.model_dump_json(), media_type=JSON)

    @router.get(
        "/{job_id}",
        name=f"get_{one}",
        response_model=None,
        summary=f"Follow {_article(product)}",
        description="How its calculation stands, its result, and links to its layers.",
        responses={
            200: {"description": "How it stands.", **answer_like(out_name(product))},
            **problem_responses(404),
        },
    )
    async def get_one(job_id: str, service: ServiceDep) -> Response:
        job = await service.supervisor.in_store(service.store.job, product.name, job_id)
        return whole_answer(service, product, job, 200, {})

    @router.get(
        "/{job_id}/request",
        name=f"get_{one}_request",
        response_model=None,
        summary=f"Read what {_article(product)} was asked",
        description="The whole of it, defaults filled in; buildings and all else that is long too.",
        responses={
            200: {"description": "A body for POST.", "content": {JSON: {"schema": {"type": "object"}}}},
            **problem_responses(404),
        },
    )
    async def get_request(job_id: str, service: ServiceDep) -> Response:
        return request_answer(await service.supervisor.in_store(service.store.job, product.name, job_id))

    @router.get(
        "/{job_id}/events",
        name=f"watch_{one}",
        response_model=None,
        summary=f"Watch {_article(product)}",
        description="Server-sent events: `progress` at once and at every change of `status` or `progress` (0..1), "
        "`over` at the end, each with the path of the resource in `self`. A comment every 15 s keeps the connection.",
        responses={
            200: {"description": "The events.", "content": {EVENT_STREAM: {"schema": EVENT}}},
            **problem_responses(404),
        },
    )
    async def watch(request: Request, job_id: str, service: ServiceDep) -> Response:
        job = await service.supervisor.in_store(service.store.job, product.name, job_id)
        if request.method == "HEAD":
            return Response(media_type=EVENT_STREAM)
        return events_of(service, job)

    @router.delete(
        "/{job_id}",
        status_code=204,
        name=f"delete_{one}",
        summary=f"Cancel or delete {_article(product)}",
        description="One that waits or runs is cancelled and stays as `cancelled`; a finished one is deleted with its "
        "files. Asked again, one that is cancelled is answered as it is, until it is to be forgotten.",
        responses={
            200: {"description": "It was waiting or running and is cancelled, now or before.", **state},
            204: {"description": "It was over; it and its files are gone."},
            **problem_responses(404, 422),
        },
    )
    async def delete_one(
        job_id: str,
        service: ServiceDep,
        forget: Annotated[bool, Query(description="Whether it is deleted also when it is, or was, cancelled.")] = False,
    ) -> Response:
        cancelled = await service.supervisor.remove(product.name, job_id, forget=forget)
        if cancelled is None:
            return Response(status_code=204)
        return _state(service, product, cancelled)


def _add_pins(router: APIRouter, product: Product) -> None:
    one = _singular(product)
    answers = {200: {"description": "How it stands.", **answer_like(state_name(product))}, **problem_responses(404)}

    async def pinned(service: Service, job_id: str, pin: bool) -> Response:
        retention = service.supervisor.retention
        return _state(service, product, await service.supervisor.in_store(retention.pin, product.name, job_id, pin))

    @router.put(
        "/{job_id}/pin",
        name=f"pin_{one}",
        summary=f"Keep {_article(product)} for good",
        description="The service's retention passes over it, until it is unpinned or deleted.",
        response_model=None,
        responses=answers,
    )
    async def pin_one(job_id: str, service: ServiceDep) -> Response:
        return await pinned(service, job_id, True)

    @router.delete(
        "/{job_id}/pin",
        name=f"unpin_{one}",
        summary=f"Keep {_article(product)} no longer than others",
        description="The service's retention counts for it again.",
        response_model=None,
        responses=answers,
    )
    async def unpin_one(job_id: str, service: ServiceDep) -> Response:
        return await pinned(service, job_id, False)


def _add_stop(router: APIRouter, product: Product) -> None:
    @router.post(
        "/{job_id}/stop",
        status_code=202,
        name=f"stop_{_singular(product)}",
        summary=f"End {_article(product)} early",
        description="The best that was found so far becomes the result, which says so; follow it until it is over.",
        response_model=None,
        responses={
            202: {"description": "It was told.", "headers": LOCATION, **answer_like(state_name(product))},
            **problem_responses(404, 409),
        },
    )
    async def stop_one(job_id: str, service: ServiceDep) -> Response:
        job = await service.supervisor.finish_early(product.name, job_id)
        return _state(service, product, job, 202, {"Location": path_of(service, job)})


def _state(
    service: Service, product: Product, job: JobRecord, status: int = 200, headers: Mapping[str, str] | None = None
) -> Response:
    return Response(answer_of(service, product, job).model_dump_json(), status, headers, JSON)


def _singular(product: Product) -> str:
    return product.plural if product.inline is not None else product.plural.removesuffix("s")


def _article(product: Product) -> str:
    return product.title if product.inline is not None else f"a {product.title}"
