"""Jobs of every kind as answers: how one stands, waiting for it, its result and its finished files."""

from __future__ import annotations

import asyncio
import re
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import NoReturn

import orjson
from fastapi import Request, Response
from fastapi.responses import FileResponse, StreamingResponse
from pydantic import BaseModel, JsonValue
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import Message, Receive, Scope, Send

from service.access.callers import rooted
from service.errors import NotFoundError, NotReadyError, RangeError, StoppingError
from service.files.layer import Layer
from service.jobs.records import Failure, JobRecord, JobStatus
from service.parts.positioning import ORBIT_TEXTS
from service.products import Product

from .answers import JobOut, LayerLink, MapOut, moment, state_model
from .context import Service
from .problems import FailedJob, problem_of

__all__ = [
    "EVENT",
    "EVENT_STREAM",
    "RETRY_AFTER_S",
    "RangedFile",
    "after_waiting",
    "answer_of",
    "bytes_answer",
    "events_of",
    "file_answer",
    "finished",
    "has_layer",
    "path_of",
    "request_answer",
    "spliced_answer",
    "state_of",
    "whole_answer",
]

JSON = "application/json"
BLOCK_BYTES = 1024 * 1024
RETRY_AFTER_S = 1
# with digits alone: Python, by which the library goes, reads 1_0 as 10
RANGE = re.compile(r"[A-Za-z]+[ \t]*=[0-9 \t,-]*")
# a field of a request that is longer is not in every answer about its job
LONG_BYTES = 16 * 1024
GOES_ON = "The service is stopping; the job was taken in and goes on after its next start: follow Location then."
EVENT_STREAM = "text/event-stream"
# one of them, as OpenAPI tells of a stream of events
EVENT: Mapping[str, JsonValue] = {
    "type": "object",
    "properties": {
        "event": {"type": "string", "enum": ["progress", "over"]},
        "data": {"type": "string", "contentMediaType": "application/json"},
    },
    "required": ["event", "data"],
}
EVENTS_EVERY_S, SETTLES_S, ALIVE_EVERY_S = 0.25, 0.02, 15.0


class RangedFile(FileResponse):
    """A file whose refusals of a Range header are problems, as all refusals are."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it, or what the Range header names of it."""
        stat = self.stat_result
        size_bytes = (await asyncio.to_thread(Path(self.path).stat) if stat is None else stat).st_size

        def refuse() -> NoReturn:
            refusal = RangeError(
                f"The Range header does not name bytes of this file, which has {size_bytes:,}; send for instance "
                "'Range: bytes=0-99', or leave it out."
            )
            raise HTTPException(416, headers={"Content-Range": f"bytes */{size_bytes}"}) from refusal

        async def send_unless_refused(message: Message) -> None:
            if message["type"] == "http.response.start" and message["status"] in (400, 416):
                refuse()
            await send(message)

        if not RANGE.fullmatch(Headers(scope=scope).get("range", "bytes=")):
            refuse()
        await super().__call__(scope, receive, send_unless_refused)


async def file_answer(request: Request, path: Path, media_type: str, version: str) -> Response:
    """The file, or 304 when the client has this version of it. Raises NotFoundError when it was just deleted."""
    headers = _version_headers(version)
    if _has_version(request, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    try:
        stat = await asyncio.to_thread(path.stat)
    except FileNotFoundError as error:
        raise NotFoundError("file", path.name) from error
    return RangedFile(path, headers=headers, media_type=media_type, filename=path.name, stat_result=stat)


def bytes_answer(request: Request, content: bytes, media_type: str, version: str) -> Response:
    """Bytes at hand, or 304 when the client has this version of them."""
    headers = _version_headers(version)
    if _has_version(request, headers["ETag"]):
        return Response(status_code=304, headers=headers)
    return Response(content, headers=headers, media_type=media_type)


def _version_headers(version: str) -> dict[str, str]:
    # the content under one digest never changes
    return {"ETag": f'"{version}"', "Cache-Control": "private, no-cache"}


def _has_version(request: Request, etag: str) -> bool:
    asked = {tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")}
    return etag in asked or "*" in asked


def spliced_answer(state: BaseModel, name: str, path: Path | None, status: int, headers: dict[str, str]) -> Response:
    """The state with one field more, the content of the file; null where there is none yet."""
    kept = {key: value for key, value in headers.items() if key not in ("content-length", "content-type")}
    return StreamingResponse(_spliced(state.model_dump_json(), name, path), status, kept, JSON)


async def _spliced(state: str, name: str, path: Path | None) -> AsyncIterator[bytes]:
    yield state.removesuffix("}").encode() + f',"{name}":'.encode()
    if path is None:
        yield b"null"
    else:
        with await asyncio.to_thread(path.open, "rb") as file:
            while block := await asyncio.to_thread(file.read, BLOCK_BYTES):
                yield block
    yield b"}"


def path_of(service: Service, job: JobRecord) -> str:
    """Where the job is found."""
    return rooted(f"{service.products[job.kind].path}/{job.id}")


def state_of(service: Service, job: JobRecord) -> JobOut:
    """How a job stands, without what was asked and what came out."""
    begun_s, over_s = job.started_at_s, job.finished_at_s
    return JobOut.model_construct(
        id=job.id,
        status=job.status,
        progress=service.supervisor.progress(job),
        dem_id=job.dem_id,
        created_at=moment(job.created_at_s),
        started_at=moment(job.started_at_s),
        finished_at=moment(job.finished_at_s),
        run_s=None if begun_s is None or over_s is None else over_s - begun_s,
        attempts=job.attempts,
        pinned=job.pinned,
        expires_at=moment(service.supervisor.retention.expires_at_s(job)),
        problem=None if job.failure is None else problem_of(job.failure, path_of(service, job)),
        links={
            "self": path_of(service, job),
            "request": f"{path_of(service, job)}/request",
            "dem": rooted(f"/dems/{job.dem_id}"),
        },
    )


async def after_waiting(
    request: Request, response: Response, service: Service, job: JobRecord, wait_s: float | None
) -> JobRecord:
    """The job after the wait that the client wanted; sets status 201 or 202 and headers.

    Raises FailedJob when it is over and has no result.
    """
    if wait_s is not None:
        response.headers["Preference-Applied"] = f"wait={wait_s:g}"
        await service.supervisor.wait(job.id, wait_s)
        job = await service.supervisor.in_store(service.store.job, job.kind, job.id)
    response.headers["Location"] = path_of(service, job)
    if job.failure is not None:
        raise FailedJob(job.failure, path_of(service, job))
    if job.active and wait_s is not None and service.supervisor.leaving.is_set():
        raise FailedJob(Failure.of(StoppingError(GOES_ON)), path_of(service, job))
    if job.active:
        response.status_code = 202
        response.headers["Retry-After"] = str(RETRY_AFTER_S)
    return job


def events_of(service: Service, job: JobRecord) -> Response:
    """How a job stands as server-sent events: at once, at every change, and when it is over."""
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(_events(service, job), 200, headers, EVENT_STREAM)


async def _events(service: Service, job: JobRecord) -> AsyncIterator[str]:
    told: tuple[str, float] | None = None
    silent_s = 0.0
    while True:
        now = (job.status, service.supervisor.progress(job))
        if now != told:
            told, silent_s = now, 0.0
            name = "progress" if job.active else "over"
            data = orjson.dumps({"status": job.status, "progress": now[1], "self": path_of(service, job)}).decode()
            yield f"event: {name}\ndata: {data}\n\n"
        elif silent_s >= ALIVE_EVERY_S:
            silent_s = 0.0
            yield ": still here\n\n"
        if not job.active or service.supervisor.leaving.is_set():
            return
        await service.supervisor.wait(job.id, EVENTS_EVERY_S)
        await asyncio.sleep(SETTLES_S)  # between the end of its task and its place in the store
        silent_s += EVENTS_EVERY_S
        try:
            job = await service.supervisor.in_store(service.store.job, job.kind, job.id)
        except NotFoundError:
            yield 'event: over\ndata: {"status":"deleted","progress":0.0}\n\n'
            return


async def finished(service: Service, kind: str, job_id: str) -> JobRecord:
    """A job that has a result. Raises NotFoundError, NotReadyError."""
    job = await service.supervisor.in_store(service.store.job, kind, job_id)
    if job.status is not JobStatus.SUCCEEDED:
        raise NotReadyError(f"The job is {job.status}, so it has no result" + (" yet." if job.active else "."))
    return job


def has_layer(job: JobRecord, layer: Layer) -> bool:
    """Whether a job's result has that layer."""
    return layer.is_of(job.request["parameters"]) and layer.is_in(job.summary or {})


def answer_of(service: Service, product: Product, job: JobRecord) -> MapOut:
    """How a job stands, its result and its layers, without what is long."""
    links = [
        LayerLink(
            name=layer.name,
            href=f"{path_of(service, job)}/layers/{layer.name}",
            media_type=layer.media_type,
            description=layer.description,
        )
        for layer in product.layers
        if job.summary is not None and has_layer(job, layer)
    ]
    told: dict[str, object] = {
        **dict(state_of(service, job)),
        "request": {"dem_id": job.dem_id, **_short(_without_orbits(job.request["parameters"]))},
        "result": _with_notes(job),
        "layers": links,
    }
    if product.inline is not None:
        told["files"] = [f"{path_of(service, job)}/files/{link.name}" for link in links]
    return state_model(product).model_validate(told)


def _with_notes(job: JobRecord) -> Mapping[str, JsonValue] | None:
    """The result, whose warnings also tell of older names that the request used."""
    notes = job.request.get("notes")
    if job.summary is None:
        return None
    asked = job.summary.get("parameters")
    summary = {**job.summary, "parameters": dict(_short(asked))} if isinstance(asked, dict) else job.summary
    if not notes:
        return summary
    told = summary.get("warnings")
    own = told if isinstance(told, list) else []
    return {**summary, "warnings": [*own, *(note for note in notes if note not in own)]}


def whole_answer(service: Service, product: Product, job: JobRecord, status: int, headers: dict[str, str]) -> Response:
    """The same as a response, with what is long."""
    answer = answer_of(service, product, job)
    if product.inline is None:
        kept = {key: value for key, value in headers.items() if key not in ("content-length", "content-type")}
        return Response(answer.model_dump_json(), status, kept, JSON)
    path = None if job.digest is None else service.folder.result(job.digest) / product.inline.layer
    return spliced_answer(answer, product.inline.name, path, status, headers)


def request_answer(job: JobRecord) -> Response:
    """What was asked, whole, ready to be asked again; what was too big for the store is not in it."""
    return Response(orjson.dumps({"dem_id": job.dem_id, **job.request["parameters"]}), media_type=JSON)


def _short(asked: Mapping[str, JsonValue]) -> Mapping[str, JsonValue]:
    """The same without its long fields: buildings, outlines, hundreds of anchors."""
    return {name: value for name, value in asked.items() if len(orjson.dumps(value)) <= LONG_BYTES}


def _without_orbits(parameters: Mapping[str, JsonValue]) -> Mapping[str, JsonValue]:
    """What was asked, without the text of satellites' orbits, which is long and the client's own."""
    satellites = parameters.get("satellites")
    if not isinstance(satellites, dict):
        return parameters
    return {**parameters, "satellites": {k: v for k, v in satellites.items() if k not in ORBIT_TEXTS}}
