"""The WebSocket that streams epochs to a live detector, and its answers to whoever watches."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import uuid
from collections.abc import Coroutine, Mapping
from typing import Any

from fastapi import Response, WebSocket, WebSocketDisconnect

from service.errors import BodyTooLargeError, InternalError, NotJsonError, ServiceError
from service.jobs.channel import model_of
from service.jobs.records import Failure
from service.live.request import EpochIn
from service.live.sessions import DetectorSession

from .context import Service
from .guard.queries import refuse_unknown
from .guard.routing import Router
from .problems import MEDIA_TYPE, ProblemFields, problem_of

__all__ = ["router"]

logger = logging.getLogger("sightline.http")

router = Router(prefix="/detectors", tags=["Detectors"])
# WebSocket close codes (RFC 6455, section 7.4.1; 1013 from IANA's registry), and what the last message says
OVER = (1000, "The detector is over.")
TOO_SLOW = (1013, "Answers came faster than they were taken; watch again.")
CLOSING_MAY_TAKE_S = 5.0

Close = tuple[int, str]


@router.websocket("/{detector_id}/stream")
async def stream(socket: WebSocket, detector_id: str, watch: bool = False) -> None:
    """Answer each message; with ``?watch=true`` send every answer of the session instead, whoever sent the epoch."""
    service: Service = socket.app.state.service
    try:
        await refuse_unknown(socket)
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
