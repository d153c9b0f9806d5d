"""What the instruments show of a robot that is driven."""

from __future__ import annotations

import math
from collections import deque
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.instruments import Instruments, instruments
from omnidyn.model.frames import body_to_world, world_to_body
from omnidyn.model.log_effects import (
    MEAN,
)
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import Wheels, twist_from_wheel_speed, wheel_speed
from omnidyn.simulation.live import LiveRobot


class _Moment(NamedTuple):
    """t [s]; pose, and how it changes in the world. Shapes (3,)."""

    t: float
    pose: FloatArray
    velocity: FloatArray


class Readings:
    """What instruments show of a live robot, step by step. Call `seen` once, then `passed`, in turns.

    Args:
        kit: the instruments.
        live: the robot.
        start: the time now [s].
        noise: std of what no encoder counts, before a filter, shape (6,).
        believed: wheels by whose size and place counts become a twist; those of the robot by default.
        random: draws what a gyroscope is off by.
    """

    def __init__(
        self,
        kit: Instruments,
        live: LiveRobot,
        start: float,
        noise: FloatArray,
        believed: Wheels | None = None,
        random: np.random.Generator | None = None,
    ) -> None:
        sensors = kit.sensors
        in_file = np.array([sensors.pose_noise or 0.0] * 2 + [sensors.heading_noise or 0.0, 0.0, 0.0, 0.0])
        self._kit, self._live, self._noise = kit, live, np.hypot(noise, in_file)
        self._random = random or np.random.default_rng(0)
        self._bias = (
            (sensors.gyro_bias or 0.0) * float(self._random.standard_normal()) if sensors.has_gyroscope else 0.0
        )
        self._wheels, self._believed = live.robot.wheels, believed or live.robot.wheels
        counts = sensors.encoder_counts
        self._turn = None if counts is None else 2.0 * math.pi / counts  # [rad] of a count
        self._angles = self._counted = np.zeros(self._wheels.count)
        self._slipping = live.wheel_speed - wheel_speed(self._wheels, live.twist)
        self._seconds, self._moments = 0.0, deque([self._moment(start)])
        self._twist = self._before = self._shown = np.array(live.twist)
        self._counted_pose = self._frame = np.array(live.pose)
        self._frame_t = -math.inf

    def _moment(self, t: float) -> _Moment:
        pose, twist = np.array(self._live.pose), np.array(self._live.twist)
        return _Moment(t, pose, body_to_world(pose[2]) @ twist)

    def passed(self, seconds: float) -> None:
        """The robot has been driven for so long [s]: count and remember."""
        before, now = self._moments[-1], self._moment(self._moments[-1].t + seconds)
        turned = now.pose[2] - before.pose[2]
        moved = world_to_body(before.pose[2] + 0.5 * turned) @ (now.pose - before.pose)
        moved[:2] /= np.sinc(0.5 * turned / math.pi)
        slipping = self._live.wheel_speed - wheel_speed(self._wheels, self._live.twist)
        self._angles = self._angles + wheel_speed(self._wheels, moved) + 0.5 * seconds * (slipping + self._slipping)
        self._slipping, self._seconds = slipping, seconds
        counted = self._angles if self._turn is None else np.floor(self._angles / self._turn) * self._turn
        travel = twist_from_wheel_speed(self._believed, counted - self._counted)
        if self._kit.sensors.has_gyroscope:
            drawn = (self._kit.sensors.gyro_noise or 0.0) * float(self._random.standard_normal())
            travel[2] = turned + seconds * (self._bias + drawn)
        self._counted_pose = self._counted_pose + body_to_world(self._counted_pose[2] + 0.5 * travel[2]) @ travel
        self._counted = counted
        self._twist = travel / seconds if self._kit.sensors.twist == MEAN else np.array(self._live.twist)
        if self._kit.sensors.has_gyroscope:
            self._twist[2] = travel[2] / seconds
        self._moments.append(now)
        oldest = now.t - self._kit.sensors.pose_delay - 1.0 / (self._kit.sensors.pose_rate or math.inf)
        while len(self._moments) > 2 and self._moments[1].t <= oldest:
            self._moments.popleft()

    def _filtered(self, twist: FloatArray) -> FloatArray:
        """What a filter shows: y + (1 - e)(mean - y) of a mean, and of speeds of the instant, which rise evenly."""
        constant, seconds, before = self._kit.sensors.twist_filter, self._seconds, self._before
        self._before = twist
        if constant == 0.0 or seconds == 0.0:
            return twist
        kept = math.exp(-seconds / constant)
        lag = 0.0 if self._kit.sensors.twist == MEAN else constant / seconds * (twist - before)
        since = twist if self._kit.sensors.twist == MEAN else before
        return twist - lag + kept * (self._shown - since + lag)

    def seen(self, draw: FloatArray, lost: bool) -> tuple[FloatArray, FloatArray]:
        """(pose, twist) as a controller gets them, shapes (3,). draw (6,): of the noise, std 1. lost: NaN."""
        kit, noise = self._kit, self._noise * draw
        self._shown = self._filtered(self._twist if self._turn is not None else self._twist + noise[3:])
        pose = self._counted_pose if kit.odometry else self._pose(noise[:3])
        return (np.full(3, np.nan), np.full(3, np.nan)) if lost else (pose, self._shown)

    def _pose(self, noise: FloatArray) -> FloatArray:
        """The newest pose that has arrived, measured from outside. Shape (3,)."""
        sensors, at = self._kit.sensors, self._moments[-1].t - self._kit.sensors.pose_delay
        if sensors.pose_rate:
            at = math.floor(at * sensors.pose_rate + 1e-9) / sensors.pose_rate
        if at > self._frame_t:
            self._frame, self._frame_t = self._pose_at(at) + noise, at
        return self._frame

    def _pose_at(self, t: float) -> FloatArray:
        """The pose at a time that has passed, by a cubic between two steps; before the first, that of the start."""
        later = next((k for k, moment in enumerate(self._moments) if moment.t >= t), len(self._moments) - 1)
        if later == 0 or self._moments[later].t <= t:
            return self._moments[later].pose
        first, last = self._moments[later - 1], self._moments[later]
        h = last.t - first.t
        s = (t - first.t) / h
        rise = s * s * (3.0 - 2.0 * s)
        bend = h * s * (1.0 - s) * ((1.0 - s) * first.velocity - s * last.velocity)
        return first.pose + rise * (last.pose - first.pose) + bend


def with_sensors(robot: Robot, wanted: Any) -> Robot:
    """The robot that knows which sensors are asked for; as it is where none are."""
    return robot if wanted is None else robot.replace(sensors=instruments(wanted, robot).sensors)
