"""Just enough of rclpy for one node: messages of real ROS 2 types, which must survive their wire format."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from queue import Queue
from types import ModuleType
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

__all__ = ["FakeNode", "fake_ros2", "message"]

STORE = get_typestore(Stores.ROS2_HUMBLE)
KINDS = (
    "builtin_interfaces/msg/Time", "geometry_msgs/msg/PoseWithCovarianceStamped", "nav_msgs/msg/Odometry",
    "sensor_msgs/msg/Range", "std_msgs/msg/String",
)  # fmt: skip
BLANK = {"string": "", "float32": 0.0, "float64": 0.0}


def message(kind: str, **given: Any) -> Any:
    """A message as ROS makes it: every field there, and zero where it was not given."""
    told = {name: _blank(shape) for name, shape in STORE.fielddefs[kind][1]}
    assert given.keys() <= told.keys(), f"{kind} has no {given.keys() - told.keys()}"
    return STORE.types[kind](**{**told, **given})


def _blank(shape: Any) -> Any:
    node, of = shape
    if node is Nodetype.NAME:
        return message(of)
    if node is Nodetype.ARRAY:
        return np.zeros(of[1])
    return BLANK.get(of[0], 0)


def _settled(kind: str, told: Any) -> Any:
    """The message as whoever subscribes gets it. Raises where a field is none of its type's."""
    fields = {name for name, _ in STORE.fielddefs[kind][1]}
    assert vars(told).keys() - {"__msgtype__"} == fields, f"{kind}: {vars(told).keys() ^ fields}"
    if kind == "geometry_msgs/msg/PoseWithCovarianceStamped":
        told.pose.covariance = np.array(told.pose.covariance, np.float64)
        assert all(isinstance(getattr(told.pose.pose.position, axis), float) for axis in "xyz")
    return STORE.deserialize_cdr(STORE.serialize_cdr(told, kind), kind)


@dataclass
class Publisher:
    kind: str
    sent: Queue[Any] = field(default_factory=Queue)

    def publish(self, told: Any) -> None:
        self.sent.put(_settled(self.kind, told))


class FakeNode:
    """What the node under test asks of rclpy.node.Node; the test drives it."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.publishers: dict[str, Publisher] = {}
        self.subscriptions: dict[str, Callable[[Any], None]] = {}
        self.timers: list[Callable[[], None]] = []
        self.warnings: list[str] = []

    def create_publisher(self, kind: partial[Any], topic: str, depth: int) -> Publisher:
        assert depth > 0
        return self.publishers.setdefault(topic, Publisher(kind.args[0]))

    def create_subscription(self, kind: partial[Any], topic: str, callback: Callable[[Any], None], qos: object) -> None:
        assert kind.args[0] in KINDS
        assert qos == "sensor data", "what a sensor sends best effort, a reliable subscription never gets"
        self.subscriptions[topic] = callback

    def create_timer(self, period_s: float, callback: Callable[[], None]) -> None:
        assert period_s > 0.0
        self.timers.append(callback)

    def get_logger(self) -> FakeNode:
        return self

    def warning(self, told: str) -> None:
        self.warnings.append(told)


@contextmanager
def fake_ros2(spin: Callable[[FakeNode], None]) -> Iterator[None]:
    """rclpy and the packages of its messages, which can be imported meanwhile. spin: takes the place of rclpy.spin."""
    modules = {name: ModuleType(name) for name in ("rclpy", "rclpy.node", "rclpy.qos")}
    told: dict[str, dict[str, object]] = {
        "rclpy": {"init": lambda: None, "spin": spin},
        "rclpy.node": {"Node": FakeNode},
        "rclpy.qos": {"qos_profile_sensor_data": "sensor data"},
    }
    for kind in KINDS:
        package, _, name = kind.split("/")
        for module in (package, f"{package}.msg"):
            modules.setdefault(module, ModuleType(module))
        told.setdefault(f"{package}.msg", {})[name] = partial(message, kind)
    for name, values in told.items():
        vars(modules[name]).update(values)
    before = {name: sys.modules.get(name) for name in modules}
    sys.modules.update(modules)
    try:
        yield
    finally:
        for name, module in before.items():
            if module is None:
                del sys.modules[name]
            else:
                sys.modules[name] = module
