"""Errors as answers: the handlers that write application/problem+json."""

from __future__ import annotations

import asyncio
import json
import logging
import re
import sqlite3
import uuid
from collections.abc import Mapping
from functools import cache
from http import HTTPStatus
from typing import Any, TypedDict, cast

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError, WebSocketRequestValidationError
from starlette._utils import get_route_path
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, HTTPConnection
from starlette.responses import Response
from starlette.routing import compile_path
from uvicorn.protocols.utils import ClientDisconnected

from service import errors as ours
from service.error_roots import domain_errors
from service.jobs.folder import is_full
from service.jobs.process import TaskFailed
from service.jobs.records import Failure
from service.jobs.store_file import error_of_store
from service.parts.sentences import MOST_FIELDS, place_of, sentence_of_detail

from .problem_kinds import FRAMEWORK_KINDS, INTERNAL, KIND_BY_ERROR_NAME, KIND_BY_PACKAGE, PROBLEMS, ProblemKind
from .web_page import SAID_OF_EVERY_ANSWER

__all__ = [
    "MEDIA_TYPE",
    "FailedJob",
    "ProblemFields",
    "answer_to",
    "answer_with_problems",
    "is_json",
    "problem_of",
]

logger = logging.getLogger("sightline.http")

MEDIA_TYPE = "application/problem+json"
NOT_FOUND = Failure.of(ours.NotFoundError("", "")).error
RETRY_AFTER_S = 1


class ProblemFields(TypedDict):
    """The fields of every problem; numbers of its error, and what is wrong with which field, may stand beside them."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None


class FailedJob(Exception):  # noqa: N818 - a job's outcome on its way to becoming the answer
    """A job that was waited for is over and has no result; carries why, and where the job is found."""

    def __init__(self, failure: Failure, path: str) -> None:
        super().__init__(failure.detail)
        self.failure = failure
        self.path = path


def problem_of(failure: Failure, instance: str | None) -> ProblemFields:
    """The problem that a failure is; an error that the table does not know shows nothing of itself."""
    kind = KIND_BY_ERROR_NAME.get(failure.error) or KIND_BY_PACKAGE.get(failure.error.partition(".")[0])
    if kind is None:
        logger.error("no row for %s: %s", failure.error, failure.detail)
        return _body(INTERNAL, "An internal error occurred.", instance)
    return _body(kind, failure.detail, instance, failure.data)


def answer_to(error: ours.ServiceError, path: str) -> Response:
    """The answer to a request for that path that ends with the error, for what stands before the routes."""
    return _respond(problem_of(Failure.of(error), path))


def answer_with_problems(app: FastAPI) -> None:
    """Answer every error of the app with a problem."""
    for base in (*domain_errors().values(), ours.ServiceError):
        app.add_exception_handler(base, _domain_error)
    app.add_exception_handler(TaskFailed, _task_failed)
    app.add_exception_handler(FailedJob, _failed_job)
    app.add_exception_handler(RequestValidationError, _not_valid)
    app.add_exception_handler(WebSocketRequestValidationError, _not_valid_stream)
    app.add_exception_handler(HTTPException, _of_framework)
    app.add_exception_handler(ClientDisconnect, _nobody_there)
    app.add_exception_handler(ClientDisconnected, _left)
    app.add_exception_handler(sqlite3.DatabaseError, _of_store)
    # apart from other faults, because a full disk is answered while the body still comes in
    app.add_exception_handler(OSError, _fault)
    app.add_exception_handler(Exception, _fault)


def is_json(request: Request) -> bool:
    """Whether the body says that it is JSON."""
    media_type = request.headers.get("content-type", "").partition(";")[0].strip().lower()
    return media_type == "application/json" or media_type.endswith("+json")


async def _domain_error(request: Request, error: Exception) -> Response:
    return _answer(request, Failure.of(error))


async def _task_failed(request: Request, error: Exception) -> Response:
    assert isinstance(error, TaskFailed)
    return _answer(request, error.failure)


def _answer(request: Request, failure: Failure) -> Response:
    """The answer to a request that ends so; of a DEM that is being made it says that in place of there being none."""
    service = getattr(request.app.state, "service", None)
    if service is not None and failure.error == NOT_FOUND and failure.data.get("kind") == "DEM":
        ground = service.grounds.known(str(failure.data["id"]))
        if ground is not None and not ground.making.done():
            sentence = f"The DEM {ground.dem_id} is being made; ask again once GET /dems/{ground.dem_id} answers 200."
            failure = Failure.of(ours.DemUnderWayError(sentence))
            return _respond(problem_of(failure, request.url.path), {"Retry-After": str(RETRY_AFTER_S)})
    return _respond(problem_of(failure, request.url.path))


async def _failed_job(request: Request, error: Exception) -> Response:
    assert isinstance(error, FailedJob)
    return _respond(problem_of(error.failure, error.path), {"Location": error.path})


async def _not_valid_stream(socket: Any, error: Any) -> None:
    """The same of a WebSocket: its handshake is answered. The framework has one type for handlers of both."""
    await socket.send_denial_response(await _not_valid(socket, RequestValidationError(error.errors())))


async def _not_valid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    details = error.errors()
    if details[0]["type"] == "json_invalid":
        return _respond(_body(FRAMEWORK_KINDS[400], "The body is not valid JSON.", request.url.path))
    if details[0]["loc"] == ("body",) and not is_json(request):
        sentence = "The body must be JSON and say so, with the header 'Content-Type: application/json'."
        return _respond(_body(PROBLEMS[ours.MediaTypeError], sentence, request.url.path))
    fields = [
        {"field": place_of(detail["loc"]), "detail": str(detail["msg"]).removeprefix("Value error, ")}
        for detail in details[:MOST_FIELDS]
    ]
    return _respond(_body(FRAMEWORK_KINDS[422], sentence_of_detail(details), request.url.path, {"errors": fields}))


async def _of_framework(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    if isinstance(error.__cause__, ours.ServiceError):
        return _respond(problem_of(Failure.of(error.__cause__), request.url.path), error.headers)
    sentences = {
        400: "The body could not be read as JSON.",
        404: f"There is nothing at {request.url.path[:200]}.",
        405: f"{request.method} is not possible at {request.url.path[:200]}.",
    }
    status, headers = error.status_code, dict(error.headers or {})
    if status == 405:
        headers["Allow"] = await _allowed(request) or headers.get("Allow", "")
    kind = FRAMEWORK_KINDS.get(status, ProblemKind("http", status, HTTPStatus(status).phrase))
    return _respond(_body(kind, sentences.get(status, str(error.detail)), request.url.path), headers)


@cache
def _pattern(template: str) -> re.Pattern[str]:
    """Of a path of the document; whoever asks with wrong methods again and again should not keep others waiting."""
    return compile_path(template)[0]


async def _allowed(request: Request) -> str:
    """Methods of whatever has this path: each is a route of its own, and the framework tells those of the first."""
    path = get_route_path(request.scope)
    document = await request.app.state.document.made()
    methods = {
        method.upper()
        for template, item in document["paths"].items()
        if _pattern(template).match(path)
        for method in item
    }
    return ", ".join(sorted(methods | ({"HEAD"} if "GET" in methods else set())))


async def _nobody_there(request: Request, error: Exception) -> Response:
    """The client went away while it sent, which is its right; no one reads this, and the log of requests tells."""
    return Response(status_code=400)


async def _of_store(request: Request, error: Exception) -> Response:
    assert isinstance(error, sqlite3.DatabaseError)
    told = error_of_store(error)
    if told is None:
        return await _fault(request, error)
    logger.error("the job store cannot be used: %s", error)
    return await _domain_error(request, told)


async def _left(_: HTTPConnection, error: Exception) -> Response:
    """A stream's client that has gone before it was answered: the server's own business, and no fault."""
    raise error


async def _fault(request: Request, error: Exception) -> Response:
    if isinstance(error, OSError):
        if is_full(error):
            logger.error("the data folder cannot be written: %s", error)
            full = ours.StorageFullError("The data folder cannot be written; make room on the disk and try again.")
            return await _domain_error(request, full)
        unusable = await asyncio.to_thread(_why_unusable, request)
        if unusable is not None:
            logger.error("%s (%s)", unusable, error)
            return await _domain_error(request, unusable)
    reference = uuid.uuid4().hex[:12]
    logger.error("%s: %s %s failed", reference, request.method, request.url.path, exc_info=error)
    return await _domain_error(request, ours.InternalError(reference))


def _why_unusable(request: Request) -> ours.DataFolderError | None:
    """What is wrong with the data folder, when it is that."""
    service = getattr(request.app.state, "service", None)
    if service is not None:
        try:
            service.folder.check_usable()
        except ours.DataFolderError as error:
            return error
        except OSError:  # full since then
            return None
    return None


def _body(
    kind: ProblemKind, detail: str, instance: str | None, more: Mapping[str, object] | None = None
) -> ProblemFields:
    fields = {
        **(more or {}),
        "type": f"/problems/{kind.name}",
        "title": kind.title,
        "status": kind.status,
        "detail": detail,
        "instance": instance,
    }
    return cast(ProblemFields, fields)


def _respond(problem: ProblemFields, headers: Mapping[str, str] | None = None) -> Response:
    # also of faults, which are answered outside of everything else
    headers = {**SAID_OF_EVERY_ANSWER, **(headers or {})}
    if problem["status"] in (429, 503):
        headers["Retry-After"] = str(ours.BusyError.retry_after_s)
    if problem["status"] == 401:
        headers["WWW-Authenticate"] = 'Bearer realm="Sightline"'
    return Response(json.dumps(problem), problem["status"], headers, MEDIA_TYPE)
