"""Range logs of any kind read over HTTP: the epochs that a detector session takes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.service.logs.drive import moments
from tests.service.logs.recorded import dataflash, mcap_json, ros1_bag
from tests.service.running import Server


def ask(server: Server, name: str, content: bytes, **query: object) -> dict[str, object]:
    answer = server.client.post("/range-logs", params=query, files={"file": (name, content)})
    assert answer.status_code == 200, answer.text
    return dict(answer.json())


def test_a_table_becomes_the_epochs_that_a_session_takes(server: Server) -> None:
    table = "time_s,anchor_id,range_m,duration_s,wheel_x_m,wheel_y_m,heading_deg\n1,A,10.5,,,,\n1,B,nan,,,,\n"
    table += "2,,,1,0.5,0,90\n2,A,11,,,,\n"
    found = ask(server, "drive.csv", table.encode())
    first, second = found["epochs"]
    assert [(one["anchor_id"], one["range_m"]) for one in first["ranges"]] == [("A", 10.5), ("B", None)]
    assert (first["time_s"], first["odometry"], second["time_s"]) == (1.0, None, 2.0)
    assert (second["odometry"]["wheel_m"], second["odometry"]["heading_deg"]) == ([0.5, 0.0], pytest.approx(90.0))
    anchors = [
        {"id": name, "east_m": east_m, "north_m": 0.0, "altitude_m": 1.0} for name, east_m in (("A", 0.0), ("B", 9.0))
    ]
    session = server.client.post("/detectors", json={"anchors": anchors}).json()["links"]
    judged = server.client.post(session["epochs"], json={"epochs": found["epochs"]})
    assert judged.status_code == 200, judged.text
    assert [answer["time_s"] for answer in judged.json()["answers"]] == [1.0, 2.0]
    server.client.delete(session["self"])


@pytest.mark.parametrize("recorded", [dataflash, mcap_json, ros1_bag])
def test_what_robots_record_is_read_by_what_it_holds(
    server: Server, tmp_path: Path, recorded: Callable[[Path], Path]
) -> None:
    path = recorded(tmp_path / "drive")
    found = ask(server, path.name, path.read_bytes())
    ranges = [sorted(one["range_m"] for one in epoch["ranges"]) for epoch in found["epochs"]]
    told = [sorted(of_anchors.values()) for _, of_anchors in moments()]
    assert len(ranges) == len(told)
    for ours, true in zip(ranges, told, strict=True):
        assert ours == pytest.approx(true, abs=0.006)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("anchors.csv", b"id,east_m\nD1,3\n", "range"),
        ("lines.jsonl", b'{"time_s": 1.0}\n', "line 1"),
        ("empty.csv", b"", "empty"),
    ],
)
def test_what_is_no_log_is_refused_with_a_sentence(server: Server, name: str, content: bytes, says: str) -> None:
    answer = server.client.post("/range-logs", files={"file": (name, content)})
    assert answer.status_code in (400, 422), answer.text
    assert says in answer.json()["detail"]
