"""Trajectories in a topic of a ROS bag: `run.bag:/odom`."""

from pathlib import Path
from typing import Any

import numpy as np

from fgbaseline.geometry import FloatArray, InputError

from ...time_unit import TimeUnit
from ..files.bag_file import Bag, open_bag_file
from ..files.file_errors import shown
from ..stamps.file_stamps import stamps_of
from .checks import require_rising, rotations_of_quaternions
from .parsed_trajectory import ParsedTrajectory

TYPES = (
    "nav_msgs/Odometry",
    "geometry_msgs/PoseStamped",
    "geometry_msgs/PoseWithCovarianceStamped",
    "geometry_msgs/TransformStamped",
    "nav_msgs/Path",
)
COVARIANT = (TYPES[0], TYPES[2])


def read_bag_trajectory(path: Path, topic: str, name: str | None) -> ParsedTrajectory:
    """The poses of a topic, at the stamps of its headers; of a Path, those of its last message.

    Raises InputError where the topic is missing or has another type.
    """
    source = f"{shown(path)}:{topic}"
    with open_bag_file(path) as bag:
        kind = _type(bag, topic)
        if kind == "nav_msgs/Path":
            path_message = bag.last_message(topic)  # each message repeats the poses of the previous ones
            poses = [] if path_message is None else path_message.poses
            stamps = [pose.header.stamp.sec * 10**9 + pose.header.stamp.nanosec for pose in poses]
            rows = [_numbers(pose.pose) for pose in poses]
            covariances: list[FloatArray] = []
        else:
            stamps, rows, covariances = [], [], []
            for _, stamp, message in bag.messages((topic,)):
                stamps.append(stamp)
                rows.append(_numbers(_pose(message, kind)))
                if kind in COVARIANT:
                    covariances.append(np.asarray(message.pose.covariance, dtype=np.float64).reshape(36))
    if not rows:
        raise InputError(f"{source}: the topic has no message; choose another")
    return _trajectory_file(source, name or topic.strip("/").replace("/", "-"), stamps, np.array(rows), covariances)


def _type(bag: Bag, topic: str) -> str:
    topics = bag.topics
    kind = topics.get(topic, "")
    if kind not in TYPES:
        what = f"is of type {kind}" if kind else "is not in the bag"
        fitting = [name for name, each in topics.items() if each in TYPES]
        raise InputError(f"{bag.source}: {topic} {what}; topics with poses: {', '.join(fitting) or 'none'}")
    return kind


def _trajectory_file(
    source: str, name: str, stamps: list[int], rows: FloatArray, covariances: list[FloatArray]
) -> ParsedTrajectory:
    line = np.arange(1, len(rows) + 1)
    try:
        order = np.append(True, np.diff(stamps) != 0)  # repeated messages
        kept = np.flatnonzero(order)
        words = [str(stamps[k]) for k in kept.tolist()]
        read = stamps_of(words, np.array([float(word) for word in words]), "ns")
        require_rising(read, line[kept])
        rotation = rotations_of_quaternions(rows[kept, 3:], line[kept], "a unit quaternion")
    except InputError as error:
        raise InputError(f"{source}: message {str(error).removeprefix('line ')}") from error
    repeated = len(rows) - len(kept)
    numbers = np.array(covariances)[kept] if covariances else None
    if numbers is not None and not numbers.any():
        numbers = None  # many programs publish zeros in place of a covariance
    return ParsedTrajectory(
        name,
        source,
        rows[kept, :3],
        rotation,
        line=line[kept],
        quaternion=rows[kept, 3:],
        stamps=read,
        units=(TimeUnit.NS,),
        covariance_numbers=numbers,
        remarks=(f"{repeated} messages repeat the stamp before: left out",) if repeated else (),
    )


def _pose(message: Any, kind: str) -> Any:
    return {
        "nav_msgs/Odometry": lambda: message.pose.pose,
        "geometry_msgs/PoseStamped": lambda: message.pose,
        "geometry_msgs/PoseWithCovarianceStamped": lambda: message.pose.pose,
        "geometry_msgs/TransformStamped": lambda: message.transform,
    }[kind]()


def _numbers(pose: Any) -> list[float]:
    """Position and quaternion x y z w of a Pose or Transform."""
    position = pose.translation if hasattr(pose, "translation") else pose.position
    q = pose.rotation if hasattr(pose, "rotation") else pose.orientation
    return [position.x, position.y, position.z, q.x, q.y, q.z, q.w]
