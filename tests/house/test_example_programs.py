"""The programs in examples/ run as they stand, and the rover's client stays as short as it promises to be."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
import threading
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore
from websockets.sync.client import connect

from service.cli.own_service import running_service
from service.live.request import ANCHORS, RANGES
from tests.house.repository import ROOT

EXAMPLES = ROOT / "examples"
OURS = ("detection", "planning", "service", "terrain", "visibility", "navigation")


def ran(name: str, *arguments: str) -> str:
    command = [sys.executable, "-W", "error", str(EXAMPLES / name), *arguments]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_every_example_is_run_here() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == {"dashboard.py", "replay.py", "ros2_node.py", "rover.py"}


@pytest.mark.timeout(600)
def test_a_rover_drives_on_what_the_service_answers(tmp_path: Path) -> None:
    with running_service(tmp_path) as client:
        said = ran("rover.py", str(client.base_url).rstrip("/"))
    assert said.count("The map foretold: D1 ") == 5
    assert "none occluded" in said
    assert said.endswith("map doubts: 0\n")


def test_the_rover_needs_nothing_of_ours_and_fewer_than_fifty_lines() -> None:
    text = (EXAMPLES / "rover.py").read_text(encoding="utf-8")
    assert len(text.splitlines()) < 50
    assert not any(f"import {name}" in text or f"from {name}" in text for name in OURS)


def test_a_log_is_replayed_over_a_map() -> None:
    said = ran("replay.py")
    assert "occluded: A1, A2, A3" in said
    assert said.endswith("map doubts: 0\n")


def loaded(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_node_says_in_ros_what_the_stream_answers(tmp_path: Path) -> None:
    """All but rclpy: messages of ROS 2 to an epoch, through a session, and back to a message that ROS can send."""
    node, store = loaded("ros2_node"), get_typestore(Stores.ROS2_HUMBLE)
    kinds = store.types
    names = [f"geometry_msgs/msg/{one}" for one in ("Vector3", "Point", "Quaternion", "Pose", "PoseWithCovariance")]
    vector, point, quaternion, pose, pose_with_covariance = (kinds[name] for name in names)
    zero, level = vector(0.0, 0.0, 0.0), quaternion(0.0, 0.0, 0.0, 1.0)

    def header(second: int, frame: str = "") -> object:
        return kinds["std_msgs/msg/Header"](kinds["builtin_interfaces/msg/Time"](100 + second, 500_000_000), frame)

    def odometry(second: int) -> object:
        at = pose_with_covariance(pose(point(1.0 * second, 0.0, 0.0), level), np.zeros(36))
        twist = kinds["geometry_msgs/msg/TwistWithCovariance"](
            kinds["geometry_msgs/msg/Twist"](zero, zero), np.zeros(36)
        )
        return kinds["nav_msgs/msg/Odometry"](header(second), "base_link", at, twist)

    def ranges(second: int) -> list[dict[str, object]]:
        made = kinds["sensor_msgs/msg/Range"]
        return [
            node.range_of(made(header(second), 0, 0.1, 0.1, 900.0, one["range_m"]), f"/uwb/{one['anchor_id']}/range")
            for one in RANGES
        ]

    silent = kinds["sensor_msgs/msg/Range"](header(0, "D1"), 0, 0.1, 0.1, 900.0, math.inf)
    assert node.range_of(silent, "/uwb/other/range") == {"anchor_id": "D1", "range_m": None, "time_s": 100.5}
    with running_service(tmp_path) as client:
        links = client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().json()["links"]
        address = str(client.base_url).replace("http", "ws", 1).rstrip("/") + links["stream"]
        with connect(address, proxy=None) as stream:
            for second in range(3):
                motion = node.moved_between(odometry(second - 1), odometry(second)) if second else None
                stream.send(json.dumps(node.epoch_of(ranges(second), motion)))
                answer = json.loads(stream.recv())
                assert answer["time_s"] == 100.5 + second
    assert motion == {"duration_s": 1.0, "wheel_m": [1.0, 0.0]}
    told = node.pose_of(answer)
    covariance = np.array(told["covariance"])
    filled = pose_with_covariance(pose(point(**told["position"]), level), covariance)
    message = kinds["geometry_msgs/msg/PoseWithCovarianceStamped"](header(2, "map"), filled)
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    back = store.deserialize_cdr(store.serialize_cdr(message, kind), kind).pose
    assert (back.pose.position.x, back.pose.position.z) == (
        answer["position"]["east_m"],
        answer["position"]["altitude_m"],
    )
    assert np.array_equal(back.covariance.reshape(6, 6)[:3, :3], answer["position"]["covariance_m2"])
    (hidden,) = (one for one in answer["verdicts"] if one["occluded"])
    said = {"planning": "degraded", "excluded": ["D4"], "excess_m": {"D4": hidden["excess_m"]}}
    assert json.loads(node.verdicts_of(answer)) == said
    assert node.pose_of({**answer, "position": None}) is None


@pytest.mark.timeout(600)
def test_the_dashboard_shows_what_another_client_sends(tmp_path: Path) -> None:
    with running_service(tmp_path) as client:
        detector = client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().json()
        url = str(client.base_url).rstrip("/")
        command = [sys.executable, "-W", "error", str(EXAMPLES / "dashboard.py"), url, detector["id"], "3"]
        watching = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        killer = threading.Timer(120.0, watching.kill)
        killer.start()
        try:
            assert watching.stdout is not None
            assert watching.stdout.readline() == f"watching {detector['id']}\n"
            for second in range(3):
                epochs = {"epochs": [{"time_s": float(second), "ranges": RANGES}]}
                client.post(detector["links"]["epochs"], json=epochs).raise_for_status()
            said, problems = watching.communicate()
        finally:
            killer.cancel()
            watching.kill()
    assert (watching.returncode, problems) == (0, "")
    assert len(said.splitlines()) == 3
    assert said.count("degraded") == 3
    assert said.count("\033[31mD4 ") == 3, "occluded is red"
    assert all(f"\033[32m{anchor['id']} " in said for anchor in ANCHORS if anchor["id"] != "D4")
