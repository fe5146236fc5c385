"""``sightline bridge``: it runs until it is stopped, tells how it went, and records what detect replays."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time

import pytest

from tests.service.bridges.running import PLACES, free_port, ranges_m

TEXTS = [word for name, (e, n, u) in PLACES.items() for word in ("--anchor", f"{name},{e},{n},{u}msl")]
ADDRESS = "tcpin:127.0.0.1:1"


@pytest.mark.timeout(120)
def test_a_bridge_records_what_detect_replays(tmp_path, sightline):
    port, record = free_port(), tmp_path / "record.jsonl"
    command = [sys.executable, "-m", "service.cli", "bridge", "lines", f"tcpin:127.0.0.1:{port}", *TEXTS]
    run = subprocess.Popen([*command, "--record", str(record)], stderr=subprocess.PIPE, text=True, env=os.environ)
    try:
        end_s = time.monotonic() + 60.0
        while True:
            try:
                line = socket.create_connection(("127.0.0.1", port), 5.0)
                break
            except ConnectionRefusedError:
                assert time.monotonic() < end_s
                time.sleep(0.05)
        with line, line.makefile("rb") as reader:
            for second in range(12):
                told = {"time_s": float(second), "ranges": ranges_m(second, hidden=("4",) if second > 5 else ())}
                line.sendall(json.dumps(told).encode() + b"\n")
                live = json.loads(reader.readline())
        run.send_signal(signal.SIGTERM)
        assert run.wait(30.0) == 0
    finally:
        run.kill()
        said = run.communicate()[1]
    assert "12 epochs, 72 ranges, 6 occluded, 12 positions; 0 epochs and 0 messages lost, 0 bad, 0 cuts." in said
    assert live["excluded"] == ["4"]
    ended = sightline("detect", record, *TEXTS, "--json")
    assert ended.code == 0, ended.stderr
    assert json.loads(ended.stdout)["classifications"] == {"none": 6, "single": 6}


BAD_LINES = [
    (["lines", "tcp:nowhere", *TEXTS], "is no address of a link: take udp:HOST:PORT"),
    (["lines", ADDRESS], "At least one anchor is needed"),
    (["lines", ADDRESS, *TEXTS, "--round", "0"], "--round must be a number of seconds > 0"),
    (["lines", ADDRESS, *TEXTS, "--crs", "EPSG:4326"], "a grid needs metres east and north"),
    (["mavlink", ADDRESS, *TEXTS, "--beacon", "7"], "--beacon '7' is not of the form NUMBER=ID"),
    (["mavlink", ADDRESS, *TEXTS, "--beacon", "7=D9"], "There is no anchor 'D9'"),
    (["mavlink", ADDRESS, *TEXTS, "--drone", "x=1"], "--drone takes the number of a MAVLink system"),
    (["mavlink", ADDRESS, *TEXTS, "--position", "pigeon"], "'pigeon' is not one of"),
    (["lines", ADDRESS, *TEXTS, "--estimator", "inertial"], "--estimator"),
    (["mavlink", ADDRESS, *TEXTS, "--calibrate", "offset"], "No such option: --calibrate"),
    (["pigeon", ADDRESS], "No such command: pigeon"),
]


@pytest.mark.parametrize(("words", "sentence"), BAD_LINES)
def test_a_bridge_that_leads_nowhere_is_refused_in_a_sentence(sightline, words, sentence):
    sightline("bridge", *words).refused(sentence)
