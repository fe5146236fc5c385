"""A ROS 2 node: ranges and odometry to a session of the service, its position and verdicts back as messages.

    python examples/ros2_node.py http://127.0.0.1:8000 DETECTOR_ID    (with SIGHTLINE_KEY where a key is needed)

Subscribed to: /uwb/ID/range (sensor_msgs/Range) for each anchor of the session, and /odom (nav_msgs/Odometry).
Published: /sightline/pose (geometry_msgs/PoseWithCovarianceStamped), /sightline/verdicts (std_msgs/String). What each
holds is told in docs/logs-and-links.md; rclpy comes with ROS. The stream has a thread of its own: no callback waits for
it, an epoch that was not answered is sent again after a cut, and of more than 64 that wait the oldest are given up.
"""

import json
import math
import os
import queue
import re
import sys
import threading
from collections.abc import Iterable

POSE_SIZE = 6  # of a covariance in ROS: x, y, z and three rotations
UNKNOWN = 1e6  # a variance of what ranges do not tell
ROUND_S, AGAIN_S, PATIENCE_S, MOST_WAITING = 0.25, 1.0, 10.0, 64


def seconds(stamp) -> float:
    """Seconds of a builtin_interfaces/Time."""
    return stamp.sec + 1e-9 * stamp.nanosec


def topic_of(anchor_id: str) -> str:
    """Where the ranges of an anchor are published: names in ROS have letters, digits and underscores alone."""
    name = re.sub(r"\W", "_", anchor_id, flags=re.ASCII)
    return f"/uwb/{'_' if name[0].isdigit() else ''}{name}/range"


def range_of(message, anchor_id: str) -> dict:
    """A sensor_msgs/Range as the stream takes it; null where it is out of reach."""
    in_reach = math.isfinite(message.range) and message.min_range <= message.range <= message.max_range
    range_m = message.range if in_reach else None
    return {"anchor_id": anchor_id, "range_m": range_m, "time_s": seconds(message.header.stamp)}


def moved_between(before, after) -> dict:
    """The motion between two nav_msgs/Odometry: forward and to the left, for their frame knows no north."""
    one, other, turned = before.pose.pose.position, after.pose.pose.position, before.pose.pose.orientation
    yaw = math.atan2(
        2.0 * (turned.w * turned.z + turned.x * turned.y), 1.0 - 2.0 * (turned.y * turned.y + turned.z * turned.z)
    )
    x, y = other.x - one.x, other.y - one.y
    forward, left = x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw)
    return {"duration_s": seconds(after.header.stamp) - seconds(before.header.stamp), "wheel_m": [forward, left]}


def epoch_of(ranges: Iterable[dict], motion: dict | None) -> dict:
    """An epoch for the stream: ranges of one round, the last one's time, and the motion since the round before."""
    listed = list(ranges)
    epoch = {"time_s": max(one["time_s"] for one in listed), "ranges": listed}
    return epoch if motion is None or motion["duration_s"] <= 0.0 else {**epoch, "odometry": motion}


def pose_of(answer: dict) -> dict | None:
    """position (x east, y north, z up) and covariance (36) of a pose; None where there is none, or one of two sides.

    Of the session's filter where it has one, else of the epoch's ranges.
    """
    estimate, fix = answer.get("estimate"), answer.get("position")
    if estimate is None and (fix is None or fix["mirror"] is not None):
        return None
    place, rows = (fix, fix["covariance_m2"]) if estimate is None else (estimate, estimate["covariance"][:3])
    covariance = [UNKNOWN if row == column else 0.0 for row in range(POSE_SIZE) for column in range(POSE_SIZE)]
    for row, values in enumerate(rows):
        told = values[:3]
        covariance[row * POSE_SIZE : row * POSE_SIZE + len(told)] = map(float, told)
    at = (place["east_m"], place["north_m"], place["altitude_m"] or 0.0)
    return {"position": dict(zip("xyz", map(float, at), strict=True)), "covariance": covariance}


def verdicts_of(answer: dict) -> str:
    """What /sightline/verdicts says: when, planning, excluded, and by how much each range is too long."""
    excess_m = {one["anchor_id"]: one["excess_m"] for one in answer["verdicts"] if one["occluded"]}
    told = {name: answer[name] for name in ("time_s", "planning", "excluded")}
    return json.dumps({**told, "excess_m": excess_m})


def talk(url: str, stream_path: str, headers: dict, waiting: queue.Queue, heard, warn) -> None:
    """Send what waits, hand each answer to ``heard``; for good, whatever happens to the connection. None ends it."""
    from websockets.exceptions import WebSocketException
    from websockets.sync.client import connect

    address, epoch = url.replace("http", "ws", 1).rstrip("/") + stream_path, waiting.get()
    while epoch is not None:
        try:
            with connect(address, proxy=None, additional_headers=headers) as stream:
                while epoch is not None:
                    stream.send(json.dumps(epoch))
                    answer = json.loads(stream.recv(timeout=PATIENCE_S))
                    if "problem" in answer:
                        warn(answer["problem"]["detail"])
                    elif answer["rejection"] != "duplicate epoch":  # whose answer a cut had swallowed
                        heard(answer)
                    epoch = waiting.get()
        except (OSError, WebSocketException) as error:  # also a TimeoutError
            warn(f"The stream was cut: {error}; again in {AGAIN_S:g} s.")
            threading.Event().wait(AGAIN_S)


def main(url: str, detector_id: str) -> None:
    """Run the node."""
    import httpx
    import rclpy
    from builtin_interfaces.msg import Time
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Odometry
    from rclpy.node import Node
    from rclpy.qos import qos_profile_sensor_data
    from sensor_msgs.msg import Range
    from std_msgs.msg import String

    headers = {"Authorization": f"Bearer {key}"} if (key := os.environ.get("SIGHTLINE_KEY")) else {}
    got = httpx.get(f"{url.rstrip('/')}/detectors/{detector_id}", trust_env=False, headers=headers)
    session = got.raise_for_status().json()
    rclpy.init()
    node = Node("sightline")
    warn = node.get_logger().warning
    poses = node.create_publisher(PoseWithCovarianceStamped, "/sightline/pose", 10)
    verdicts = node.create_publisher(String, "/sightline/verdicts", 10)
    waiting, ranges, odometry = queue.Queue(), {}, []

    def publish(answer: dict) -> None:
        verdicts.publish(String(data=verdicts_of(answer)))
        pose = pose_of(answer)
        if pose is not None:
            message, nanoseconds = PoseWithCovarianceStamped(), round(answer["time_s"] * 1e9)
            message.header.frame_id = "map"
            message.header.stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
            for axis, metres in pose["position"].items():
                setattr(message.pose.pose.position, axis, metres)
            message.pose.covariance = pose["covariance"]
            poses.publish(message)

    def close_round() -> None:
        if not ranges:
            return
        motion = moved_between(odometry[0], odometry[-1]) if len(odometry) > 1 else None
        waiting.put(epoch_of(ranges.values(), motion))
        ranges.clear()
        del odometry[:-1]
        while waiting.qsize() > MOST_WAITING:
            warn(f"{MOST_WAITING} epochs wait: the one of {waiting.get()['time_s']:.2f} s is given up.")

    def hear(message: Range, anchor_id: str) -> None:
        ranges[anchor_id] = range_of(message, anchor_id)

    def drive(message: Odometry) -> None:
        odometry[1:] = [message]  # the first since the last round, and the latest

    for anchor_id in session["anchors"]:
        told = topic_of(anchor_id)
        node.create_subscription(Range, told, lambda one, its=anchor_id: hear(one, its), qos_profile_sensor_data)
    node.create_subscription(Odometry, "/odom", drive, qos_profile_sensor_data)
    node.create_timer(ROUND_S, close_round)
    stream = (url, session["links"]["stream"], headers, waiting, publish, warn)
    talking = threading.Thread(target=talk, args=stream, daemon=True)
    talking.start()
    try:
        rclpy.spin(node)
    finally:
        waiting.put(None)
        talking.join(PATIENCE_S)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
