"""Messages whose meaning is known: of ROS and its UWB drivers, MAVLink, PX4's ULog and ArduPilot's DataFlash."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from .columns import is_anchor, is_range, range_unit_of
from .form import StreamMap
from .messages import MessageLog, Stream, leaves_of, number_at, value_at

__all__ = ["Choice", "choose_streams", "known_map"]

Role = Literal["ranges", "motion", "heading"]
UINT32_MAX = 4294967295.0
NED = 1.0  # MAV_FRAME_LOCAL_NED
DOWNWARD = 25.0  # MAV_SENSOR_ROTATION_PITCH_270: an altimeter
# of sensors that call themselves so, people send ranges to anchors as ranges of a distance sensor
NOT_OPTICAL = (3.0, 4.0)  # MAV_DISTANCE_SENSOR_RADAR, _UNKNOWN


@dataclass(frozen=True, slots=True)
class Known:
    """Of one kind of message; rank: the higher of two that hold the same is taken."""

    role: Role
    rank: int
    fields: dict[str, str]
    units: dict[str, str] = field(default_factory=dict)
    missing: float | None = None


def _ranges(
    rank: int, anchor_id: str, range_m: str, unit: str = "m", sigma: str = "", missing: float | None = None
) -> Known:
    fields = {"anchor_id": anchor_id, "range_m": range_m, **({"sigma_m": sigma} if sigma else {})}
    units = {} if unit == "m" else {name: unit for name in fields if name != "anchor_id"}
    return Known("ranges", rank, fields, units, missing)


def _each(rank: int, paths: Sequence[str], unit: str = "m") -> Known:
    fields = {f"range_m.{number}": path for number, path in enumerate(paths)}
    return Known("ranges", rank, fields, {} if unit == "m" else dict.fromkeys(fields, unit), 0.0)


def _motion(rank: int, names: str, paths: str, **units: str) -> Known:
    return Known("motion", rank, dict(zip(names.split(), paths.split(), strict=True)), units)


def _at(rank: int, place: str) -> Known:
    return _motion(rank, "x_m y_m z_m", " ".join(f"{place}.{axis}" for axis in "xyz"))


OWN, NORTH = "x_m y_m z_m", "north_m east_m down_m"
POSITION = " ".join(f"position[{axis}]" for axis in range(3))
GTEC = _ranges(3, "anchorId", "range", "mm")
UWB = _ranges(3, "mac_dest", "distance")
BEACON = _ranges(4, "beacon_id", "range", sigma="range_accuracy")
KNOWN: dict[str, dict[str, Known]] = {
    "ros": {
        "RangingBeacon": Known(BEACON.role, 4, {**BEACON.fields, "time_s": "timestamp"}, {"time_s": "us"}),
        "SensorUwb": Known("ranges", 3, {**UWB.fields, "time_s": "timestamp"}, {"time_s": "us"}),
        **dict.fromkeys(("Ranging", "GenericRanging", "PozyxRanging", "DWRanging"), GTEC),
        **{f"LinktrackNodeframe{n}": _ranges(3, "nodes[].id", "nodes[].dis", missing=0.0) for n in range(2, 7)},
        "LinktrackTagframe0": _each(3, [f"dis_arr[{n}]" for n in range(8)]),
        "RangeWithCovarianceArrayStamped": _ranges(3, "ranges[].id", "ranges[].range.range"),
        "Range": _ranges(1, "header.frame_id", "range"),
        "Odometry": _at(4, "pose.pose.position"),
        "TwistStamped": _motion(3, "speed_forward_m_per_s speed_left_m_per_s", "twist.linear.x twist.linear.y"),
        "VehicleOdometry": _motion(3, f"{OWN} time_s", f"{POSITION} timestamp", time_s="us"),
        "PoseWithCovarianceStamped": _at(2, "pose.pose.position"),
        "PoseStamped": _at(2, "pose.position"),
        "TransformStamped": _at(1, "transform.translation"),
        "Imu": Known("heading", 1, {"orientation": "orientation"}),
    },
    "mavlink": {
        "RANGING_BEACON": _ranges(4, "beacon_id", "range", "mm", "range_accuracy", UINT32_MAX),
        "DISTANCE_SENSOR": _ranges(1, "id", "current_distance", "cm"),
        "WHEEL_DISTANCE": _motion(5, "travelled_m", "distance"),
        "ODOMETRY": _motion(4, OWN, "x y z"),
        "VISION_POSITION_DELTA": _motion(
            3, "forward_m left_m duration_s", "position_delta[0] position_delta[1] time_delta_usec", duration_s="us"
        ),
        "VISION_POSITION_ESTIMATE": _motion(2, OWN, "x y z"),
        "LOCAL_POSITION_NED": _motion(1, NORTH, "x y z"),
        "ATTITUDE": Known("heading", 1, {"heading_deg": "yaw"}, {"heading_deg": "rad"}),
    },
    "ulog": {
        "ranging_beacon": BEACON,
        "sensor_uwb": UWB,
        "uwb_distance": _each(2, [f"anchor_distance[{n}]" for n in range(12)], "cm"),
        "vehicle_visual_odometry": _motion(3, OWN, POSITION),
        "vehicle_local_position": _motion(1, NORTH, "x y z"),
    },
    "dataflash": {
        "XKF0": _ranges(3, "ID", "rng"),
        "NKF0": _ranges(2, "ID", "rng"),
        "BCN": _each(4, [f"D{n}" for n in range(4)]),
        "WENC": _motion(5, "travelled_m", "Dist0,Dist1"),
        "VISO": _motion(3, "forward_m left_m", "PosDX PosDY"),
        "VISP": _motion(2, OWN, "PX PY PZ"),
        "XKF1": _motion(1, NORTH, "PN PE PD"),
        "ATT": Known("heading", 1, {"heading_deg": "Yaw"}),
    },
}
# of these packages and kinds no message that is not listed above holds ranges to anchors
NO_RANGES = ("sensor_msgs/", "nav_msgs/", "geometry_msgs/", "std_msgs/", "tf2_msgs/", "visualization_msgs/")
ESTIMATES = ("LOCAL_POSITION_NED", "vehicle_local_position", "XKF1")


@dataclass(frozen=True, slots=True)
class Choice:
    """The streams that are taken for what, and what was decided, in sentences."""

    maps: tuple[StreamMap, ...]
    told: tuple[str, ...]


def known_map(family: str, stream: Stream) -> tuple[int, StreamMap] | None:
    """What the messages of a stream are taken for, with its rank; None for those of which nothing is known."""
    short = stream.kind.rsplit("/", 1)[-1]
    known = KNOWN.get(family, {}).get(short)
    if known is None and family == "ros" and not stream.kind.startswith(NO_RANGES):
        known = _by_its_fields(stream)
    if known is None or (short == "DISTANCE_SENSOR" and not _may_be_of_anchors(stream)):
        return None
    fields = dict(known.fields)
    if short == "ODOMETRY" and number_at(stream.first, "frame_id") == NED:
        fields = dict(zip(NORTH.split(), ["x", "y", "z"], strict=True))
    if family == "ros" and "time_s" not in fields and (number_at(stream.first, "header.stamp") or 0.0) > 0.0:
        fields["time_s"] = "header.stamp"
    if short == "Range" and not value_at(stream.first, "header.frame_id"):
        fields["anchor_id"] = "@stream"
    if short == "Imu" and number_at(stream.first, "orientation_covariance[0]") == -1.0:
        return None  # it says that it knows no orientation
    made = StreamMap(stream=stream.name, role=known.role, fields=fields, units=known.units, missing=known.missing)
    return known.rank, made


def _may_be_of_anchors(stream: Stream) -> bool:
    kind, facing = number_at(stream.first, "type"), number_at(stream.first, "orientation")
    return kind in NOT_OPTICAL and facing != DOWNWARD


def _by_its_fields(stream: Stream) -> Known | None:
    """By the names of what it holds: one range, and one id of an anchor."""
    leaves = [(path, path.rstrip("[]").rsplit(".", 1)[-1], value) for path, value in leaves_of(stream.first)]
    measured = [path for path, name, value in leaves if is_range(name) and not isinstance(value, str)]
    best = max((is_anchor(name) for _, name, _ in leaves), default=0)
    named = [path for path, name, _ in leaves if best and is_anchor(name) == best]
    if len(measured) != 1 or len(named) != 1:
        return None
    return _ranges(2, named[0], measured[0], range_unit_of(measured[0].rsplit(".", 1)[-1]) or "m")


def choose_streams(log: MessageLog) -> Choice:
    """Of the streams of a log those that are taken: all ranges of the best kind, the best motion, the best heading."""
    found = [
        (rank, stream, made) for stream in log.streams if (one := known_map(log.family, stream)) for rank, made in [one]
    ]
    taken: list[StreamMap] = []
    told: list[str] = []
    for role in ("ranges", "motion", "heading"):
        mine = sorted((one for one in found if one[2].role == role), key=lambda one: -one[0])
        if not mine:
            continue
        best = mine[0]
        chosen = [one for one in mine if one[0] == best[0] and role == "ranges"] or [best]
        taken += [one[2] for one in chosen]
        left = [one[1].name for one in mine if one not in chosen]
        names = ", ".join(one[1].name for one in chosen[:4])
        told.append(f"Taken for {role}: {names}{' …' if len(chosen) > 4 else ''}." + _beside(left))
        if best[1].name in ESTIMATES:
            told.append(f"{best[1].name} is an estimate of the autopilot, which may have used the same ranges.")
    if any(one.role == "heading" for one in taken):
        told.append("Headings are taken as from north; where a sensor knows none: --set heading_offset_sigma_deg=180.")
    return Choice(tuple(taken), tuple(told))


def _beside(left: Sequence[str]) -> str:
    return f" {', '.join(left[:4])} would do as well: --map." if left else ""
