"""Lines of JSON over TCP and UDP: what comes is judged and acknowledged, through cuts, garbage and repetition."""

from __future__ import annotations

import json
import math
import random
import socket
import time

import pytest

from detection import EpochResult
from navigation import ConstantVelocityEstimator
from service.errors import RequestError
from service.live.bridges.running import lines_bridge
from service.live.bridges.transports import transport_of
from tests.service.bridges.running import ANCHORS, SETTINGS, Judge, free_port, ranges_m, rover_m, running, site, until


def bridge_at(address, judge=None, round_s=0.25):
    return lines_bridge(site(), address, round_s, judge or Judge())


def connected(port):
    end_s = time.monotonic() + 20.0
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), 5.0)
        except ConnectionRefusedError:
            assert time.monotonic() < end_s
            time.sleep(0.02)


def epoch(second, hidden=(), **more):
    return {"time_s": float(second), "sequence": second, "ranges": ranges_m(second, hidden), **more}


def exchanged(line, reader, *messages):
    """The answers to as many messages."""
    line.sendall(b"".join(m if isinstance(m, bytes) else json.dumps(m).encode() + b"\n" for m in messages))
    return [json.loads(reader.readline()) for _ in messages]


def test_an_epoch_is_answered_by_one_line(tmp_path):
    port = free_port()
    with running(bridge_at(f"tcpin:127.0.0.1:{port}")), connected(port) as line, line.makefile("rb") as reader:
        for second in range(8):
            (told,) = exchanged(line, reader, epoch(second, hidden=("4",)))
        assert (told["sequence"], told["planning"], told["excluded"]) == (7, "degraded", ["4"])
        assert told["occluded"]["4"] == pytest.approx(6.0, abs=0.5)
        assert math.dist(told["position_m"], rover_m(7)) < 1.0
        assert 0.0 < told["sigma_m"] < 1.0


def test_a_filter_that_goes_along_is_told_beside_the_position_and_readings_that_nobody_takes_are():
    port, codec_site = free_port(), site(estimator=ConstantVelocityEstimator(ANCHORS, SETTINGS))
    bridge = lines_bridge(codec_site, f"tcpin:127.0.0.1:{port}", 0.25, Judge())
    with running(bridge), connected(port) as line, line.makefile("rb") as reader:
        for second in range(8):
            (told,) = exchanged(line, reader, epoch(second, hidden=("4",)))
        assert math.dist(told["estimate"]["position_m"], rover_m(7)) < 0.5
        assert 0.0 < told["estimate"]["bubble_m"] < 3.0
        assert len(told["estimate"]["velocity_m_per_s"]) == 3
        imu = {"times_s": [8.0], "forces": [[0.0, 0.0, 9.8]], "rates": [[0.0, 0.0, 0.0]]}
        line.sendall(json.dumps(epoch(8, imu=imu)).encode() + b"\n")
        said = [json.loads(reader.readline()) for _ in range(2)]
        problems = [one["problem"] for one in said if "problem" in one]
        assert problems == ["imu: a bridge takes no inertial readings; a session of the service does."]


def test_ranges_and_motions_in_lines_of_their_own_are_gathered():
    port, judge = free_port(), Judge()
    with running(bridge_at(f"tcpin:127.0.0.1:{port}", judge)), connected(port) as line, line.makefile("rb") as reader:
        for second in range(3):
            moved = {"time_s": float(second), "odometry": {"duration_s": 1.0, "wheel_m": [1.0, 0.0]}}
            line.sendall(json.dumps(moved).encode() + b"\n")
            for name, range_m in ranges_m(second).items():
                told = {"time_s": second + 0.01 * int(name), "anchor_id": name, "range_m": range_m}
                line.sendall(json.dumps(told).encode() + b"\n")
            assert json.loads(reader.readline())["planning"] == "checked"
    assert [len(asked.epoch.ranges) for asked, _ in judge.epochs] == [6, 6, 6]
    assert all(asked.epoch.odometry.wheel_m == (1.0, 0.0) for asked, _ in judge.epochs)


def test_a_round_that_is_not_whole_ends_by_the_clock():
    port, judge = free_port(), Judge()
    with running(bridge_at(f"tcpin:127.0.0.1:{port}", judge)), connected(port) as line, line.makefile("rb") as reader:
        for name, range_m in list(ranges_m(0).items())[:4]:
            line.sendall(json.dumps({"time_s": 0.0, "anchor_id": name, "range_m": range_m}).encode() + b"\n")
        assert json.loads(reader.readline())["time_s"] == 0.0
    assert [len(asked.epoch.ranges) for asked, _ in judge.epochs] == [4]


BAD = {
    "The line is not JSON.": b"\xff\x00garbage\n",
    "range_m: Input should be a valid number": b'{"time_s": 1.0, "anchor_id": "1", "range_m": "far"}\n',
    "time_s: Field required": b'{"ranges": {"1": 5.0}}\n',
    "rangs: this field is not known here": b'{"time_s": 1.0, "ranges": {}, "rangs": 3}\n',
    "A line may have 65536 bytes.": b"x" * 200_000 + b"\n",
}


@pytest.mark.parametrize("sentence", BAD)
def test_a_line_of_no_sense_is_told_and_the_link_goes_on(sentence):
    port = free_port()
    with running(bridge_at(f"tcpin:127.0.0.1:{port}")), connected(port) as line, line.makefile("rb") as reader:
        (told,) = exchanged(line, reader, BAD[sentence])
        assert sentence in told["problem"]
        assert exchanged(line, reader, epoch(0))[0]["sequence"] == 0


def test_an_epoch_sent_again_is_answered_again_and_judged_once():
    port, judge = free_port(), Judge()
    with running(bridge_at(f"tcpin:127.0.0.1:{port}", judge)), connected(port) as line, line.makefile("rb") as reader:
        first = exchanged(line, reader, epoch(0), epoch(1))
        assert exchanged(line, reader, epoch(1), epoch(0)) == [first[1], first[0]]
    assert [asked.key for asked, _ in judge.epochs] == [0, 1]


def test_datagrams_are_lines_too():
    port = free_port(socket.SOCK_DGRAM)
    with running(bridge_at(f"udp:127.0.0.1:{port}")), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        line.settimeout(0.2)
        line.connect(("127.0.0.1", port))

        def answered():
            try:
                line.send(json.dumps(epoch(0)).encode() + b"\n")
                return json.loads(line.recv(4096))["sequence"] == 0
            except (TimeoutError, ConnectionRefusedError):
                return False

        until(answered)


def drive(port, count, cuts, garbage):
    """A sender that keeps an epoch until it is acknowledged: (the answers, how often it connected)."""
    draw = random.Random(5)
    cut_after = set(draw.sample(range(1, count), cuts))
    answers, connections = {}, 0
    second = 0
    while second < count:
        line = connected(port)
        line.settimeout(5.0)
        connections += 1
        with line, line.makefile("rb") as reader:
            while second < count:
                data = json.dumps(epoch(second, hidden=("4",) if second % 100 > 50 else ())).encode() + b"\n"
                if draw.random() < garbage:
                    data = draw.randbytes(draw.randrange(1, 60)).replace(b"\n", b" ") + b"\n" + data
                if second in cut_after:
                    cut_after.discard(second)
                    # in the middle of a line, or before the answer is read
                    line.sendall(data[: draw.choice([len(data) // 2, len(data)])])
                    break
                line.sendall(data)
                told = {}
                while told.get("sequence") != second:
                    told = json.loads(reader.readline())
                answers[second] = told
                second += 1
    return answers, connections


def test_nothing_acknowledged_is_lost_while_the_link_is_cut_and_garbled():
    port, judge = free_port(), Judge()
    bridge = bridge_at(f"tcpin:127.0.0.1:{port}", judge)
    with running(bridge):
        answers, connections = drive(port, 600, cuts=20, garbage=0.2)
    assert connections == 21
    assert sorted(answers) == list(range(600))
    judged: dict[int, EpochResult] = {}
    for asked, result in judge.epochs:
        if result.rejection is None:
            assert asked.key not in judged
            judged[asked.key] = result
    assert judged.keys() == answers.keys()
    assert all(answers[key]["excluded"] == list(result.excluded) for key, result in judged.items())
    assert sum("4" in answers[key]["occluded"] for key in answers) > 200
    assert bridge.bad > 50
    assert bridge.counts.lost == 0


def test_what_too_fast_a_sender_loses_is_told():
    port = free_port()
    bridge = bridge_at(f"tcpin:127.0.0.1:{port}")
    slow = bridge._process

    def process(epoch):
        time.sleep(0.01)
        return slow(epoch)

    bridge._process = process
    with running(bridge), connected(port) as line, line.makefile("rb") as reader:
        line.sendall(b"".join(json.dumps(epoch(second)).encode() + b"\n" for second in range(400)))
        told = [json.loads(reader.readline()) for _ in range(400)]
    lost = {one["sequence"] for one in told if one.get("lost")}
    assert len(lost) == bridge.counts.lost > 0
    assert lost | {one["sequence"] for one in told if not one.get("lost")} == set(range(400))


@pytest.mark.parametrize("address", ["tcp:127.0.0.1", "udp:127.0.0.1:70000", "pigeon:home:1", "serial:/dev/tty0"])
def test_an_address_that_is_none_is_refused(address):
    with pytest.raises(RequestError, match="is no address of a link: take udp:HOST:PORT"):
        transport_of(address)
