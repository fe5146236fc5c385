"""Clients that are slow, many, or do not read: ``-m benchmarks.service.slow_attackers ATTACK HOST PORT [ID DEM]``.

They come from addresses of their own (127.0.0.10 and on), as strangers do, and begin again when they are cut off.
"""

from __future__ import annotations

import asyncio
import base64
import os
import socket
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

__all__ = ["ATTACKS"]

ADDRESSES = 20
AGAIN_S = 0.5
MIB = 1024 * 1024


@dataclass(frozen=True, slots=True)
class Target:
    """The service, and what is there to be asked for."""

    host: str
    port: int
    detector: str
    dem: str


async def _connected(target: Target, number: int, *, reads: bool = True) -> socket.socket:
    """reads: without it the client has next to no room for what it does not read."""
    connection = socket.socket()
    connection.setblocking(False)
    if not reads:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.bind((f"127.0.0.{10 + number % ADDRESSES}", 0))
    await asyncio.get_running_loop().sock_connect(connection, (target.host, target.port))
    return connection


async def _send(connection: socket.socket, data: bytes) -> None:
    await asyncio.get_running_loop().sock_sendall(connection, data)


async def _heard_out(connection: socket.socket) -> None:
    while await asyncio.get_running_loop().sock_recv(connection, 65536):
        pass


def _head(method: str, path: str, *lines: str) -> bytes:
    return "\r\n".join((f"{method} {path} HTTP/1.1", "Host: localhost", *lines, "", "")).encode()


async def _trickle(connection: socket.socket, data: bytes, every_s: float) -> None:
    while True:
        await _send(connection, data)
        await asyncio.sleep(every_s)


async def _idle(target: Target, number: int) -> None:
    with await _connected(target, number) as connection:
        await _heard_out(connection)


async def _trickled_heads(target: Target, number: int) -> None:
    with await _connected(target, number) as connection:
        await _send(connection, b"GET /health HTTP/1.1\r\nHost: localhost\r\nX-Long: ")
        await _trickle(connection, b"x", 0.5)


async def _trickled_uploads(target: Target, number: int) -> None:
    with await _connected(target, number) as connection:
        await _send(connection, _head("POST", "/dems?filename=a.tif", f"Content-Length: {100 * MIB}"))
        await _trickle(connection, b"x" * 1024, 0.5)


async def _stalled_uploads(target: Target, number: int) -> None:
    with await _connected(target, number) as connection:
        path = f"/imports?dem_id={target.dem}&filename=a.kml"
        await _send(connection, _head("POST", path, f"Content-Length: {27 * MIB}"))
        for _ in range(26):
            await _send(connection, b" " * MIB)
        await _trickle(connection, b" ", 1.0)


async def _stalled_json(target: Target, number: int) -> None:
    with await _connected(target, number) as connection:
        lines = ("Content-Type: application/json", "Content-Length: 2000000")
        await _send(connection, _head("POST", "/visibility-maps", *lines))
        await _send(connection, b" " * 1_900_000)
        await _trickle(connection, b" ", 0.5)


async def _unread_answers(target: Target, number: int) -> None:
    with await _connected(target, number, reads=False) as connection:
        await _send(connection, _head("GET", "/openapi.json") * 100)
        await _trickle(connection, b"GET ", 3600.0)


async def _stream(connection: socket.socket, target: Target, query: str) -> None:
    key = base64.b64encode(os.urandom(16)).decode()
    upgrade = ("Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Key: {key}")
    await _send(connection, _head("GET", f"/detectors/{target.detector}/stream{query}", *upgrade))


async def _pings(target: Target, number: int) -> None:
    frame = bytes((0x89, 0x80 | 125)) + bytes(4) + bytes(125)
    with await _connected(target, number, reads=False) as connection:
        await _stream(connection, target, "")
        while True:
            await _send(connection, frame * 500)


async def _watchers(target: Target, number: int) -> None:
    with await _connected(target, number, reads=False) as connection:
        await _stream(connection, target, "?watch=true")
        await asyncio.sleep(3600.0)


# by what is bad about them: how many at once, and what each does
ATTACKS: dict[str, tuple[int, Callable[[Target, int], Awaitable[None]]]] = {
    "idle connections": (1100, _idle),
    "trickled heads": (400, _trickled_heads),
    "trickled uploads": (8, _trickled_uploads),
    "stalled uploads": (40, _stalled_uploads),
    "stalled JSON": (100, _stalled_json),
    "unread answers": (50, _unread_answers),
    "pings": (8, _pings),
    "unread streams": (8, _watchers),
}


async def _attack(what: str, target: Target) -> None:
    clients, one = ATTACKS[what]

    async def again(number: int) -> None:
        while True:
            try:
                await one(target, number)
            except OSError:  # it was cut off, which is what it asked for
                await asyncio.sleep(AGAIN_S)
            await asyncio.sleep(AGAIN_S)

    print("ready", flush=True)
    await asyncio.gather(*(again(number) for number in range(clients)))


if __name__ == "__main__":
    asyncio.run(_attack(sys.argv[1], Target(sys.argv[2], int(sys.argv[3]), *sys.argv[4:6])))
