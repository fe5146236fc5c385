"""uvicorn's protocols with time-outs: for a request's head, for its body, and for whoever does not take an answer."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import h11
import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState

from service.settings import Settings

from .connections import Connections

__all__ = ["GuardedConfig", "HttpConnection", "WebSocketConnection"]

# A body, or what is left of it, comes at this rate at least; Apache's mod_reqtimeout asks for half of it.
BODY_BYTES_PER_S = 1000
# What is parsed at once: a read may bring thousands of tiny frames.
PIECE_BYTES = 4096
# So many pings are answered at once, and so many more each second; browsers send none, libraries one in 20 s.
PINGS, PINGS_PER_S = 50.0, 5.0
HEARD_OUT_S = 1.0
TOO_MANY_PINGS = (1008, "Pings come too fast.")
TIMED_OUT = (
    b"HTTP/1.1 408 Request Timeout\r\nContent-Type: application/problem+json\r\nConnection: close\r\n"
    b"Content-Length: %d\r\n\r\n%s"
)
SENTENCE = (
    b'{"type": "/problems/too-slow", "title": "The request came too slowly", "status": 408, '
    b'"detail": "The %s of the request came too slowly; send it again.", "instance": null}'
)


class GuardedConfig(uvicorn.Config):
    """uvicorn's settings, with those of the guard; its protocols are those of this module."""

    def __init__(self, app: Any, connections: Connections, settings: Settings, **options: Any) -> None:
        super().__init__(app, http=HttpConnection, ws=WebSocketConnection, **options)
        self.connections = connections
        self.max_header_s = settings.max_header_s
        self.max_stall_s = settings.max_stall_s


class _Slowness:
    """Since when a connection has been in one phase, and how many bytes came in it."""

    def __init__(self) -> None:
        self._phase: tuple[str | None, object] = ("", None)
        self.since_s = 0.0
        self.bytes = 0

    def in_phase(self, phase: tuple[str | None, object], now_s: float) -> float:
        """Seconds in this phase."""
        if phase != self._phase:
            self._phase = phase
            self.restart(now_s)
        return now_s - self.since_s

    def restart(self, now_s: float) -> None:
        """Begin to measure anew."""
        self.since_s, self.bytes = now_s, 0


class HttpConnection(H11Protocol):
    """A connection that is ended when a head takes too long, a body stalls, or an answer is not taken."""

    def __init__(
        self,
        config: GuardedConfig,
        server_state: ServerState,
        app_state: Any,
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._guard = config
        self._slowness = _Slowness()
        self._idle_since_s = 0.0
        self._refused = False
        self._pauses = 0
        self.address = ""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override] # as uvicorn has it
        """It is counted; one too many is answered by an app that refuses."""
        super().connection_made(transport)
        self.address = "" if self.client is None else self.client[0]
        self._idle_since_s = self.loop.time()
        self._slowness.in_phase(("head", None), self._idle_since_s)
        refusal = self._guard.connections.enter(self)
        if refusal is not None:
            self.app, self._refused = cast(Any, refusal), True

    def connection_lost(self, exc: Exception | None) -> None:
        """It counts no more."""
        self._guard.connections.leave(self)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes came."""
        self._slowness.bytes += len(data)
        super().data_received(data)
        if self.cycle is not None:
            self._guard.connections.asked(self)

    def pause_writing(self) -> None:
        """The client does not take what is sent."""
        self._pauses += 1
        super().pause_writing()

    def on_response_complete(self) -> None:
        """The next request may come, or none."""
        self._idle_since_s = self.loop.time()
        super().on_response_complete()

    def handle_websocket_upgrade(self, event: h11.Request) -> None:
        """It is a stream from now on."""
        super().handle_websocket_upgrade(event)
        self._guard.connections.become(self, cast(WebSocketConnection, self.transport.get_protocol()))

    def _should_upgrade(self) -> bool:
        return not self._refused and super()._should_upgrade()

    @property
    def idle_since_s(self) -> float | None:
        """None while something is asked."""
        waits = self.cycle is None or self.cycle.response_complete
        return self._idle_since_s if waits and not self.transport.is_closing() else None

    def look(self, now_s: float) -> str | None:
        """What it is too slow in, if it is."""
        phase = self._phase()
        passed_s = self._slowness.in_phase((phase, self._pauses if phase == "answer" else id(self.cycle)), now_s)
        if phase == "head":
            return phase if passed_s > self._guard.max_header_s else None
        if phase is None or passed_s < self._guard.max_stall_s:
            return None
        if phase == "body" and self._slowness.bytes >= BODY_BYTES_PER_S * passed_s:
            self._slowness.restart(now_s)
            return None
        return phase

    def _phase(self) -> str | None:
        """What is waited for; None for the app, or while a time-out of uvicorn's own runs."""
        if self.transport.is_closing() or self.flow.write_paused:
            return "answer"
        if self.cycle is None or self.cycle.response_complete:
            begun = self.cycle is None or bool(self.conn.trailing_data[0])
            return "head" if begun or self.timeout_keep_alive_task is None else None
        reads = not self.flow.read_paused and not self.cycle.waiting_for_100_continue
        return "body" if reads and self.cycle.more_body else None

    def end(self, slow_in: str | None) -> None:
        """Say so where nothing else has been said, and close."""
        asked = slow_in == "body" or (slow_in == "head" and bool(self.conn.trailing_data[0]))
        if asked and slow_in is not None and not self._answered():
            sentence = SENTENCE % slow_in.encode()
            self.transport.write(TIMED_OUT % (len(sentence), sentence))
            self.transport.close()
        else:
            self.transport.abort()

    def _answered(self) -> bool:
        """Whether an answer to the request that is being read has begun."""
        return self.cycle is not None and self.cycle.response_started and not self.cycle.response_complete

    def forget_slowness(self, now_s: float) -> None:
        """Begin to measure anew."""
        self._slowness.restart(now_s)


class WebSocketConnection(WebSocketsSansIOProtocol):
    """A stream that is ended when answers are not taken, or pings come too fast; what comes is parsed in pieces."""

    idle_since_s = None  # one stream is not closed for another connection

    def __init__(
        self,
        config: GuardedConfig,
        server_state: ServerState,
        app_state: Any,
        _loop: asyncio.AbstractEventLoop | None = None,
    ) -> None:
        super().__init__(config, server_state, app_state, _loop)
        self._guard = config
        self._slowness = _Slowness()
        self._pauses = 0
        self._pings, self._pinged_s = PINGS, 0.0
        self._unparsed = bytearray()
        self._flooded, self._has_asked = False, False
        self.address = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """It is counted; one too many is answered by an app that refuses."""
        super().connection_made(transport)
        self.address = "" if self.client is None else self.client[0]

    def connection_lost(self, exc: Exception | None) -> None:
        """It counts no more."""
        self._guard.connections.leave(self)
        self._unparsed.clear()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Bytes came."""
        if not self._has_asked:  # the head, whole, from the protocol that has read it
            self._has_asked = True
            super().data_received(data)
        elif not self._flooded:
            self._unparsed += data
            self._parse()

    def _parse(self) -> None:
        """Up to the next message that the app has not taken; nothing while answers are not taken."""
        while self._unparsed and not self.read_paused and self.writable.is_set() and self._is_open:
            piece = bytes(self._unparsed[:PIECE_BYTES])
            del self._unparsed[:PIECE_BYTES]
            super().data_received(piece)

    async def send(self, message: Any) -> None:
        """To the client; after the answer to the handshake, what came before it is parsed."""
        was_open = self.handshake_complete
        await super().send(message)
        if self.handshake_complete and not was_open:
            self._parse()
            self._read_on()

    @property
    def _is_open(self) -> bool:
        """Before its own answer to the handshake uvicorn takes no frame."""
        return self.handshake_complete and not self._flooded and not self.transport.is_closing()

    async def receive(self) -> Any:
        """The next message; what came behind it is parsed."""
        message = await super().receive()
        self._parse()
        self._read_on()
        return message

    def pause_writing(self) -> None:
        """The client does not take what is sent."""
        # pongs too are answers: who does not take them is not listened to
        self._pauses += 1
        super().pause_writing()
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        """The client has taken what was sent."""
        super().resume_writing()
        self._parse()
        self._read_on()

    def _read_on(self) -> None:
        """Read, unless the app has to take a message first, or the client an answer."""
        if self.transport.is_closing():
            return
        if self.read_paused or not self.writable.is_set():
            self.transport.pause_reading()
        else:
            self.transport.resume_reading()

    def handle_ping(self) -> None:
        """Answer it, or close where there are too many."""
        now_s = self.loop.time()
        self._pings = min(PINGS, self._pings + PINGS_PER_S * (now_s - self._pinged_s)) - 1.0
        self._pinged_s = now_s
        if self._pings >= 0.0 or self.close_sent:
            super().handle_ping()
            return
        self._guard.connections.ended["pings"] += 1
        code, reason = TOO_MANY_PINGS
        self.queue.put_nowait({"type": "websocket.disconnect", "code": code, "reason": reason})
        self.conn.fail(code, reason)
        self.transport.write(b"".join(self.conn.data_to_send()))
        self.close_sent = self._flooded = True
        self.transport.write_eof()
        # closed while more of them come, the client would see a broken connection instead of the reason
        self.close_timer = self.loop.call_later(HEARD_OUT_S, self.transport.abort)

    def keepalive_timeout(self) -> None:
        """The client did not answer a ping."""
        super().keepalive_timeout()
        # what it has not read until now it does not read: closing would wait for that for ever
        self.transport.abort()

    def look(self, now_s: float) -> str | None:
        """What it is too slow in, if it is."""
        waits = self.transport.is_closing() or not self.writable.is_set()
        passed_s = self._slowness.in_phase(("answer" if waits else "", self._pauses), now_s)
        return "answer" if waits and passed_s > self._guard.max_stall_s else None

    def end(self, slow_in: str | None) -> None:
        """Say so where nothing else has been said, and close."""
        self.transport.abort()

    def forget_slowness(self, now_s: float) -> None:
        """Begin to measure anew."""
        self._slowness.restart(now_s)
