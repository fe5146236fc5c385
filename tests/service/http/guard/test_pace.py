"""Requests begin one at a time, in turns, and whoever looks after the service does not wait behind them."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from service.http.guard.pace import PIECE_BYTES, Pace


async def begun_in_order(asked: list[tuple[str, str]]) -> list[tuple[str, str, int]]:
    """(client, path, how often the event loop had come round) of requests that all come at once."""
    begun: list[tuple[str, str, int]] = []
    rounds = 0

    def count() -> None:
        nonlocal rounds
        rounds += 1
        asyncio.get_running_loop().call_soon(count)

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        begun.append((scope["client"][0], scope["path"], rounds))
        await asyncio.sleep(0.2)  # none of them is over before all have begun

    count()
    pace: Any = Pace(app)
    scopes = [{"type": "http", "path": path, "client": (client, 1)} for client, path in asked]
    await asyncio.gather(*(pace(scope, None, None) for scope in scopes))
    return begun


def test_one_begins_each_time_the_loop_comes_round() -> None:
    begun = asyncio.run(begun_in_order([("127.0.0.1", f"/{n}") for n in range(40)]))
    assert [path for _, path, _ in begun] == [f"/{n}" for n in range(40)]
    rounds = [number for _, _, number in begun]
    assert len(set(rounds)) == len(rounds)


def test_who_sends_many_does_not_hold_up_who_sends_one() -> None:
    many = [("192.0.2.1", f"/{n}") for n in range(40)]
    begun = asyncio.run(begun_in_order([*many, ("192.0.2.2", "/mine")]))
    assert [client for client, _, _ in begun].index("192.0.2.2") <= 2


def test_what_looks_after_the_service_has_a_lane_of_its_own() -> None:
    many = [("192.0.2.1", f"/{n}") for n in range(40)]
    begun = asyncio.run(begun_in_order([*many, ("192.0.2.1", "/health"), ("192.0.2.1", "/ready")]))
    paths = [path for _, path, _ in begun]
    assert paths.index("/health") <= 2
    assert paths.index("/ready") <= 6


@pytest.mark.parametrize("size", [0, 1, PIECE_BYTES, PIECE_BYTES + 1, 3 * PIECE_BYTES, 3 * PIECE_BYTES + 7])
@pytest.mark.parametrize("more", [True, False])
def test_a_long_answer_leaves_whole_and_in_pieces(size: int, more: bool) -> None:
    body = bytes(range(256)) * (size // 256) + bytes(size % 256)
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await send({"type": "http.response.body", "body": body, "more_body": more})

    pace: Any = Pace(app)
    asyncio.run(pace({"type": "http", "path": "/", "client": None}, None, send))
    assert b"".join(message["body"] for message in sent) == body
    assert all(len(message["body"]) <= PIECE_BYTES for message in sent)
    assert [message["more_body"] for message in sent] == [True] * (len(sent) - 1) + [more]
