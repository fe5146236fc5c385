"""Clients that trickle, lie idle by the thousand, flood or never read hold up nobody, and are gone soon.

How much slower others become is measured by ``python -m benchmarks --only strangers``.
"""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import httpx
import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from benchmarks.service.slow_attackers import ATTACKS
from benchmarks.service.slow_clients import HONEST, Place, honest_clients, made_place, resident_bytes, under_attack
from service.http.guard.connections import MOMENT_S
from tests.service.running import Server, running

HEADER_S, STALL_S = 2.0, 3.0
DESCRIPTORS = 1024
MB = 1e6


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, Place]]:
    """A service that is impatient, so that tests need not wait, and has as few descriptors as on many systems."""
    folder = tmp_path_factory.mktemp("guarded") / "data"
    with running(
        folder, descriptors=DESCRIPTORS, max_header_s=HEADER_S, max_stall_s=STALL_S, access_log=False
    ) as server:
        yield server, made_place(server.client)


@pytest.mark.parametrize("what", ATTACKS)
def test_honest_clients_notice_nothing_of(guarded: tuple[Server, Place], what: str) -> None:
    server, place = guarded
    before_bytes, said = resident_bytes(server.process.pid), server.log.stat().st_size
    with under_attack(place, what):
        honest = asyncio.run(honest_clients(place, 4.0))
    assert honest.failures == []
    assert len(honest.times_s) >= HONEST  # each of them was answered
    deadline_s = time.monotonic() + 10.0
    while (connections := open_connections(server)) > 30 or resident_bytes(server.process.pid) - before_bytes > 60 * MB:
        assert time.monotonic() < deadline_s, (connections, resident_bytes(server.process.pid) - before_bytes)
        time.sleep(0.2)
    assert server.log.stat().st_size - said < 20_000
    while left := list((server.folder / "incoming").iterdir()):
        assert time.monotonic() < deadline_s, left
        time.sleep(0.2)


def open_connections(server: Server) -> int:
    told = server.client.get("/metrics").text
    return int(float(next(line for line in told.splitlines() if line.startswith("sightline_connections ")).split()[1]))


def raw(server: Server, data: bytes) -> socket.socket:
    url = httpx.URL(server.url)
    connection = socket.create_connection((url.host, url.port or 80), timeout=30.0)
    connection.sendall(data)
    return connection


def heard(connection: socket.socket) -> bytes:
    told = b""
    while block := connection.recv(65536):
        told += block
    return told


@pytest.mark.parametrize(
    ("sent", "what"),
    [
        (b"GET /health HTTP/1.1\r\nHost: localhost\r\n", "head"),
        (b"POST /dems HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9999999\r\n\r\nII*", "body"),
        (
            b"POST /probe HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 99\r\n\r\n{",
            "body",
        ),
    ],
)
def test_what_stops_coming_is_answered_with_408(guarded: tuple[Server, Place], sent: bytes, what: str) -> None:
    server, _ = guarded
    with raw(server, sent) as connection:
        head, _, body = heard(connection).partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 408 ")
    assert json.loads(body)["type"] == "/problems/too-slow"
    assert what in json.loads(body)["detail"]


@pytest.mark.parametrize(
    ("path", "told"),
    [("/visibility-maps", 10**12), ("/detections", 10**12), ("/dems?filename=a.tif", 10**15), ("/missions", 10**15)],
)
def test_a_body_that_would_be_too_large_is_refused_before_it_comes(
    guarded: tuple[Server, Place], path: str, told: int
) -> None:
    head = f"POST {path} HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/octet-stream\r\n"
    with raw(guarded[0], f"{head}Content-Length: {told}\r\n\r\n".encode()) as connection:
        connection.settimeout(STALL_S / 2)  # nothing has been sent, and nothing is waited for
        answer = b""
        while b"/problems/body-too-large" not in answer:
            block = connection.recv(65536)
            assert block, answer
            answer += block
    assert answer.startswith(b"HTTP/1.1 413 ")


def test_who_sends_too_much_and_only_then_listens_hears_why(guarded: tuple[Server, Place]) -> None:
    body = b" " * 12_000_000
    head = "POST /visibility-maps HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    with raw(guarded[0], f"{head}Content-Length: {len(body)}\r\n\r\n".encode() + body) as connection:
        answer = b""
        while b"/problems/body-too-large" not in answer:
            block = connection.recv(65536)
            assert block, answer
            answer += block
    assert answer.startswith(b"HTTP/1.1 413 ")


def test_who_says_nothing_at_all_is_closed_without_a_word(guarded: tuple[Server, Place]) -> None:
    with raw(guarded[0], b"") as connection, suppress(ConnectionResetError):  # that is no word either
        assert heard(connection) == b""


def test_a_kept_connection_may_be_used_again_and_again(guarded: tuple[Server, Place]) -> None:
    """Longer than a head may take, with pauses that are shorter."""
    server, _ = guarded
    transport = httpx.HTTPTransport(retries=0)
    with httpx.Client(base_url=server.url, transport=transport, trust_env=False) as client:
        until_s = time.monotonic() + HEADER_S + 2.0
        while time.monotonic() < until_s:
            assert client.get("/health").status_code == 200
            time.sleep(0.4)


def test_a_slow_upload_that_goes_on_is_taken(guarded: tuple[Server, Place]) -> None:
    """Slower than a place is kept for while others wait, quicker than a body that stalls, and nobody waits."""
    server, _ = guarded
    parts = [b"x" * 2000] * 12

    def trickled() -> Iterator[bytes]:
        for part in parts:
            yield part
            time.sleep(0.5)

    answer = server.client.post("/dems", params={"filename": "slow.tif"}, content=trickled())
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/dem-format")


def test_a_ninth_watcher_gets_in_once_eight_that_never_read_are_dropped(guarded: tuple[Server, Place]) -> None:
    server, place = guarded
    url = f"{server.url.replace('http', 'ws', 1)}/detectors/{place.detector_id}/stream?watch=true"
    epochs = [{"time_s": float(n), "ranges": [{"anchor_id": "A0", "range_m": 50.0}] * 1} for n in range(400)]
    with under_attack(place, "unread streams"):
        deadline_s = time.monotonic() + 40.0
        came = 0.0
        while True:
            for epoch in epochs:
                epoch["time_s"] = came = came + 1.0
            server.client.post(f"/detectors/{place.detector_id}/epochs", json={"epochs": epochs}).raise_for_status()
            streams = server.client.get(f"/detectors/{place.detector_id}").json()["streams"]
            if streams < 8:
                break
            assert time.monotonic() < deadline_s, "eight that never read keep their places"
            time.sleep(0.1)
    with ExitStack() as stack:
        deadline_s = time.monotonic() + 10.0
        while server.client.get(f"/detectors/{place.detector_id}").json()["streams"]:
            assert time.monotonic() < deadline_s
            time.sleep(0.1)
        ninth = stack.enter_context(connect(url, proxy=None))
        epochs[0]["time_s"] = came + 1.0
        server.client.post(f"/detectors/{place.detector_id}/epochs", json={"epochs": epochs[:1]}).raise_for_status()
        assert json.loads(ninth.recv(10.0))["time_s"] == came + 1.0


def test_pings_are_answered_and_a_flood_of_them_ends_the_stream(guarded: tuple[Server, Place]) -> None:
    server, place = guarded
    url = f"{server.url.replace('http', 'ws', 1)}/detectors/{place.detector_id}/stream?watch=true"
    with connect(url, proxy=None, close_timeout=30.0) as stream:
        for _ in range(20):
            assert stream.ping().wait(10.0)
        with pytest.raises(ConnectionClosed) as closed:
            _flood(stream)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008


def _flood(stream: ClientConnection) -> None:
    for _ in range(200):
        stream.ping()
    stream.recv(10.0)


def test_connections_beyond_the_limit_are_answered_and_idle_ones_make_room(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_connections=8, rehearse="maps") as server, ExitStack() as stack:
        idle = [stack.enter_context(raw(server, b"")) for _ in range(8)]
        time.sleep(2.0 * MOMENT_S)  # what has just come does not give way
        idle += [stack.enter_context(raw(server, b"")) for _ in range(4)]
        assert server.client.get("/health").status_code == 200
        deadline_s = time.monotonic() + 20.0
        while sum(is_open(one) for one in idle) > 8:
            assert time.monotonic() < deadline_s
            time.sleep(0.1)
        dem = server.sample("valley")
        # eight that wait for a body are not idle; a ninth is told so
        for one in idle:
            one.close()
        busy = [stack.enter_context(waiting_for_a_body(server)) for _ in range(8)]
        with httpx.Client(base_url=server.url, trust_env=False) as late:
            answer = late.get(f"/dems/{dem['id']}")
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/busy")
        assert "SIGHTLINE_MAX_CONNECTIONS" in answer.json()["detail"]
        assert int(answer.headers["Retry-After"]) > 0
        for one in busy:
            one.close()


def waiting_for_a_body(server: Server, address: str = "127.0.0.1") -> socket.socket:
    """A connection whose head the service has read: it says so before the body comes."""
    url = httpx.URL(server.url)
    connection = socket.create_connection((url.host, url.port or 80), 30.0, source_address=(address, 0))
    connection.sendall(
        b"POST /probe HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n"
        b"Expect: 100-continue\r\n\r\n"
    )
    assert connection.recv(65536).startswith(b"HTTP/1.1 100 ")
    return connection


def is_open(connection: socket.socket) -> bool:
    connection.setblocking(False)
    try:
        return connection.recv(1) != b""
    except BlockingIOError:
        return True
    except ConnectionResetError:
        return False


def test_one_address_has_its_share(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_client_connections=3, rehearse="maps") as server:
        url = httpx.URL(server.url)
        with ExitStack() as stack:
            address = (url.host, url.port or 80)
            for _ in range(3):
                stack.enter_context(waiting_for_a_body(server, "127.0.0.7"))
            late = stack.enter_context(socket.create_connection(address, 10.0, source_address=("127.0.0.7", 0)))
            late.sendall(b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert heard(late).startswith(b"HTTP/1.1 429 ")
            assert server.client.get("/health").status_code == 200


def test_bodies_in_memory_have_a_budget(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_body_memory_bytes=1_000_000, rehearse="maps") as server:
        small = server.client.post("/probe", json={"dem_id": "0" * 32, "points": [{"east_m": 0, "north_m": 0}]})
        assert small.status_code == 404
        long = server.client.post("/probe", content=b" " * 400_000, headers={"Content-Type": "application/json"})
        assert (long.status_code, long.json()["type"]) == (503, "/problems/busy")
        assert "SIGHTLINE_MAX_BODY_MEMORY_BYTES" in long.json()["detail"]


def test_uploads_have_a_budget_on_disk(tmp_path: Path) -> None:
    with running(tmp_path / "data", max_incoming_bytes=1_000_000, rehearse="maps") as server:
        answer = server.client.post("/dems", params={"filename": "big.tif"}, content=b"x" * 3_000_000)
        assert (answer.status_code, answer.json()["type"]) == (503, "/problems/busy")
        assert "SIGHTLINE_MAX_INCOMING_BYTES" in answer.json()["detail"]
        assert list((server.folder / "incoming").iterdir()) == []


def test_two_lengths_of_one_body_are_refused(guarded: tuple[Server, Place]) -> None:
    sent = (
        b"POST /probe HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 5\r\n"
        b"Transfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET /dems HTTP/1.1\r\nHost: localhost\r\n\r\n"
    )
    with raw(guarded[0], sent) as connection:
        told = heard(connection)
    assert told.startswith(b"HTTP/1.1 400 ")
    assert b"two lengths" in told
    assert told.count(b"HTTP/1.1 ") == 1
