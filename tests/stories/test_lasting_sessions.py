"""A detector session outlives its service, also one that is killed: nothing that was answered is lost."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from tests.service.running import Server, running
from tests.stories.grounds import upload_rough_ground

ANCHORS = [
    {"id": f"D{n + 1}", "east_m": east_m, "north_m": north_m, "altitude_m": altitude_m}
    for n, (east_m, north_m, altitude_m) in enumerate(
        [(0.0, 0.0, 120.0), (400.0, 30.0, 60.0), (380.0, 420.0, 140.0), (-20.0, 390.0, 80.0), (240.0, 150.0, 160.0),
         (90.0, 250.0, 40.0)]
    )
]  # fmt: skip


def epoch(number: int) -> dict[str, Any]:
    """A rover that drives east; from the 30th epoch on D2 is hidden. Ranges are rounded, so that they err a little."""
    rover_m = (50.0 + 0.8 * number, 120.0 + 5.0 * math.sin(0.1 * number), 2.0)
    ranges = [
        {
            "anchor_id": one["id"],
            "range_m": round(math.dist((one["east_m"], one["north_m"], one["altitude_m"]), rover_m), 1)
            + (6.0 if one["id"] == "D2" and number >= 30 else 0.0),
        }
        for one in ANCHORS
    ]
    return {"time_s": float(number), "sequence": number, "ranges": ranges}


def send(server: Server, path: str, begin: int, end: int) -> list[dict[str, Any]]:
    answers: list[dict[str, Any]] = []
    for first in range(begin, end, 200):
        epochs = [epoch(number) for number in range(first, min(first + 200, end))]
        answer = server.client.post(f"{path}/epochs", json={"epochs": epochs})
        assert answer.status_code == 200, answer.text
        answers += answer.json()["answers"]
    return answers


def opened(server: Server) -> str:
    answer = server.client.post("/detectors", json={"anchors": ANCHORS, "name": "rover 7"})
    assert answer.json()["kept"] is True
    return str(answer.headers["Location"])


# 250 epochs are more than one part of what is kept; 600 of them more than two
@pytest.mark.parametrize("before", [40, 250, 600])
def test_a_killed_service_goes_on_as_if_it_had_never_ended(tmp_path: Path, before: int) -> None:
    more = 40
    with running(tmp_path / "uninterrupted", workers=1) as server:
        path = opened(server)
        expected = send(server, path, 0, before + more)
    folder = tmp_path / "killed"
    with running(folder, workers=1) as server:
        path = opened(server)
        answers = send(server, path, 0, before)
        server.kill()
    with running(folder, workers=1) as server:
        told = server.client.get(path).json()
        assert (told["name"], told["acknowledged"]) == ("rover 7", {"time_s": before - 1.0, "sequence": before - 1})
        assert told["restored_at"] is not None
        assert told["state"]["epochs"] == before
        # the client does not know which of its last epochs were answered, and sends some of them again
        again = send(server, path, before - 15, before)
        assert {answer["rejection"] for answer in again} == {"duplicate epoch"}
        answers += send(server, path, before, before + more)
        server.client.delete(path)
        server.stop()
    assert answers == expected
    assert answers[-1]["classification"] == "single"
    with running(folder, workers=1) as server:
        assert server.client.get(path).status_code == 404
    assert not list((folder / "detectors").iterdir())


def test_a_stream_goes_on_where_the_last_answer_ended_and_a_map_is_looked_at_again(tmp_path: Path) -> None:
    folder = tmp_path / "data"
    with running(folder, workers=1) as server:
        dem = upload_rough_ground(server, tmp_path)
        east_m, north_m = dem["bounds_of_posts_m"]["west"], dem["bounds_of_posts_m"]["south"]
        anchors = [
            {**one, "east_m": one["east_m"] + east_m, "north_m": one["north_m"] + north_m, "altitude_m": 3000.0}
            for one in ANCHORS
        ]
        made = server.client.post("/detectors", json={"anchors": anchors, "dem_id": dem["id"]})
        assert made.status_code == 201, made.text
        path = made.headers["Location"]
        with connect(f"{server.url.replace('http', 'ws')}{path}/stream") as stream:
            stream.send(json.dumps(epoch(0)))
            json.loads(stream.recv())
            server.kill()
    with running(folder, workers=1) as server:
        told = server.client.get(path).json()
        assert told["acknowledged"] == {"time_s": 0.0, "sequence": 0}
        assert told["dem_id"] == dem["id"]
        with connect(f"{server.url.replace('http', 'ws')}{path}/stream") as stream:
            stream.send(json.dumps(epoch(0)))
            assert json.loads(stream.recv())["rejection"] == "duplicate epoch"
            stream.send(json.dumps(epoch(1)))
            assert json.loads(stream.recv())["rejection"] is None
        server.client.delete(path)
