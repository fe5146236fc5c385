"""Detectors: an epoch judged by itself, sessions that remember, and the WebSocket that streams epochs to one."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import uuid
from collections.abc import Coroutine, Mapping
from typing import Any

from fastapi import APIRouter, Request, Response, WebSocket, WebSocketDisconnect
from pydantic_core import from_json

from detection import detect_epoch, diagnose
from service.errors import BodyTooLargeError, InternalError, NotJsonError, ServiceError
from service.jobs.channel import model_of, validated
from service.jobs.kept_files import load_grid
from service.jobs.records import Failure
from service.live.answers import DetectionOut, DetectorOut, DetectorStateful, EpochsOut, as_json, epoch_answer
from service.live.request import DetectionIn, DetectorIn, EpochIn, EpochsIn
from service.live.sessions import DetectorSession
from service.live.watching import looked_at
from terrain import ElevationGrid

from .answers import Limit, Offset, Page
from .bodies import json_body
from .context import Service, ServiceDep
from .meta import LOCATION, body_of, problem_responses
from .problems import MEDIA_TYPE, ProblemFields, problem_of

__all__ = ["router"]

logger = logging.getLogger("sightline.http")

router = APIRouter(prefix="/detectors", tags=["Detectors"])
# WebSocket close codes (RFC 6455, section 7.4.1; 1013 from IANA's registry), and what the last message says
OVER = (1000, "The detector is over.")
TOO_SLOW = (1013, "Answers came faster than they were taken; watch again.")
CLOSING_MAY_TAKE_S = 5.0

Close = tuple[int, str]
detections = APIRouter(prefix="/detections", tags=["Detectors"])


@router.websocket("/{detector_id}/stream")
async def stream(socket: WebSocket, detector_id: str, watch: bool = False) -> None:
    """Answer each message; with ``?watch=true`` send every answer of the session instead, whoever sent the epoch."""
    service: Service = socket.app.state.service
    try:
        session = service.detectors.get(detector_id)
        session.open_stream()
    except ServiceError as error:
        await _refuse(socket, problem_of(Failure.of(error), socket.url.path))
        return
    try:
        await socket.accept()
        talk = _watch(socket, session) if watch else _answer(socket, session, service.settings.max_stream_message_bytes)
        close = await _first_of(talk, _end_of(session))
        if close is not None:
            async with asyncio.timeout(CLOSING_MAY_TAKE_S):
                await socket.close(*close)
    except (TimeoutError, WebSocketDisconnect):
        logger.debug("a stream of detector %s broke", session.id)
    finally:
        session.close_stream()


async def _answer(socket: WebSocket, session: DetectorSession, max_bytes: int) -> Close | None:
    """Answer messages until the client goes. It waits for its answer to be taken before it reads on."""
    path = socket.url.path
    while True:
        message = await socket.receive()
        if message["type"] == "websocket.disconnect":
            return None
        try:
            asked = _epoch_of(message, session, max_bytes)
            session.check(asked)
        except ServiceError as error:
            session.malformed_messages += 1
            await asyncio.sleep(0)  # a flood of them must not keep others waiting
            await _tell(socket, problem_of(Failure.of(error), path))
            continue
        async with session.turn:
            answer = await _answered(session, asked, path)
        await socket.send_text(answer.decode())


async def _answered(session: DetectorSession, asked: EpochIn, path: str) -> bytes:
    try:
        return await session.answer_in_turn(asked)
    except Exception:
        reference = uuid.uuid4().hex[:12]
        logger.exception("%s: an epoch of detector %s failed", reference, session.id)
        return _problem(problem_of(Failure.of(InternalError(reference)), path)).encode()


async def _watch(socket: WebSocket, session: DetectorSession) -> Close | None:
    """Send every answer until the client goes or falls behind; what it says is not listened to."""
    watcher = session.watch()

    async def send() -> Close | None:
        while True:
            await socket.send_text((await watcher.answers.get()).decode())

    async def listen() -> Close | None:
        while (await socket.receive())["type"] != "websocket.disconnect":
            pass
        return None

    async def fall_behind() -> Close | None:
        await watcher.lost.wait()
        return TOO_SLOW

    try:
        return await _first_of(send(), listen(), fall_behind())
    finally:
        session.forget(watcher)


async def _end_of(session: DetectorSession) -> Close | None:
    await session.closed.wait()
    return OVER


async def _first_of(*talks: Coroutine[Any, Any, Close | None]) -> Close | None:
    """What the first that ends returns or raises; the others are cancelled."""
    tasks = [asyncio.create_task(talk) for talk in talks]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.wait(tasks)
    return next(iter(done)).result()


def _epoch_of(message: Mapping[str, Any], session: DetectorSession, max_bytes: int) -> EpochIn:
    """The epoch in a message. Raises NotJsonError, NotValidError, LimitError."""
    text = message.get("text")
    if text is None:
        raise NotJsonError("Send epochs as text messages with JSON, not as binary ones.")
    data = text.encode()
    if len(data) > max_bytes:
        raise BodyTooLargeError(
            f"The message has {len(data):,} bytes, more than the limit of {max_bytes:,}",
            limit_name="max_stream_message_bytes",
            limit=max_bytes,
            given=len(data),
        )
    try:
        return model_of(EpochIn, data, session.limits.refuse_long)
    except NotJsonError as error:
        raise NotJsonError("The message is not valid JSON.") from error


async def _tell(socket: WebSocket, problem: ProblemFields) -> None:
    await socket.send_text(_problem(problem))


def _problem(problem: ProblemFields) -> str:
    return json.dumps({"problem": problem})


async def _refuse(socket: WebSocket, problem: ProblemFields) -> None:
    """Answer the handshake with the problem instead."""
    with contextlib.suppress(WebSocketDisconnect):
        await socket.send_denial_response(Response(json.dumps(problem), problem["status"], media_type=MEDIA_TYPE))


@detections.post(
    "",
    response_model=None,
    summary="Judge one epoch",
    responses={
        200: {"description": "The verdicts, and a position from the ranges that are left.", "model": DetectionOut},
        **problem_responses(400, 413, 415, 422),
    },
    openapi_extra=body_of(DetectionIn),
)
async def judge_epoch(request: Request, service: ServiceDep) -> Response:
    """Which of these ranges lie, judged by themselves: stateless, answered at once, nothing is kept."""
    limits = service.detectors.limits
    asked = model_of(DetectionIn, await json_body(request), limits.refuse_long)
    limits.check_detector(asked)
    limits.check_ranges(asked.ranges)
    anchors = [anchor.anchor() for anchor in asked.anchors]
    epoch, settings = asked.epoch(), asked.settings.settings()
    result = await service.detectors.bench.judge(len(asked.ranges), lambda: detect_epoch(anchors, epoch, settings))
    warnings = [one.sentence for one in diagnose(anchors, (epoch,), (result,), settings)]
    return Response(as_json({**epoch_answer(result), "warnings": warnings}), media_type="application/json")


class DetectorList(Page):
    """One page of sessions, newest first, without their states."""

    detectors: list[DetectorOut]


@router.post(
    "",
    status_code=201,
    response_model=None,
    summary="Open a detector",
    responses={
        201: {"description": "Open; epochs go to the path in links.", "headers": LOCATION, "model": DetectorStateful},
        **problem_responses(400, 404, 413, 415, 422, 503),
    },
    openapi_extra=body_of(DetectorIn),
)
async def open_detector(request: Request, service: ServiceDep) -> Response:
    """A session for one rover: it remembers epochs, and expires when it lies idle or the service ends."""
    asked = model_of(DetectorIn, await json_body(request), service.detectors.limits.refuse_long)
    grid = None if asked.dem_id is None else await _grid(service, asked.dem_id)
    session = service.detectors.open(asked, grid)
    return _json(as_json(session.state()), 201, {"Location": f"/detectors/{session.id}"})


@router.get("", summary="List detectors", responses=problem_responses(422))
async def list_detectors(service: ServiceDep, limit: Limit = 50, offset: Offset = 0) -> DetectorList:
    """Open sessions, newest first, without what they remember."""
    sessions = service.detectors.page(limit, offset)
    described = [DetectorOut.model_validate(session.description()) for session in sessions]
    return DetectorList(detectors=described, total=len(service.detectors), limit=limit, offset=offset)


@router.get(
    "/{detector_id}",
    response_model=None,
    summary="Read a detector",
    responses={
        200: {"description": "The session and what it remembers.", "model": DetectorStateful},
        **problem_responses(404, 410),
    },
)
async def get_detector(detector_id: str, service: ServiceDep) -> Response:
    """Counts, the last word on each anchor, the witnesses' health, the last answer. Reading keeps it from expiring."""
    return _json(as_json(await service.detectors.get(detector_id).state_between_epochs()))


@router.post(
    "/{detector_id}/epochs",
    response_model=None,
    summary="Send epochs",
    responses={
        200: {"description": "One answer per epoch, in their order.", "model": EpochsOut},
        **problem_responses(400, 404, 410, 413, 415, 422),
    },
    openapi_extra=body_of(EpochsIn),
)
async def send_epochs(detector_id: str, request: Request, service: ServiceDep) -> Response:
    """Each epoch is answered; one that is late, out of order or a duplicate is told, counted, and otherwise ignored.

    A request that is refused changes nothing: all its epochs are checked before the first is used.
    """
    session = service.detectors.get(detector_id)
    epochs = await _epochs_in(await json_body(request), service)
    for epoch in epochs:
        session.check(epoch)
    async with session.turn:
        answers = [await session.answer_in_turn(epoch) for epoch in epochs]
    return _json(b'{"answers":[' + b",".join(answers) + b"]}")


@router.get(
    "/{detector_id}/map-doubts",
    response_model=None,
    summary="Where ranges contradict the map",
    responses={
        200: {
            "description": "GeoJSON: a line or point for each contradiction that lasted, with anchor_id, expected "
            "(what the map has), bearing_deg, distance_m, from_s, to_s, ranges, excess_m and probability.",
            "content": {"application/geo+json": {"schema": {"type": "object"}}},
        },
        **problem_responses(404, 410, 422),
    },
)
async def get_map_doubts(detector_id: str, service: ServiceDep) -> Response:
    """Places where an anchor was hidden that the map has in sight, or heard straight that it has hidden."""
    doubts = await service.detectors.get(detector_id).map_doubts()
    return Response(doubts, media_type="application/geo+json")


@router.delete(
    "/{detector_id}",
    status_code=204,
    summary="Delete a detector",
    responses={204: {"description": "It is over, and so are its streams."}, **problem_responses(404, 410)},
)
async def delete_detector(detector_id: str, service: ServiceDep) -> Response:
    """Its streams are closed; what it remembered is gone."""
    service.detectors.delete(detector_id)
    return Response(status_code=204)


async def _epochs_in(body: str, service: Service) -> list[EpochIn]:
    """The epochs of a body. Raises NotJsonError, LimitError, NotValidError."""
    limits = service.detectors.limits
    if len(body) <= service.settings.max_stream_message_bytes:
        return model_of(EpochsIn, body, limits.refuse_long_epochs).epochs
    # what is wrong with a long one takes long to tell; what is right is read here, epoch by epoch
    await service.checks.ask("check-epochs", {"body": body})
    epochs = []
    for fields in from_json(body)["epochs"]:
        epochs.append(validated(EpochIn, fields))
        await asyncio.sleep(0)
    return epochs


async def _grid(service: Service, dem_id: str) -> ElevationGrid:
    """The ground of a DEM, its heights mapped from the file. Raises NotFoundError."""
    await service.supervisor.in_store(service.store.dem, dem_id)
    return await asyncio.to_thread(lambda: looked_at(load_grid(service.folder.dem(dem_id))))


def _json(body: bytes, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    return Response(body, status, headers, "application/json")
