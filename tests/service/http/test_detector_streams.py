"""The WebSocket of a detector: answers in order, whatever comes; several clients; limits; how it ends."""

from __future__ import annotations

import json
import math
import socket
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedOK, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from service.live.request import ANCHORS, RANGES
from tests.service.running import Server, running


@pytest.fixture
def session(server: Server) -> Iterator[str]:
    path = server.client.post("/detectors", json={"anchors": ANCHORS}).headers["Location"]
    yield path
    server.client.delete(path)


def stream(server: Server, session: str, query: str = "") -> ClientConnection:
    return connect(f"{server.url.replace('http', 'ws')}{session}/stream{query}", proxy=None, compression=None)


def epoch(number: int, ranges: Any = RANGES) -> str:
    return json.dumps({"time_s": float(number), "sequence": number, "ranges": ranges})


def say(stream: ClientConnection, message: str | bytes) -> Any:
    stream.send(message)
    return json.loads(stream.recv(timeout=20))


def test_each_epoch_is_answered_in_order(server: Server, session: str) -> None:
    with stream(server, session) as open_stream:
        for number in range(50):
            open_stream.send(epoch(number))
        answers = [json.loads(open_stream.recv(timeout=20)) for _ in range(50)]
    assert [answer["sequence"] for answer in answers] == list(range(50))
    assert all(answer["rejection"] is None for answer in answers)
    assert server.client.get(session).json()["state"]["epochs"] == 50


MALFORMED: dict[str, tuple[str | bytes, int, str]] = {
    "no JSON": ("nonsense", 400, "not valid JSON"),
    "half a JSON": ('{"time_s": 1.0, "ranges": [', 400, "not valid JSON"),
    "nothing": ("", 400, "not valid JSON"),
    "a number": ("5", 422, "object"),
    "a list": ("[]", 422, "object"),
    "another object": ('{"hello": "world"}', 422, "time_s"),
    "a misspelt field": ('{"time_s": 1.0, "ranges": [], "rangs": []}', 422, "rangs"),
    "time as text": ('{"time_s": "1", "ranges": []}', 422, "time_s"),
    "deeply nested": ("[" * 60_000, 400, "not valid JSON"),
    "binary": (b"\x00\xff\x80", 400, "text messages"),
    "too large": (
        epoch(1, [{"anchor_id": "x" * 64, "range_m": 1.0}] * 1000),
        413,
        "SIGHTLINE_MAX_STREAM_MESSAGE_BYTES",
    ),
    "33 ranges": (epoch(1, RANGES * 6), 422, "SIGHTLINE_MAX_DETECTOR_ANCHORS"),
    "a stranger moves": (
        json.dumps({"time_s": 1.0, "ranges": [], "moved": [{**ANCHORS[0], "id": "Z"}]}),
        422,
        "no anchor 'Z'",
    ),
}


def test_a_message_that_is_no_epoch_is_told_and_counted_and_the_session_goes_on(server: Server, session: str) -> None:
    with stream(server, session) as open_stream:
        for number, (what, (message, status, named)) in enumerate(MALFORMED.items(), 1):
            problem = say(open_stream, message)["problem"]
            assert (problem["status"], problem["instance"]) == (status, f"{session}/stream"), what
            assert named in problem["detail"], what
            assert say(open_stream, epoch(number))["rejection"] is None, what
    described = server.client.get(session).json()
    assert described["malformed_messages"] == len(MALFORMED)
    assert described["state"]["epochs"] == len(MALFORMED)


def test_what_a_sensor_may_deliver_is_counted_and_the_session_goes_on(server: Server, session: str) -> None:
    spoilt = [
        *(({"anchor_id": "D1", "range_m": range_m}) for range_m in (-1.0, 0.0, math.nan, math.inf, 1e300)),
        {"anchor_id": "Z", "range_m": 1.0},
    ]
    with stream(server, session) as open_stream:
        for number, measured in enumerate(spoilt):
            answer = say(open_stream, epoch(number, [measured, *RANGES[1:]]))
            assert len(answer["rejected"]) == 1
            assert len(answer["verdicts"]) == 5
        assert say(open_stream, epoch(2))["rejection"] == "older than the epoch before it"
        assert say(open_stream, epoch(len(spoilt) - 1))["rejection"] == "duplicate epoch"
    rejections = server.client.get(session).json()["state"]["rejections"]
    assert sum(rejections.values()) == len(spoilt) + 2


def test_a_message_far_too_large_ends_the_stream_but_not_the_session(server: Server, session: str) -> None:
    with stream(server, session) as open_stream:
        open_stream.send("x" * 300_000)
        with pytest.raises(ConnectionClosed) as ended:
            open_stream.recv(timeout=20)
    assert ended.value.rcvd is not None
    assert ended.value.rcvd.code == 1009
    with stream(server, session) as open_stream:
        assert say(open_stream, epoch(1))["rejection"] is None


def test_several_clients_share_a_session_and_watchers_hear_everything(server: Server, session: str) -> None:
    with (
        stream(server, session) as rover,
        stream(server, session) as relay,
        stream(server, session, "?watch=true") as base,
    ):
        base.send("a watcher is not listened to")
        told = [say(rover, epoch(1)), say(relay, epoch(2)), say(rover, epoch(3))]
        posted = server.client.post(f"{session}/epochs", json={"epochs": [{"time_s": 4.0, "ranges": RANGES}]})
        told += posted.json()["answers"]
        assert say(relay, epoch(2))["rejection"] is not None
        watched = [json.loads(base.recv(timeout=20)) for _ in range(5)]
    assert watched[:4] == told
    assert [answer["time_s"] for answer in watched] == [1.0, 2.0, 3.0, 4.0, 2.0]


def test_a_client_that_reads_late_gets_every_answer_and_keeps_nobody_waiting(server: Server, session: str) -> None:
    count = 1500
    with stream(server, session) as slow, ThreadPoolExecutor(1) as thread:
        sending = thread.submit(lambda: [slow.send(epoch(number)) for number in range(count)])
        assert server.client.get("/health").elapsed.total_seconds() < 5.0
        told = [json.loads(slow.recv(timeout=60))["sequence"] for _ in range(count)]
        sending.result()
    assert told == list(range(count))


def test_deleting_a_session_closes_its_streams(server: Server) -> None:
    path = server.client.post("/detectors", json={"anchors": ANCHORS}).headers["Location"]
    with stream(server, path) as rover, stream(server, path, "?watch=true") as base:
        assert say(rover, epoch(1))["rejection"] is None
        base.recv(timeout=20)
        server.client.delete(path)
        for open_stream in (rover, base):
            with pytest.raises(ConnectionClosedOK, match="The detector is over"):
                open_stream.recv(timeout=20)


def test_pings_are_answered(server: Server, session: str) -> None:
    with stream(server, session) as open_stream:
        assert open_stream.ping().wait(20)


def test_a_client_that_vanishes_leaves_no_stream_behind(server: Server, session: str) -> None:
    gone = stream(server, session)
    gone.socket.shutdown(socket.SHUT_RDWR)
    deadline_s = time.monotonic() + 20.0
    while server.client.get(session).json()["streams"]:
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


@contextmanager
def refused() -> Iterator[Any]:
    with pytest.raises(InvalidStatus) as error:
        yield error
    assert error.value.response.headers["Content-Type"] == "application/problem+json"


def test_the_handshake_of_no_session_is_answered_with_a_problem(server: Server) -> None:
    with refused() as error:
        stream(server, "/detectors/nobody")
    assert error.value.response.status_code == 404
    path = server.client.post("/detectors", json={"anchors": ANCHORS}).headers["Location"]
    server.client.delete(path)
    with refused() as error:
        stream(server, path)
    assert error.value.response.status_code == 410
    assert json.loads(error.value.response.body)["type"] == "/problems/gone"


@pytest.mark.parametrize(
    ("query", "told"),
    [
        ("?colour=red", "'colour' in the query is not known here, which takes watch."),
        ("?watch=true&watch=false", "The query has 'watch' 2 times; give it once."),
        ("?watch=perhaps", "query.watch: Input should be a valid boolean, unable to interpret input."),
    ],
)
def test_what_a_stream_does_not_take_is_told(server: Server, session: str, query: str, told: str) -> None:
    with refused() as error:
        stream(server, session, query)
    assert error.value.response.status_code == 422
    assert json.loads(error.value.response.body)["detail"] == told


def test_one_stream_too_many_is_refused_with_429_and_the_end_of_the_service_is_told(tmp_path: Any) -> None:
    with running(tmp_path / "data", max_detector_streams=1) as server:
        path = server.client.post("/detectors", json={"anchors": ANCHORS}).headers["Location"]
        with stream(server, path) as first:
            with refused() as error:
                stream(server, path)
            assert error.value.response.status_code == 429
            assert "SIGHTLINE_MAX_DETECTOR_STREAMS" in json.loads(error.value.response.body)["detail"]
            assert say(first, epoch(1))["rejection"] is None
            server.process.terminate()
            with pytest.raises(ConnectionClosed) as ended:
                first.recv(timeout=20)
        assert ended.value.rcvd is not None
        assert ended.value.rcvd.code == 1012
