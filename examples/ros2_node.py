"""A ROS 2 node: ranges and odometry to a session of the service, its position and verdicts back as messages.

    python examples/ros2_node.py http://127.0.0.1:8000 DETECTOR_ID

It subscribes to sensor_msgs/Range on /uwb/ID/range for each anchor of the session (the id is the frame_id, if there is
one) and to nav_msgs/Odometry on /odom. It publishes geometry_msgs/PoseWithCovarianceStamped on /sightline/pose and
std_msgs/String on /sightline/verdicts. What is sent and answered is told in docs/detection-service.md; rclpy comes with
ROS.
"""

import json
import math
import os
import sys
from collections.abc import Iterable

POSE_SIZE = 6  # of a covariance in ROS: x, y, z and three rotations
UNKNOWN = 1e6  # a variance of what ranges do not tell
ROUND_S = 0.25


def seconds(stamp) -> float:
    """Seconds of a builtin_interfaces/Time."""
    return stamp.sec + 1e-9 * stamp.nanosec


def range_of(message, topic: str) -> dict:
    """A sensor_msgs/Range as the stream takes it; the anchor is its frame_id, else the topic's part before /range."""
    anchor_id = message.header.frame_id or topic.rstrip("/").split("/")[-2]
    in_reach = message.min_range <= message.range <= message.max_range
    range_m = message.range if in_reach and math.isfinite(message.range) else None
    return {"anchor_id": anchor_id, "range_m": range_m, "time_s": seconds(message.header.stamp)}


def moved_between(before, after) -> dict:
    """The motion between two nav_msgs/Odometry: how far, not where to, since that frame knows no north."""
    one, other = before.pose.pose.position, after.pose.pose.position
    duration_s = seconds(after.header.stamp) - seconds(before.header.stamp)
    return {"duration_s": duration_s, "wheel_m": [other.x - one.x, other.y - one.y]}


def epoch_of(ranges: Iterable[dict], motion: dict | None) -> dict:
    """An epoch for the stream: ranges of one round, the last one's time, and the motion since the round before."""
    listed = list(ranges)
    epoch = {"time_s": max(one["time_s"] for one in listed), "ranges": listed}
    return epoch if motion is None or motion["duration_s"] <= 0.0 else {**epoch, "odometry": motion}


def pose_of(answer: dict) -> dict | None:
    """position (x east, y north, z up) and covariance (36) of a pose; None where there is none, or one of two sides."""
    fix = answer.get("position")
    if fix is None or fix["mirror"] is not None:
        return None
    covariance = [0.0] * POSE_SIZE**2
    for row in range(POSE_SIZE):
        covariance[row * POSE_SIZE + row] = UNKNOWN
    for row, values in enumerate(fix["covariance_m2"]):
        covariance[row * POSE_SIZE : row * POSE_SIZE + len(values)] = values
    place = (fix["east_m"], fix["north_m"], fix["altitude_m"] or 0.0)
    return {"position": dict(zip("xyz", place, strict=True)), "covariance": covariance}


def verdicts_of(answer: dict) -> str:
    """What /sightline/verdicts says: planning, excluded, and by how much each range is too long."""
    excess_m = {one["anchor_id"]: one["excess_m"] for one in answer["verdicts"] if one["occluded"]}
    return json.dumps({"planning": answer["planning"], "excluded": answer["excluded"], "excess_m": excess_m})


def main(url: str, detector_id: str) -> None:
    """Run the node."""
    import httpx
    import rclpy
    from geometry_msgs.msg import PoseWithCovarianceStamped
    from nav_msgs.msg import Odometry
    from rclpy.node import Node
    from sensor_msgs.msg import Range
    from std_msgs.msg import String
    from websockets.sync.client import connect

    headers = {"Authorization": f"Bearer {key}"} if (key := os.environ.get("SIGHTLINE_KEY")) else {}
    got = httpx.get(f"{url}/detectors/{detector_id}", trust_env=False, headers=headers)
    session = got.raise_for_status().json()
    address = url.replace("http", "ws", 1) + session["links"]["stream"]
    stream = connect(address, proxy=None, additional_headers=headers)
    rclpy.init()
    node = Node("sightline")
    poses = node.create_publisher(PoseWithCovarianceStamped, "/sightline/pose", 10)
    verdicts = node.create_publisher(String, "/sightline/verdicts", 10)
    heard, odometry = {}, []

    def close_round() -> None:
        if not heard:
            return
        motion = moved_between(odometry[0], odometry[-1]) if len(odometry) > 1 else None
        stream.send(json.dumps(epoch_of(heard.values(), motion)))
        heard.clear()
        del odometry[:-1]
        answer = json.loads(stream.recv())
        if "problem" in answer:
            node.get_logger().warning(answer["problem"]["detail"])
            return
        verdicts.publish(String(data=verdicts_of(answer)))
        pose = pose_of(answer)
        if pose is not None:
            message = PoseWithCovarianceStamped()
            message.header.frame_id, message.header.stamp = "map", node.get_clock().now().to_msg()
            for axis, metres in pose["position"].items():
                setattr(message.pose.pose.position, axis, metres)
            message.pose.covariance = pose["covariance"]
            poses.publish(message)

    def take(message: Range, topic: str) -> None:
        told = range_of(message, topic)
        heard[told["anchor_id"]] = told

    for anchor_id in session["anchors"]:
        topic = f"/uwb/{anchor_id}/range"
        node.create_subscription(Range, topic, lambda message, topic=topic: take(message, topic), 10)
    node.create_subscription(Odometry, "/odom", odometry.append, 50)
    node.create_timer(ROUND_S, close_round)
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
