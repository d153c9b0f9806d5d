"""A Run as an MCAP recording with the messages of ROS 2: it opens in Foxglove, PlotJuggler and rerun, beside the bag
of the robot, and reads back equal.

/joint_states  sensor_msgs/JointState   wheel_1, ..: wheel_angle, wheel_speed (REP-103: SI)
/odom          nav_msgs/Odometry        pose in odom, twist in base_link
/cmd_vel       geometry_msgs/TwistStamped   twist_command
/omnidyn/voltage, duty, current, wheel_speed_command, supply, force   std_msgs/Float64MultiArray, one number per wheel

/omnidyn/heading   std_msgs/Float64MultiArray   the heading as it is, where that in /odom has lost full turns

A message stands where a sensor measured; a stamp is t in ns, so that whole microseconds come back to the last bit. A
heading goes through a quaternion: to 1e-15 of it. A quaternion holds two turns, and a reader counts on from there: a
heading that begins beyond these is written beside it, as it is.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError, MissingExtraError
from omnidyn.logs.cdr import Packer
from omnidyn.logs.readers.ros.definitions import definition_of
from omnidyn.logs.readers.ros.usual import heading_of
from omnidyn.run import Run

ARRAYS = ("voltage", "duty", "current", "wheel_speed_command", "supply", "force")
LARGEST_NS = 2**62
NO_COVARIANCE = (0.0,) * 36


class Sent(NamedTuple):
    """A message: its stamp [ns], topic, type and bytes."""

    stamp: int
    topic: str
    type: str
    data: bytes


def import_mcap(where: str = "") -> Any:
    """The writer of the mcap package. Raises MissingExtraError with the line that installs it."""
    try:
        import mcap.writer
    except ImportError:
        raise MissingExtraError("writing MCAP needs mcap", remedy='pip install "omnidyn[logs]"', where=where) from None
    return mcap.writer


def run_to_mcap(run: Run) -> bytes:
    """The run as an MCAP file. Raises InputError for times that are no stamps, MissingExtraError without mcap."""
    writer_of = import_mcap()
    sink = io.BytesIO()
    writer = writer_of.Writer(sink)
    writer.start("ros2", "omnidyn")
    writer.add_metadata("omnidyn", {"run": "written by omnidyn: every channel is as it was, none from another"})
    channels: dict[str, int] = {}
    for stamp, topic, kind, data in sorted(messages(run), key=lambda message: message.stamp):
        if topic not in channels:
            schema = writer.register_schema(kind, "ros2msg", definition_of(kind).encode())
            channels[topic] = writer.register_channel(topic, "cdr", schema)
        writer.add_message(channels[topic], stamp, data, stamp)
    writer.finish()
    return sink.getvalue()


def messages(run: Run) -> Iterator[Sent]:
    """What the topics say, topic by topic. Raises InputError for times that are no stamps."""
    stamps = stamps_of(run)
    yield from _joints(run, stamps)
    yield from _odometry(run, stamps)
    commands = run.channels.get("twist_command", np.zeros((0, 3)))
    for k in _told(commands):
        vx, vy, omega = commands[k].tolist()
        packed = Packer().header(int(stamps[k]), "base_link").numbers("d", vx, vy, 0.0, 0.0, 0.0, omega)
        yield Sent(int(stamps[k]), "/cmd_vel", "geometry_msgs/msg/TwistStamped", bytes(packed))
    heading = np.zeros(0) if run.pose is None else run.pose[:, 2]
    arrays = {name: run.channels.get(name, np.zeros(0)) for name in ARRAYS}
    for name, values in {**arrays, "heading": heading if _turns_lost(heading) else np.zeros(0)}.items():
        for k in _told(values):
            packed = Packer().numbers("I", 0, 0).array(np.atleast_1d(values[k]).tolist())
            yield Sent(int(stamps[k]), f"/omnidyn/{name}", "std_msgs/msg/Float64MultiArray", bytes(packed))


def stamps_of(run: Run) -> IntArray:
    """Times as whole ns. Raises InputError where they are none: before 0, too late, or less than 1 ns apart."""
    if not 0.0 <= run.t[0] <= run.t[-1] < LARGEST_NS / 1e9:
        raise InputError(
            "these times are not time stamps",
            got=f"{run.t[0]:.9g} to {run.t[-1]:.9g} s",
            expected="seconds from 0 on",
            remedy="shift them: run.replace(t=run.t - run.t[0])",
            where=run.source,
        )
    stamps = np.rint(run.t * 1e9).astype(np.int64)
    if (np.diff(stamps) <= 0).any():
        raise InputError("times less than a nanosecond apart", expected="stamps that increase", where=run.source)
    return stamps


def _told(values: FloatArray) -> list[int]:
    """The rows in which anything was measured."""
    finite = np.isfinite(values)
    return np.flatnonzero(finite if finite.ndim == 1 else finite.any(axis=1)).tolist()


def _turns_lost(heading: FloatArray) -> bool:
    """Whether full turns are lost on the way through a quaternion. heading: shape (rows,), NaN where missing."""
    headings = heading[np.isfinite(heading)]
    sine, cosine = _half_turned(headings).T
    zero = np.zeros(len(headings))
    return bool((np.abs(heading_of(zero, zero, sine, cosine) - headings) > 1.0).any())


def _half_turned(heading: FloatArray) -> FloatArray:
    """z and w of the quaternion of a turn about z. Shape (rows, 2)."""
    half = 0.5 * np.remainder(heading, 4.0 * np.pi)
    return np.stack([np.sin(half), np.cos(half)], axis=1)


def _joints(run: Run, stamps: IntArray) -> Iterator[Sent]:
    parts = [run.wheel_angle, run.wheel_speed]
    wheels = next((part.shape[1] for part in parts if part is not None), 0)
    names = [f"wheel_{k + 1}" for k in range(wheels)]
    row_sets = [set(_told(part)) if part is not None else set() for part in parts]
    for k in sorted(row_sets[0] | row_sets[1]):
        packed = Packer().header(int(stamps[k])).texts(names)
        for values, rows in zip(parts, row_sets, strict=True):
            packed.array(values[k].tolist() if values is not None and k in rows else ())
        yield Sent(int(stamps[k]), "/joint_states", "sensor_msgs/msg/JointState", bytes(packed.array(())))


def _odometry(run: Run, stamps: IntArray) -> Iterator[Sent]:
    nothing = np.full((len(run), 3), np.nan)
    pose = nothing if run.pose is None else run.pose
    twist = nothing if run.twist is None else run.twist
    turn = _half_turned(pose[:, 2])
    for k in sorted({*_told(pose), *_told(twist)}):
        (x, y, _), (vx, vy, omega), (sine, cosine) = pose[k].tolist(), twist[k].tolist(), turn[k].tolist()
        packed = Packer().header(int(stamps[k]), "odom").text("base_link")
        packed.numbers("d", x, y, 0.0, 0.0, 0.0, sine, cosine, *NO_COVARIANCE)
        packed.numbers("d", vx, vy, 0.0, 0.0, 0.0, omega, *NO_COVARIANCE)
        yield Sent(int(stamps[k]), "/odom", "nav_msgs/msg/Odometry", bytes(packed))
