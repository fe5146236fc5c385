"""The ROS 2 node of examples/ as it runs: a made-up rclpy beneath it, a real service over a WebSocket before it."""

from __future__ import annotations

import json
import math
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import pytest

from service.cli.own_service import running_service
from service.live.request import ANCHORS
from tests.house.ros2_fake import FakeNode, fake_ros2, message
from tests.house.test_example_programs import loaded

PATIENCE_S = 60.0


@pytest.fixture(scope="module")
def node() -> ModuleType:
    return loaded("ros2_node")


def stamp(second: float) -> Any:
    return message("builtin_interfaces/msg/Time", sec=100 + int(second), nanosec=500_000_000)


def header(second: float, frame: str = "") -> Any:
    return message("std_msgs/msg/Header", stamp=stamp(second), frame_id=frame)


def range_message(second: float, range_m: float, frame: str = "uwb_tag") -> Any:
    return message("sensor_msgs/msg/Range", header=header(second, frame), min_range=0.1, max_range=900.0, range=range_m)


def odometry(second: float, x: float, y: float, yaw: float) -> Any:
    turned = message("geometry_msgs/msg/Quaternion", z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))
    at = message("geometry_msgs/msg/Pose", position=message("geometry_msgs/msg/Point", x=x, y=y), orientation=turned)
    pose = message("geometry_msgs/msg/PoseWithCovariance", pose=at)
    return message("nav_msgs/msg/Odometry", header=header(second, "odom"), pose=pose)


def rover_m(second: float) -> tuple[float, float, float]:
    """East at 1 m/s, amid the anchors."""
    return (150.0 + second, 180.0, 2.0)


class Proxy:
    """A port of the service whose connections can be cut."""

    def __init__(self, address: tuple[str, int]) -> None:
        self._address, self._ends, self._threads = address, list[socket.socket](), list[threading.Thread]()
        self.listener = socket.create_server(("127.0.0.1", 0))
        self._run(self._accept)

    def cut(self) -> None:
        for end in self._ends:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        self.cut()
        with suppress(OSError):
            self.listener.shutdown(socket.SHUT_RDWR)
        for thread in self._threads:
            thread.join(PATIENCE_S)
        for end in (self.listener, *self._ends):
            end.close()

    def _run(self, what: Callable[..., None], *given: socket.socket) -> None:
        self._threads.append(threading.Thread(target=what, args=given, daemon=True))
        self._threads[-1].start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                client, _ = self.listener.accept()
                service = socket.create_connection(self._address, PATIENCE_S)
                self._ends += [client, service]
                for ends in ((client, service), (service, client)):
                    self._run(self._copy, *ends)

    @staticmethod
    def _copy(source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while block := source.recv(65536):
                sink.sendall(block)
            sink.shutdown(socket.SHUT_RDWR)


@contextmanager
def proxied(client: httpx.Client) -> Iterator[Proxy]:
    proxy = Proxy((client.base_url.host, client.base_url.port or 80))
    try:
        yield proxy
    finally:
        proxy.close()


def test_it_drives_through_a_cut_and_says_in_ros_what_the_stream_answers(node: ModuleType, tmp_path: Path) -> None:
    told: list[Any] = []

    def drive(ros: FakeNode, proxy: Proxy) -> None:
        assert set(ros.subscriptions) == {"/odom", *(f"/uwb/{one['id']}/range" for one in ANCHORS)}
        (close_round,) = ros.timers
        close_round()  # nothing was heard yet, and nothing is sent
        for second in range(6):
            if second == 3:
                proxy.cut()
            ros.subscriptions["/odom"](odometry(second - 0.5, second - 0.5, 0.0, 0.0))
            ros.subscriptions["/odom"](odometry(second, float(second), 0.0, 0.0))
            for one in ANCHORS:
                at_m = (one["east_m"], one["north_m"], one["altitude_m"])
                too_long_m = 8.0 * (one["id"] == "D4")
                heard = range_message(second, math.dist(at_m, rover_m(second)) + too_long_m)
                ros.subscriptions[f"/uwb/{one['id']}/range"](heard)
            close_round()
            said = json.loads(ros.publishers["/sightline/verdicts"].sent.get(timeout=PATIENCE_S).data)
            pose = ros.publishers["/sightline/pose"].sent.get(timeout=PATIENCE_S)
            told.append((said, pose))
        assert len([one for one in ros.warnings if one.startswith("The stream was cut: ")]) >= 1

    with running_service(tmp_path) as client, proxied(client) as proxy:
        detector = client.post("/detectors", json={"anchors": ANCHORS}).raise_for_status().json()
        with fake_ros2(lambda ros: drive(ros, proxy)):
            node.main(f"http://127.0.0.1:{proxy.listener.getsockname()[1]}", detector["id"])
        state = client.get(f"/detectors/{detector['id']}").raise_for_status().json()["state"]
    assert state["epochs"] == 6
    for second, (said, pose) in enumerate(told):
        assert said["time_s"] == 100.5 + second
        assert (said["excluded"], list(said["excess_m"])) == (["D4"], ["D4"])
        assert (pose.header.frame_id, pose.header.stamp.sec, pose.header.stamp.nanosec) == ("map", 100 + second, 5e8)
        at_m = tuple(getattr(pose.pose.pose.position, axis) for axis in "xyz")
        assert math.dist(at_m, rover_m(second)) < 1.0
        covariance = pose.pose.covariance.reshape(6, 6)
        assert 0.0 < covariance[0, 0] < 1.0
        assert (covariance[3:, 3:].diagonal() == node.UNKNOWN).all()


def test_the_frame_of_a_sensor_is_not_taken_for_an_anchor(node: ModuleType) -> None:
    told = node.range_of(range_message(0, 12.0), "D1")
    assert told == {"anchor_id": "D1", "range_m": pytest.approx(12.0), "time_s": 100.5}
    for out_of_reach in (math.inf, math.nan, 0.05, 901.0):
        assert node.range_of(range_message(0, out_of_reach), "D1")["range_m"] is None


@pytest.mark.parametrize(("anchor_id", "topic"), [("D1", "/uwb/D1/range"), ("7-a.b", "/uwb/_7_a_b/range")])
def test_topics_are_names_that_ros_allows(node: ModuleType, anchor_id: str, topic: str) -> None:
    assert node.topic_of(anchor_id) == topic


def test_motion_is_forward_and_to_the_left_however_the_frame_of_odometry_lies(node: ModuleType) -> None:
    for yaw in (0.0, 1.0, -2.5):
        ahead, left = (math.cos(yaw), math.sin(yaw)), (-math.sin(yaw), math.cos(yaw))
        x, y = (3.0 * one + 0.5 * other for one, other in zip(ahead, left, strict=True))
        told = node.moved_between(odometry(1, 10.0, 20.0, yaw), odometry(3, 10.0 + x, 20.0 + y, yaw + 0.3))
        assert told["duration_s"] == 2.0
        assert told["wheel_m"] == pytest.approx([3.0, 0.5])


def test_the_pose_is_the_filters_where_the_session_has_one_and_none_of_two_sides(node: ModuleType) -> None:
    covariance = [[float(10 * row + column) for column in range(6)] for row in range(6)]
    estimate = {"east_m": 1.0, "north_m": 2.0, "altitude_m": 3.0, "covariance": covariance}
    fix = {"east_m": 5, "north_m": 6, "altitude_m": None, "mirror": None, "covariance_m2": [[1.0, 0.5], [0.5, 2.0]]}
    told = node.pose_of({"estimate": estimate, "position": fix})
    assert told["position"] == {"x": 1.0, "y": 2.0, "z": 3.0}
    assert told["covariance"][6:9] == [10.0, 11.0, 12.0]
    level = node.pose_of({"estimate": None, "position": fix})
    assert (level["position"]["z"], level["covariance"][0], level["covariance"][1]) == (0.0, 1.0, 0.5)
    assert level["covariance"][14] == node.UNKNOWN
    assert node.pose_of({"position": {**fix, "mirror": {"east_m": 0.0}}}) is None
    assert node.pose_of({"position": None}) is None
