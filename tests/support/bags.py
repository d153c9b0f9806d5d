"""Bags of ROS made by script: messages by the typesystem of rosbags, files by the mcap package and by rosbags."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np


@dataclass
class Said:
    """A message to be written: topic, type, time of reception [ns], and the message itself."""

    topic: str
    type: str
    receive: int
    message: Any


def typestore(custom: dict[str, str] | None = None, ros1: bool = False) -> Any:
    """The types of ROS 2 or 1, and some more: name -> definition."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    for name, text in (custom or {}).items():
        store.register(get_types_from_msg(text, name))
    return store


@dataclass
class BagMaker:
    """Messages in the making. The functions take times in seconds after `start` [ns]."""

    start: int = 1_700_000_000_000_000_000
    custom: dict[str, str] = field(default_factory=dict)
    said: list[Said] = field(default_factory=list)
    ros1: bool = False

    def __post_init__(self) -> None:
        self.store = typestore(self.custom, self.ros1)

    def make(self, kind: str, *values: Any) -> Any:
        return self.store.types[kind](*values)

    def ns(self, t: float) -> int:
        return self.start + round(t * 1e6) * 1000

    def header(self, t: float | None, frame: str = "") -> Any:
        """t: None leaves the stamp unset."""
        ns = 0 if t is None else self.ns(t)
        stamp = self.make("builtin_interfaces/msg/Time", ns // 10**9, ns % 10**9)
        return self.make("std_msgs/msg/Header", *([0] if self.ros1 else []), stamp, frame)

    def add(self, topic: str, kind: str, t: float, message: Any, late: float = 0.002) -> None:
        self.said.append(Said(topic, kind, self.ns(t + late), message))

    def vector(self, x: float, y: float, z: float) -> Any:
        return self.make("geometry_msgs/msg/Vector3", x, y, z)

    def joints(self, t: float, names: list[str], position: Any, velocity: Any, topic: str = "/joint_states") -> None:
        arrays = [np.asarray(each, dtype=np.float64) for each in (position, velocity, ())]
        message = self.make("sensor_msgs/msg/JointState", self.header(t), names, *arrays)
        self.add(topic, "sensor_msgs/msg/JointState", t, message)

    def odometry(
        self, t: float, pose: Any, twist: Any, topic: str = "/odom", stamp: Any = "t", late: float = 0.002
    ) -> None:
        x, y, heading = pose
        point = self.make("geometry_msgs/msg/Point", x, y, 0.0)
        turn = self.make("geometry_msgs/msg/Quaternion", 0.0, 0.0, np.sin(heading / 2), np.cos(heading / 2))
        where = self.make("geometry_msgs/msg/Pose", point, turn)
        vx, vy, omega = twist
        moves = self.make("geometry_msgs/msg/Twist", self.vector(vx, vy, 0.0), self.vector(0.0, 0.0, omega))
        zeros = np.zeros(36)
        message = self.make(
            "nav_msgs/msg/Odometry",
            self.header(t if stamp == "t" else stamp, "odom"),
            "base_link",
            self.make("geometry_msgs/msg/PoseWithCovariance", where, zeros),
            self.make("geometry_msgs/msg/TwistWithCovariance", moves, zeros),
        )
        self.add(topic, "nav_msgs/msg/Odometry", t, message, late)

    def twist(self, t: float, twist: Any, topic: str = "/cmd_vel", stamped: bool = False) -> None:
        vx, vy, omega = twist
        message = self.make("geometry_msgs/msg/Twist", self.vector(vx, vy, 0.0), self.vector(0.0, 0.0, omega))
        kind = "geometry_msgs/msg/Twist"
        if stamped:
            kind = "geometry_msgs/msg/TwistStamped"
            message = self.make(kind, self.header(t), message)
        self.add(topic, kind, t, message)

    def battery(self, t: float, volts: float, topic: str = "/battery_state") -> None:
        nan, none = float("nan"), np.zeros(0, dtype=np.float32)
        message = self.make(
            "sensor_msgs/msg/BatteryState",
            self.header(t),
            volts,
            *[nan] * 6,
            2,
            1,
            2,
            True,
            none,
            none,
            "",
            "",
        )
        self.add(topic, "sensor_msgs/msg/BatteryState", t, message)

    def numbers(self, t: float, values: Any, topic: str, late: float = 0.002) -> None:
        layout = self.make("std_msgs/msg/MultiArrayLayout", [], 0)
        kind = "std_msgs/msg/Float64MultiArray"
        self.add(topic, kind, t, self.make(kind, layout, np.asarray(values, dtype=np.float64)), late)

    def in_order(self) -> list[Said]:
        """As a recorder writes them: by the time of reception."""
        return sorted(self.said, key=lambda each: each.receive)


def write_mcap(maker: BagMaker, path: Path, compression: str = "zstd", chunk: int = 2**14, order: Any = None) -> Path:
    """An MCAP file by the mcap package. compression: none, lz4 or zstd. order: the messages as they are written."""
    from mcap.writer import CompressionType, Writer

    with open(path, "wb") as stream:
        writer = Writer(stream, chunk_size=chunk, compression=CompressionType[compression.upper()])
        writer.start("ros2", "tests")
        channels: dict[tuple[str, str], int] = {}
        for each in maker.in_order() if order is None else order:
            key = (each.topic, each.type)
            if key not in channels:
                text = maker.store.generate_msgdef(each.type, ros_version=2)[0]
                schema = writer.register_schema(each.type, "ros2msg", text.encode())
                channels[key] = writer.register_channel(each.topic, "cdr", schema)
            data = bytes(maker.store.serialize_cdr(each.message, each.type))
            writer.add_message(channels[key], each.receive, data, each.receive)
        writer.finish()
    return path


def write_ros2(maker: BagMaker, folder: Path, storage: str = "sqlite3", compression: str = "") -> Path:
    """A ROS 2 bag by rosbags: a folder with metadata.yaml. compression: "", "file" or "message"."""
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    writer = Writer(folder, version=9, storage_plugin=StoragePlugin(1 if storage == "sqlite3" else 2))
    if compression:
        writer.set_compression(CompressionMode[compression.upper()], CompressionFormat.ZSTD)
    with writer:
        known: dict[tuple[str, str], Any] = {}
        for each in maker.in_order():
            key = (each.topic, each.type)
            if key not in known:
                known[key] = writer.add_connection(each.topic, each.type, typestore=maker.store)
            writer.write(known[key], each.receive, maker.store.serialize_cdr(each.message, each.type))
    return folder


def write_ros1(maker: BagMaker, path: Path, compression: str = "") -> Path:
    """A ROS 1 bag by rosbags, of messages made with `ros1`. compression: "", "bz2" or "lz4"."""
    from rosbags.rosbag1 import Writer

    writer = Writer(path)
    if compression:
        writer.set_compression(Writer.CompressionFormat[compression.upper()])
    with writer:
        known: dict[tuple[str, str], Any] = {}
        for each in maker.in_order():
            key = (each.topic, each.type)
            if key not in known:
                known[key] = writer.add_connection(each.topic, each.type, typestore=maker.store)
            writer.write(known[key], each.receive, maker.store.serialize_ros1(each.message, each.type))
    return path


def drive(maker: BagMaker, seconds: float = 2.0, rates: tuple[float, float, float] = (200.0, 50.0, 7.0)) -> BagMaker:
    """A short drive: wheels at the first rate, odometry and commands at the second, the battery at the third."""
    for k in range(int(seconds * rates[0])):
        t = k / rates[0]
        speed = np.array([np.sin(t), np.cos(t), -1.0]) * 3.0
        maker.joints(t, ["wheel_1_joint", "wheel_2_joint", "wheel_3_joint"], speed * t, speed)
    for k in range(int(seconds * rates[1])):
        t = k / rates[1] + 0.0031
        maker.odometry(t, (0.1 * t, -0.05 * t, 4.0 * t), (0.1, -0.05, 4.0))
        maker.twist(t + 0.001, (0.2, 0.0, np.sin(t)))
    for k in range(int(seconds * rates[2])):
        maker.battery(k / rates[2] + 0.011, 12.0 - 0.01 * k)
    return maker
