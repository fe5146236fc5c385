"""Errors as answers: one table from error class to problem, and the handlers that write application/problem+json."""

from __future__ import annotations

import asyncio
import json
import logging
import sqlite3
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from typing import TypedDict, cast

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from detection import errors as of_detection
from gnss import errors as of_gnss
from navigation import errors as of_navigation
from planning import errors as of_planning
from service import errors as ours
from service.error_roots import domain_errors
from service.jobs.folder import is_full
from service.jobs.process import TaskFailed
from service.jobs.records import Failure
from service.jobs.store_file import error_of_store
from service.parts.sentences import MOST_FIELDS, place_of, sentence_of_detail
from terrain import errors as of_terrain
from visibility import errors as of_visibility

from .bodies import is_json
from .web_page import SAID_OF_EVERY_ANSWER

__all__ = [
    "FRAMEWORK_KINDS",
    "MEDIA_TYPE",
    "METHOD",
    "PROBLEMS",
    "FailedJob",
    "ProblemFields",
    "ProblemKind",
    "answer_to",
    "answer_with_problems",
    "problem_of",
]

logger = logging.getLogger("sightline.http")

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem: its stable name, HTTP status and title."""

    name: str
    status: int
    title: str


class ProblemFields(TypedDict):
    """The fields of every problem; numbers of its error, and what is wrong with which field, may stand beside them."""

    type: str
    title: str
    status: int
    detail: str
    instance: str | None


PROBLEMS: Mapping[type[Exception], ProblemKind] = {
    of_terrain.TerrainError: ProblemKind("terrain", 422, "The ground cannot be used"),
    of_terrain.ElevationGridError: ProblemKind("elevation-grid", 422, "The heights do not make a grid"),
    of_terrain.DemReadError: ProblemKind("dem-read", 422, "The file cannot be read as a DEM"),
    of_terrain.DemFormatError: ProblemKind("dem-format", 422, "The file is not a DEM"),
    of_terrain.DemTooLargeError: ProblemKind("dem-too-large", 422, "The DEM has too many cells"),
    of_terrain.DemUnsupportedError: ProblemKind("dem-unsupported", 422, "The raster cannot serve as a DEM"),
    of_terrain.NoGroundError: ProblemKind("no-ground", 422, "There is no ground in the area"),
    of_terrain.GroundChangedError: ProblemKind("ground-changed", 409, "The ground library was changed"),
    of_terrain.GroundSourceError: ProblemKind("ground-source", 502, "A source of ground fails"),
    of_terrain.AreaError: ProblemKind("ground-area", 422, "The area cannot be used"),
    of_terrain.FrameError: ProblemKind("frame", 422, "The position or CRS does not fit the DEM"),
    of_terrain.VerticalDatumError: ProblemKind("vertical-datum", 422, "Heights cannot be brought to that datum"),
    of_terrain.SampleError: ProblemKind("sample", 404, "There is no such bundled DEM"),
    of_visibility.VisibilityError: ProblemKind("visibility", 422, "The question cannot be answered"),
    of_visibility.AnchorError: ProblemKind("anchor", 422, "An anchor cannot be used"),
    of_visibility.VisibilityInputError: ProblemKind("visibility-input", 422, "The question cannot be answered"),
    of_visibility.MeshError: ProblemKind("mesh", 422, "A building mesh cannot be used"),
    of_visibility.CoverError: ProblemKind("cover", 422, "Buildings or canopy cannot be used"),
    of_gnss.GnssError: ProblemKind("gnss", 422, "The satellites cannot be used"),
    of_gnss.GnssInputError: ProblemKind("gnss-input", 422, "The question cannot be answered"),
    of_gnss.AlmanacError: ProblemKind("almanac", 422, "The satellites' orbits cannot be used"),
    of_gnss.AlmanacFileError: ProblemKind("almanac-file", 422, "The almanac file cannot be read"),
    of_planning.PlanningError: ProblemKind("planning", 422, "The plan cannot be made"),
    of_planning.PlacementError: ProblemKind("placement", 422, "The anchors cannot be placed"),
    of_planning.NoCandidateError: ProblemKind("no-candidate", 422, "No place is left for an anchor"),
    of_planning.WatchError: ProblemKind("watch", 422, "The map cannot be looked at"),
    of_planning.PathError: ProblemKind("path", 422, "The path cannot be planned"),
    of_planning.PathProblemError: ProblemKind("path-problem", 422, "Rover, limits or budget make no question"),
    of_planning.AreaError: ProblemKind("area", 422, "An area cannot be used"),
    of_planning.PlaceError: ProblemKind("place", 422, "A place cannot be used"),
    of_planning.NoCoverageError: ProblemKind("no-coverage", 422, "The limits on positioning hold nowhere"),
    of_planning.PlanningProcessError: ProblemKind("planning-process", 500, "The planner ended before its answer"),
    of_planning.ClusterError: ProblemKind("cluster", 503, "The cluster cannot be used"),
    of_detection.DetectionError: ProblemKind("detection", 422, "The detector cannot be run"),
    of_detection.DetectionInputError: ProblemKind("detection-input", 422, "Anchors or settings make no sense"),
    of_navigation.NavigationError: ProblemKind("navigation", 422, "The question cannot be answered"),
    of_navigation.StateError: ProblemKind("state", 422, "A covariance is none"),
    of_navigation.MeasurementError: ProblemKind("measurement", 422, "Ranges or their errors cannot be used"),
    of_navigation.TimeOrderError: ProblemKind("time-order", 422, "Times go backwards"),
    of_navigation.BubbleError: ProblemKind("bubble", 422, "A safety bubble cannot be asked for"),
    ours.ServiceError: ProblemKind("service", 500, "The service failed"),
    ours.StartError: ProblemKind("start", 503, "The service cannot start"),
    ours.DataFolderError: ProblemKind("data-folder", 503, "The data folder cannot be used"),
    ours.DataFolderInUseError: ProblemKind("data-folder-in-use", 503, "The data folder is in use"),
    ours.AddressError: ProblemKind("address", 503, "The address cannot be used"),
    ours.KeysError: ProblemKind("keys", 503, "Keys cannot be checked"),
    ours.AccessError: ProblemKind("access", 403, "Access is refused"),
    ours.HostError: ProblemKind("host", 421, "The request is for another host"),
    ours.OriginError: ProblemKind("origin", 403, "The request comes from another web page"),
    ours.UnauthenticatedError: ProblemKind("unauthenticated", 401, "A key is needed"),
    ours.ForbiddenError: ProblemKind("forbidden", 403, "The key does not have that scope"),
    ours.StoreLockedError: ProblemKind("store-locked", 503, "The job store is locked"),
    ours.NotFoundError: ProblemKind("not-found", 404, "There is no such resource"),
    ours.GoneError: ProblemKind("gone", 410, "The resource is over"),
    ours.NotReadyError: ProblemKind("not-ready", 409, "The job is not ready for that"),
    ours.InUseError: ProblemKind("in-use", 409, "The resource is in use"),
    ours.EditConflictError: ProblemKind("edit-conflict", 412, "Somebody else saved since"),
    ours.NoPreconditionError: ProblemKind("no-precondition", 428, "The request does not say what it builds on"),
    ours.RequestError: ProblemKind("request", 422, "The request makes no sense"),
    ours.NotJsonError: ProblemKind("not-json", 400, "The body is not JSON"),
    ours.NotValidError: ProblemKind("validation", 422, "The request does not validate"),
    ours.MediaTypeError: ProblemKind("media-type", 415, "The body has an unknown type"),
    ours.RangeError: ProblemKind("range", 416, "The file does not have that range"),
    ours.LimitError: ProblemKind("limit", 422, "The request is beyond a limit"),
    ours.BodyTooLargeError: ProblemKind("body-too-large", 413, "The body is too large"),
    ours.TooManyError: ProblemKind("too-many", 429, "There are too many"),
    ours.BusyError: ProblemKind("busy", 503, "The service is busy"),
    ours.JobError: ProblemKind("job", 500, "The job failed"),
    ours.TimeLimitError: ProblemKind("time-limit", 422, "The calculation took too long"),
    ours.MemoryLimitError: ProblemKind("memory-limit", 422, "The calculation needs too much memory"),
    ours.StorageFullError: ProblemKind("storage-full", 507, "There is no space left"),
    ours.JobInterruptedError: ProblemKind("interrupted", 500, "The job was interrupted"),
    ours.JobCancelledError: ProblemKind("cancelled", 409, "The job was cancelled"),
    ours.InternalError: ProblemKind("internal", 500, "Internal error"),
}
KIND_BY_ERROR_NAME = {f"{cls.__module__.partition('.')[0]}.{cls.__name__}": kind for cls, kind in PROBLEMS.items()}
# Sentences of these packages are meant for whoever asked, also those of an error that has no row of its own yet.
KIND_BY_PACKAGE = {package: PROBLEMS[base] for package, base in domain_errors().items()}
INTERNAL = PROBLEMS[ours.InternalError]
METHOD = ProblemKind("method", 405, "The method is not allowed here")
# What the framework itself finds wrong.
FRAMEWORK_KINDS = {
    400: PROBLEMS[ours.NotJsonError],
    404: PROBLEMS[ours.NotFoundError],
    405: METHOD,
    422: PROBLEMS[ours.NotValidError],
}


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
    app.add_exception_handler(HTTPException, _of_framework)
    app.add_exception_handler(sqlite3.DatabaseError, _of_store)
    # apart from other faults, because a full disk is answered while the body still comes in
    app.add_exception_handler(OSError, _fault)
    app.add_exception_handler(Exception, _fault)


async def _domain_error(request: Request, error: Exception) -> Response:
    return _respond(problem_of(Failure.of(error), request.url.path))


async def _task_failed(request: Request, error: Exception) -> Response:
    assert isinstance(error, TaskFailed)
    return _respond(problem_of(error.failure, request.url.path))


async def _failed_job(request: Request, error: Exception) -> Response:
    assert isinstance(error, FailedJob)
    return _respond(problem_of(error.failure, error.path), {"Location": error.path})


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
    status = error.status_code
    kind = FRAMEWORK_KINDS.get(status, ProblemKind("http", status, HTTPStatus(status).phrase))
    return _respond(_body(kind, sentences.get(status, str(error.detail)), request.url.path), error.headers)


async def _of_store(request: Request, error: Exception) -> Response:
    assert isinstance(error, sqlite3.DatabaseError)
    told = error_of_store(error)
    if told is None:
        return await _fault(request, error)
    logger.error("the job store cannot be used: %s", error)
    return await _domain_error(request, told)


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
