"""The usual messages of ROS: which of their numbers are read, and what they say of a robot.

A rule turns the layout of a message into the numbers that are picked, each under a key, and these, over all messages,
into columns. What no rule knows is read number by number, and its columns are guessed by their names.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.readers.claims import TopicColumn
from omnidyn.logs.readers.ros.definitions import plain
from omnidyn.logs.readers.ros.layout import MessageLayout

Picks = Mapping[str, str]  # key -> path of a number in the layout
Numbers = Mapping[str, FloatArray]  # key -> one number a message

SECONDS, NANOSECONDS = "stamp.sec", "stamp.nanosec"  # keys of the stamp
BODY_FRAMES = ("base_link", "base_footprint", "base", "robot")
WORLD_FRAMES = ("odom", "map", "world")
_INDEX = re.compile(r"\[\d+\]")
MOST_GENERIC = 200  # columns of one topic that no rule knows
HEAVY = (
    "Image",
    "CompressedImage",
    "PointCloud",
    "PointCloud2",
    "LaserScan",
    "OccupancyGrid",
    "OccupancyGridUpdate",
    "CameraInfo",
    "Marker",
    "MarkerArray",
    "Path",
    "PoseArray",
    "Log",
    "DiagnosticArray",
    "ParameterEvent",
    "Parameter",
    "JointTrajectory",
    "PolygonStamped",
    "Costmap",
)


class Rule(NamedTuple):
    """picks(layout): the numbers to read. columns(topic, numbers): what becomes of them. rank: of what gives the same
    component, the least is taken."""

    picks: Callable[[MessageLayout], Picks]
    columns: Callable[[str, Numbers], list[TopicColumn]]
    rank: int = 0


def rule_of(kind: str) -> Rule | None:
    """The rule for a type of messages; None for one that is not read: pictures, scans, maps."""
    name = plain(kind)
    if name in RULES:
        return RULES[name]
    return None if name.rpartition("/")[2] in HEAVY else Rule(_all, _as_they_are, 9)


def is_command(topic: str) -> bool:
    """Whether a topic is called like a command."""
    return words.COMMAND in read_name(topic.strip("/").replace("/", "_")).roles


def _stamp(layout: MessageLayout, prefix: str = "header.stamp") -> dict[str, str]:
    paths = {SECONDS: f"{prefix}.sec", NANOSECONDS: f"{prefix}.nanosec"}
    return paths if all(path in layout.numbers for path in paths.values()) else {}


def _paths(**keys: str) -> Callable[[MessageLayout], Picks]:
    """Some numbers, by their paths, and the stamp in the header."""

    def picks(layout: MessageLayout) -> Picks:
        return {**_stamp(layout), **{key: path for key, path in keys.items() if path in layout.numbers}}

    return picks


def _pose_paths(of: str) -> dict[str, str]:
    return {
        "x": f"{of}position.x",
        "y": f"{of}position.y",
        "qx": f"{of}orientation.x",
        "qy": f"{of}orientation.y",
        "qz": f"{of}orientation.z",
        "qw": f"{of}orientation.w",
    }


def _twist_paths(of: str) -> dict[str, str]:
    return {"vx": f"{of}linear.x", "vy": f"{of}linear.y", "omega": f"{of}angular.z"}


def _all(layout: MessageLayout) -> Picks:
    """Every plain number but stamps and covariances."""
    paths = [p for p in layout.numbers if "stamp." not in p and "covariance" not in p and not p.startswith("layout.")]
    return {**_stamp(layout), **{path: path for path in paths[:MOST_GENERIC]}}


def _joints(layout: MessageLayout) -> Picks:
    """The numbers of each joint by its name, whatever the order, and however many arrays are empty."""
    paths = dict(_stamp(layout))
    names = {path: text for path, text in layout.words.items() if path.startswith("name[")}
    for path, joint in names.items():
        for array in ("position", "velocity"):
            number = array + path.removeprefix("name")
            if number in layout.numbers:
                paths[f"{joint}/{array}"] = number
    return paths


def _transforms(layout: MessageLayout) -> Picks:
    """The first transform from a frame of the world to one of the body."""
    best: tuple[int, str] | None = None
    for path, child in layout.words.items():
        of, _, last = path.rpartition(".")
        if last != "child_frame_id":
            continue
        parent = layout.words.get(f"{of}.header.frame_id", "").strip("/").rpartition("/")[2]
        if child.strip("/").rpartition("/")[2] in BODY_FRAMES and parent in WORLD_FRAMES:
            rank = WORLD_FRAMES.index(parent)
            best = min(best or (rank, of), (rank, of))
    if best is None:
        return {}
    of = best[1]
    paths = {
        "x": f"{of}.transform.translation.x",
        "y": f"{of}.transform.translation.y",
        **{f"q{a}": f"{of}.transform.rotation.{a}" for a in "xyzw"},
    }
    return {**_stamp(layout, f"{of}.header.stamp"), **paths}


def heading_of(x: FloatArray, y: FloatArray, z: FloatArray, w: FloatArray) -> FloatArray:
    """Yaw [rad] of quaternions, turns counted on: atan2(2 (w z + x y), 1 - 2 (y² + z²)), or 2 atan2(z, w) for a turn
    about z alone, which loses nothing. A quaternion of zeros, which says nothing, is NaN.
    """
    flat = (x == 0.0) & (y == 0.0)
    yaw = np.where(flat, 2.0 * np.arctan2(z, w), np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))
    yaw = np.where((z == 0.0) & (w == 0.0) & flat, np.nan, yaw)
    finite = np.flatnonzero(np.isfinite(yaw))
    yaw[finite] = _continued(yaw[finite])
    return yaw


def _continued(yaw: FloatArray) -> FloatArray:
    """Full turns added so that no step is longer than half a turn. The steps are rounded to whole turns, so that the
    numbers themselves stay as they are but for these."""
    if not len(yaw):
        return yaw
    turns = np.concatenate([[0.0], -np.cumsum(np.round(np.diff(yaw) / (2.0 * np.pi)))])
    return yaw + 2.0 * np.pi * turns


def _pose(topic: str, numbers: Numbers) -> list[TopicColumn]:
    columns = [TopicColumn(f"{topic}/{key}", numbers[key], "m", key) for key in ("x", "y") if key in numbers]
    if all(f"q{axis}" in numbers for axis in "xyzw"):
        heading = heading_of(*(numbers[f"q{axis}"] for axis in "xyzw"))
        columns.append(TopicColumn(f"{topic}/heading", heading, "rad", "heading"))
    elif "theta" in numbers:
        columns.append(TopicColumn(f"{topic}/heading", _continued(numbers["theta"]), "rad", "heading"))
    return columns


_TWIST_UNITS = {"vx": "m/s", "vy": "m/s", "omega": "rad/s"}


def _twist(topic: str, numbers: Numbers, command: bool = False) -> list[TopicColumn]:
    ending = "_cmd" if command else ""
    return [
        TopicColumn(f"{topic}/{key}", numbers[key], unit, f"{key}{ending}")
        for key, unit in _TWIST_UNITS.items()
        if key in numbers
    ]


def _either_twist(topic: str, numbers: Numbers) -> list[TopicColumn]:
    return _twist(topic, numbers, is_command(topic))


def _odometry(topic: str, numbers: Numbers) -> list[TopicColumn]:
    return [*_pose(topic, numbers), *_twist(topic, numbers)]


def _imu(topic: str, numbers: Numbers) -> list[TopicColumn]:
    return [TopicColumn(f"{topic}/omega", numbers["omega"], "rad/s", "omega")] if "omega" in numbers else []


def _battery(topic: str, numbers: Numbers) -> list[TopicColumn]:
    volts = numbers.get("voltage")
    return [] if volts is None else [TopicColumn(f"{topic}/voltage", volts, "V", "supply")]


def _joint_columns(topic: str, numbers: Numbers) -> list[TopicColumn]:
    """Each joint's angle and speed, wheel by number where the names of the joints have one for each wheel."""
    joints = list(dict.fromkeys(key.rpartition("/")[0] for key in numbers))
    wheels, command = wheel_numbers(joints), is_command(topic)
    columns = []
    for key, values in numbers.items():
        joint, _, array = key.rpartition("/")
        of = wheels.get(joint)
        speed = array == "velocity"
        unit = "rad/s" if speed else "rad"
        component = f"w{of}{'_cmd' * command}" if speed else "" if command else f"a{of}"
        if of is None:
            component = "" if wheels else None
        columns.append(TopicColumn(f"{topic}/{joint}/{array}", values, unit, component))
    return columns


def wheel_numbers(joints: list[str]) -> dict[str, int]:
    """Joint -> number of its wheel from 1, where names count them; {} where they do not decide.

    Where some are called wheels or motors, the others are none.
    """
    parts = {joint: read_name(joint) for joint in joints}
    wheels = [j for j, part in parts.items() if part.roles & {words.WHEEL, words.MOTOR}]
    numbers = {joint: parts[joint].number for joint in wheels or joints}
    counted = [number for number in numbers.values() if number is not None]
    first = min(counted, default=1)
    if (
        len(counted) < len(numbers)
        or sorted(counted) != list(range(first, first + len(counted)))
        or first not in (0, 1)
    ):
        return {}
    return {joint: number - first + 1 for joint, number in numbers.items() if number is not None}


def _as_they_are(topic: str, numbers: Numbers) -> list[TopicColumn]:
    """Each number under its own name, in the unit that its name ends in: current_A[0]."""
    units = {key: read_name(_INDEX.sub("", key.rpartition(".")[2])).unit for key in numbers}
    return [
        TopicColumn(f"{topic}/{key}", values, unit.text if (unit := units[key]) is not None else "")
        for key, values in numbers.items()
    ]


def _volts(topic: str, numbers: Numbers) -> list[TopicColumn]:
    """An array of numbers; on .../omnidyn/voltage and its kin, which `omnidyn convert` writes, the wheels'."""
    name = topic.rstrip("/")
    kind = next((kind for kind in OWN_TOPICS if name.endswith(kind)), None)
    columns = _as_they_are(topic, numbers)
    if kind is None:
        return columns
    letter, unit, ending = OWN_TOPICS[kind]
    wheels = ("",) if letter in ("supply", "heading") else range(1, len(columns) + 1)
    return [out._replace(unit=unit, component=f"{letter}{k}{ending}") for k, out in zip(wheels, columns, strict=False)]


HEADING = "/omnidyn/heading"
# What no standard message holds, under names of our own: topic -> letter of the component, unit, ending.
OWN_TOPICS = {
    "/omnidyn/voltage": ("u", "V", ""),
    "/omnidyn/duty": ("d", "duty", ""),
    "/omnidyn/current": ("i", "A", ""),
    "/omnidyn/wheel_speed_command": ("w", "rad/s", "_cmd"),
    "/omnidyn/force": ("f", "N", ""),
    "/omnidyn/supply": ("supply", "V", ""),
    HEADING: ("heading", "rad", ""),
}


def rank_of(topic: str, rule: Rule) -> int:
    """The rank of a topic: that of its type, but that a heading as it is comes before one through a quaternion."""
    return -1 if topic.rstrip("/").endswith(HEADING) else rule.rank


def _array(layout: MessageLayout) -> Picks:
    return {**_stamp(layout), **{path: path for path in layout.numbers if path.startswith("data")}}


RULES: dict[str, Rule] = {
    "sensor_msgs/JointState": Rule(_joints, _joint_columns),
    "nav_msgs/Odometry": Rule(_paths(**_pose_paths("pose.pose."), **_twist_paths("twist.twist.")), _odometry),
    "geometry_msgs/Twist": Rule(_paths(**_twist_paths("")), _either_twist, 2),
    "geometry_msgs/TwistStamped": Rule(_paths(**_twist_paths("twist.")), _either_twist, 2),
    "geometry_msgs/TwistWithCovarianceStamped": Rule(_paths(**_twist_paths("twist.twist.")), _twist, 2),
    "geometry_msgs/PoseStamped": Rule(_paths(**_pose_paths("pose.")), _pose, 1),
    "geometry_msgs/PoseWithCovarianceStamped": Rule(_paths(**_pose_paths("pose.pose.")), _pose, 1),
    "geometry_msgs/Pose": Rule(_paths(**_pose_paths("")), _pose, 1),
    "geometry_msgs/Pose2D": Rule(_paths(x="x", y="y", theta="theta"), _pose, 1),
    "tf2_msgs/TFMessage": Rule(_transforms, _pose, 4),
    "tf/tfMessage": Rule(_transforms, _pose, 4),
    "sensor_msgs/Imu": Rule(_paths(omega="angular_velocity.z"), _imu, 3),
    "sensor_msgs/BatteryState": Rule(_paths(voltage="voltage"), _battery),
    "std_msgs/Float64MultiArray": Rule(_array, _volts, 0),
    "std_msgs/Float32MultiArray": Rule(_array, _volts, 0),
}
