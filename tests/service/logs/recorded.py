"""The drive as robots and autopilots record it, written by the libraries of those formats: name to what writes it."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mcap.writer import Writer as McapWriter
from pymavlink.dialects.v20 import all as dialect
from pyulog import ULog
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.service.logs.drive import BEGIN_S, RANGES, SECONDS, moments, place_m

GTEC = "uint8 anchorId\nuint8 tagId\nint32 range\nint32 seq\nfloat64 rss\nfloat64 errorEstimation\n"
NODE2 = "uint8 role\nuint8 id\nfloat32 dis\nfloat32 fp_rssi\nfloat32 rx_rssi\n"
NODEFRAME2 = "uint8 role\nuint8 id\nuint32 local_time\nLinktrackNode2[] nodes\n"
NODEFRAME2 += f"{'=' * 80}\nMSG: nlink_parser/LinktrackNode2\n{NODE2}"
OWN = "std_msgs/Header header\nuint16 responder\nfloat32 distance\n"


def ns(second: float) -> int:
    return round(1e9 * (BEGIN_S + second))


def store(which: Stores, **definitions: str):
    types = get_typestore(which)
    for name, text in definitions.items():
        types.register(get_types_from_msg(text, name.replace("__", "/")))
    return types


def stamp(types, second, frame="map"):
    time = types.types["builtin_interfaces/msg/Time"](*divmod(ns(second), 10**9))
    header = types.types["std_msgs/msg/Header"]
    # that of ROS 1 counts
    return header(0, time, frame) if "seq" in header.__dataclass_fields__ else header(time, frame)


def odometry(types, second):
    """In a frame of its own, turned by a quarter and shifted."""
    east_m, north_m, up_m = place_m(second)
    kind = types.types
    at = kind["geometry_msgs/msg/Point"](north_m - 80.0, 60.0 - east_m, up_m)
    pose = kind["geometry_msgs/msg/Pose"](at, kind["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0))
    zero = kind["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
    covariance = np.zeros(36)
    return kind["nav_msgs/msg/Odometry"](
        stamp(types, second),
        "base_link",
        kind["geometry_msgs/msg/PoseWithCovariance"](pose, covariance),
        kind["geometry_msgs/msg/TwistWithCovariance"](kind["geometry_msgs/msg/Twist"](zero, zero), covariance),
    )


def ros1_bag(path: Path) -> Path:
    types = store(Stores.ROS1_NOETIC, gtec_msgs__msg__Ranging=GTEC)
    path = path.with_suffix(".bag")
    with Writer1(path) as bag:
        ranging = bag.add_connection("/gtec/toa/ranging", "gtec_msgs/msg/Ranging", typestore=types)
        wheels = bag.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=types)
        made = types.types["gtec_msgs/msg/Ranging"]
        for second, ranges in moments():
            bag.write(wheels, ns(second), types.serialize_ros1(odometry(types, second), "nav_msgs/msg/Odometry"))
            for anchor, range_m in ranges.items():
                told = made(anchor, 0, round(1000.0 * range_m), second, -80.0, 0.0)
                bag.write(ranging, ns(second), types.serialize_ros1(told, "gtec_msgs/msg/Ranging"))
    return path


def ros2_ranges(path: Path) -> Path:
    """sensor_msgs/Range on a topic of each anchor, beside odometry."""
    types = store(Stores.ROS2_HUMBLE)
    with Writer2(path, version=9) as bag:
        wheels = bag.add_connection("/odom", "nav_msgs/msg/Odometry", typestore=types)
        topics = {
            anchor: bag.add_connection(f"/uwb/{anchor}/range", "sensor_msgs/msg/Range", typestore=types)
            for anchor in sorted({anchor for _, anchor, _ in RANGES})
        }
        for second, ranges in moments():
            bag.write(wheels, ns(second), types.serialize_cdr(odometry(types, second), "nav_msgs/msg/Odometry"))
            for anchor, range_m in ranges.items():
                told = types.types["sensor_msgs/msg/Range"](stamp(types, second, ""), 0, 0.1, 0.1, 900.0, range_m)
                bag.write(topics[anchor], ns(second), types.serialize_cdr(told, "sensor_msgs/msg/Range"))
    return path


def ros2_nodes(path: Path) -> Path:
    """A list of ranges in each message, in a bag stored as MCAP."""
    types = store(Stores.ROS2_JAZZY, nlink_parser__msg__LinktrackNodeframe2=NODEFRAME2)
    kind = "nlink_parser/msg/LinktrackNodeframe2"
    node, frame = types.types["nlink_parser/msg/LinktrackNode2"], types.types[kind]
    with Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        topic = bag.add_connection("/nlink_linktrack_nodeframe2", kind, typestore=types)
        for second, ranges in moments():
            nodes = [node(1, anchor, range_m, -80.0, -80.0) for anchor, range_m in ranges.items()]
            bag.write(topic, ns(second), types.serialize_cdr(frame(2, 0, 0, nodes), kind))
    return path


def ros2_own(path: Path) -> Path:
    """A message that nobody has heard of, in a file that a recorder of ROS 2 leaves."""
    types = store(Stores.ROS2_HUMBLE, lab_msgs__msg__Uwb=OWN)
    with Writer2(path, version=9) as bag:
        topic = bag.add_connection("/lab/uwb", "lab_msgs/msg/Uwb", typestore=types)
        for second, anchor, range_m in RANGES:
            told = types.types["lab_msgs/msg/Uwb"](stamp(types, second), anchor, range_m)
            bag.write(topic, ns(second + 0.25), types.serialize_cdr(told, "lab_msgs/msg/Uwb"))
    return next(path.glob("*.db3"))


def mcap_json(path: Path) -> Path:
    path = path.with_suffix(".mcap")
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start()
        schema = writer.register_schema("uwb.Range", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/range", "json", schema)
        for second, anchor, range_m in RANGES:
            data = json.dumps({"anchor": str(anchor), "range_mm": 1000.0 * range_m}).encode()
            writer.add_message(channel, ns(second), data, ns(second))
        writer.finish()
    return path


def mcap_ros1(path: Path) -> Path:
    types = store(Stores.ROS1_NOETIC, gtec_msgs__msg__Ranging=GTEC)
    path = path.with_suffix(".mcap")
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start(profile="ros1")
        schema = writer.register_schema("gtec_msgs/Ranging", "ros1msg", GTEC.encode())
        channel = writer.register_channel("/ranging", "ros1", schema)
        for second, anchor, range_m in RANGES:
            told = types.types["gtec_msgs/msg/Ranging"](anchor, 0, round(1000.0 * range_m), second, -80.0, 0.0)
            data = bytes(types.serialize_ros1(told, "gtec_msgs/msg/Ranging"))
            writer.add_message(channel, ns(second), data, ns(second))
        writer.finish()
    return path


def ulog(path: Path, topics: dict[str, tuple[str, list[dict[str, float]]]]) -> Path:
    """Topics with their format and their messages, by pyulog's own writer."""
    log = ULog(None)
    for number, (name, (form, messages)) in enumerate(topics.items()):
        text = f"{name}:{form}".encode()
        log._message_formats[name] = ULog.MessageFormat(text, None)
        header = ULog._MessageHeader()
        header.msg_size = 3 + len(name)
        added = ULog._MessageAddLogged(struct.pack("<BH", 0, number) + name.encode(), header, log._message_formats)
        data = ULog.Data(added)
        data.data = {
            field.field_name: np.array([one[field.field_name] for one in messages]) for field in data.field_data
        }
        log._data_list.append(data)
    path = path.with_suffix(".ulg")
    log.write_ulog(str(path))
    return path


def ulog_beacons(path: Path) -> Path:
    form = "uint64_t timestamp;uint64_t timestamp_sample;double lat;double lon;float range;float range_accuracy;"
    form += "uint8_t beacon_id;"
    ranging = [
        {
            "timestamp": 10**6 * (second + 5),
            "timestamp_sample": 0,
            "lat": 0.0,
            "lon": 0.0,
            "range": range_m,
            "range_accuracy": 0.1,
            "beacon_id": anchor,
        }
        for second, anchor, range_m in RANGES
    ]
    local = [
        {"timestamp": 10**6 * (second + 5), "x": place_m(second)[1], "y": place_m(second)[0], "z": -place_m(second)[2]}
        for second in range(SECONDS)
    ]
    return ulog(
        path,
        {
            "ranging_beacon": (form, ranging),
            "vehicle_local_position": ("uint64_t timestamp;float x;float y;float z;", local),
        },
    )


def ulog_uwb(path: Path) -> Path:
    messages = [{"timestamp": 10**6 * (s + 5), "mac": 9, "mac_dest": a, "distance": r} for s, a, r in RANGES]
    return ulog(path, {"sensor_uwb": ("uint64_t timestamp;uint16_t mac;uint16_t mac_dest;float distance;", messages)})


# as ArduPilot's logger describes messages: type, length, name, format, names of fields (AP_Logger/LogStructure.h)
FORMATS = {
    "FMT": (128, "BBnNZ", "Type,Length,Name,Format,Columns", "<BB4s16s64s"),
    "XKF0": (150, "QBBf", "TimeUS,C,ID,rng", "<QBBf"),
    "VISO": (151, "QQfff", "TimeUS,dt,PosDX,PosDY,conf", "<QQfff"),
}


def dataflash(path: Path) -> Path:
    path = path.with_suffix(".bin")
    with path.open("wb") as file:

        def log(name: str, *values: object) -> None:
            file.write(b"\xa3\x95" + bytes([FORMATS[name][0]]) + struct.pack(FORMATS[name][3], *values))

        for name, (number, form, columns, layout) in FORMATS.items():
            log("FMT", number, 3 + struct.calcsize(layout), name.encode(), form.encode(), columns.encode())
        for second, ranges in moments():
            log("VISO", 10**6 * (second + 5), 10**6, 3.6, 0.1, 90.0)
            for anchor, range_m in ranges.items():
                log("XKF0", 10**6 * (second + 5), 0, anchor, range_m)
    return path


def telemetry(path: Path, *messages: tuple[float, dialect.MAVLink_message]) -> Path:
    """As ground stations write it: microseconds, then the packet; with bytes of a broken one between."""
    path = path.with_suffix(".tlog")
    link = dialect.MAVLink(None, srcSystem=1)
    with path.open("wb") as file:
        for number, (second, message) in enumerate(messages):
            file.write(struct.pack(">Q", ns(second) // 1000) + message.pack(link))
            file.write(b"\xfd\x09broken" if number == 7 else b"")
    return path


def tlog_beacons(path: Path) -> Path:
    messages = [
        (s, dialect.MAVLink_ranging_beacon_message(0, 0, 0, a, round(1000 * r), 0, 0, 0.0, 0, 0, 0, 0, 100, s % 256, 0))
        for s, a, r in RANGES
    ]
    moved = [(s, dialect.MAVLink_wheel_distance_message(0, 2, [3.6 * s, 3.7 * s, *14 * [0.0]])) for s in range(SECONDS)]
    return telemetry(path, *sorted([*messages, *moved], key=lambda one: one[0]))


def tlog_distances(path: Path) -> Path:
    radio = dialect.MAV_DISTANCE_SENSOR_RADAR
    messages = [
        (s, dialect.MAVLink_distance_sensor_message(0, 10, 65000, round(100 * r), radio, a, 0, 255))
        for s, a, r in RANGES
    ]
    return telemetry(path, *messages)


RECORDED: dict[str, Callable[[Path], Path]] = {
    "ROS 1 bag": ros1_bag,
    "ROS 2 bag, a topic for each anchor": ros2_ranges,
    "ROS 2 bag in MCAP, a list in each message": ros2_nodes,
    "ROS 2 file, a message of one's own": ros2_own,
    "MCAP with JSON": mcap_json,
    "MCAP with messages of ROS 1": mcap_ros1,
    "PX4 ULog, ranging_beacon": ulog_beacons,
    "PX4 ULog, sensor_uwb": ulog_uwb,
    "DataFlash": dataflash,
    "telemetry, RANGING_BEACON": tlog_beacons,
    "telemetry, DISTANCE_SENSOR": tlog_distances,
}
