"""A published drive, indoors among four anchors: Python, command line, WebSocket and HTTP give the same verdicts."""

from __future__ import annotations

import csv
import json
import math
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.client import connect

from benchmarks.detection.ranging_logs import write_labyrinth
from detection import Detector, DetectorSettings, RangeEpoch, RangingAnchor
from service.files.range_log import read_range_log
from service.live.answers import as_json, epoch_answer
from service.live.epoch_logs import epochs_of
from tests.service.running import Server

LABYRINTH = Path(__file__).parents[3] / "shared" / "data" / "ranging" / "labyrinth"
SETTINGS = {"dimension": 2, "range_sigma_m": 0.1, "max_speed_m_per_s": 1.0}
WHOLE_ROUND_S = 0.6

pytestmark = pytest.mark.skipif(not LABYRINTH.is_dir(), reason="the Labyrinth data set lies in ../shared/data only")


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("labyrinth")
    write_labyrinth(LABYRINTH, folder)
    return folder


def message(epoch: RangeEpoch) -> dict[str, Any]:
    """The epoch as a client writes it."""
    written: dict[str, Any] = {
        "time_s": epoch.time_s,
        "ranges": [
            {"anchor_id": r.anchor_id, "range_m": r.range_m, "sigma_m": r.sigma_m, "time_s": r.time_s}
            for r in epoch.ranges
        ],
    }
    if epoch.odometry is not None:
        written["odometry"] = {"duration_s": epoch.odometry.duration_s, "wheel_m": epoch.odometry.wheel_m}
    return written


@pytest.mark.parametrize("epoch_s", [0.0, WHOLE_ROUND_S], ids=["range by range", "round by round"])
def test_every_way_in_gives_the_same_verdicts(server: Server, drive: Path, tmp_path: Path, epoch_s: float) -> None:
    with (drive / "anchors.csv").open(encoding="utf-8") as file:
        places = [(row["id"], float(row["east_m"]), float(row["north_m"])) for row in csv.DictReader(file)]
    epochs = epochs_of(read_range_log(drive / "log.csv").rows, epoch_s)
    assert sum(len(epoch.ranges) for epoch in epochs) == 233
    assert sum(epoch.odometry is not None for epoch in epochs) >= len(epochs) - 1

    detector = Detector([RangingAnchor(*place) for place in places], DetectorSettings(**SETTINGS))
    here = [detector.process(epoch) for epoch in epochs]
    here_told = [json.loads(as_json(epoch_answer(result))) for result in here]

    anchors = [dict(zip(("id", "east_m", "north_m"), place, strict=True)) for place in places]
    sessions = [
        server.client.post("/detectors", json={"anchors": anchors, "settings": SETTINGS}).headers["Location"]
        for _ in range(2)
    ]
    with connect(f"{server.url.replace('http', 'ws')}{sessions[0]}/stream", proxy=None) as stream:
        by_stream = []
        for epoch in epochs:
            stream.send(json.dumps(message(epoch)))
            by_stream.append(json.loads(stream.recv(timeout=20)))
    assert by_stream == here_told

    posted = server.client.post(f"{sessions[1]}/epochs", json={"epochs": [message(epoch) for epoch in epochs]})
    assert posted.json()["answers"] == here_told
    for session in sessions:
        assert server.client.get(session).json()["state"]["epochs"] == len(epochs)
        server.client.delete(session)

    options = ["--dimension", "2", "--range-sigma", "0.1", "--max-speed", "1", "--epoch", str(epoch_s)]
    files = [str(drive / "log.csv"), "--anchors", str(drive / "anchors.csv"), "--out", str(tmp_path)]
    subprocess.run([sys.executable, "-m", "service.cli", "detect", *files, *options], check=True, capture_output=True)
    with (tmp_path / "verdicts.csv").open(encoding="utf-8", newline="") as file:
        by_command = list(csv.DictReader(file))
    verdicts = [verdict for result in here for verdict in result.verdicts]
    assert len(by_command) == len(verdicts) == 233
    for row, verdict in zip(by_command, verdicts, strict=True):
        assert (row["anchor_id"], row["sight"], row["reason"]) == (verdict.anchor_id, verdict.sight, verdict.reason)
        for name in ("probability", "confidence", "score", "excess_m"):
            expected = getattr(verdict, name)
            told = float(row[name])
            assert math.isnan(told) if math.isnan(expected) else told == pytest.approx(expected, rel=1e-5, abs=1e-12)
