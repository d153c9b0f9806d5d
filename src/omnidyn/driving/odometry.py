"""Where a robot is and how far its wheels turned, from whatever it measures."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.program import way_between
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed

SMOOTHED = 0.1  # [s] over which a speed is taken


class Odometry:
    """Adds up what is measured, from the middle of the room.

    place (3,): pose in the room. speed (2,): over the floor, along x and y of the room [m/s]. encoders, body (wheels,):
    how far the wheels turned [rad], by what they measure, and by how the body moved; None where nothing tells.
    """

    def __init__(self, robot: Robot) -> None:
        self._wheels, self._delay = robot.wheels, robot.sensor_model.pose_delay
        self.place, self.speed = np.zeros(3), np.zeros(2)
        self.encoders: FloatArray | None = None
        self.body: FloatArray | None = None
        self._time: float | None = None
        self._first_angle: FloatArray | None = None
        self._pose: tuple[float, FloatArray] | None = None

    @property
    def age(self) -> float:
        """How old the place is: [sensors] says how late poses are [s]."""
        return self._delay if self._pose is not None else 0.0

    def take(self, t: float, channels: Mapping[str, FloatArray]) -> None:
        """What was measured at t [s]."""
        step = max(t - self._time, 0.0) if self._time is not None else 0.0
        self._time = t
        given = {name: value for name, value in channels.items() if np.isfinite(value).all()}
        turned = self._turned(step, given)
        if "pose" in given:
            self._at(t, given["pose"])
        elif self._pose is None and "twist" in given:
            self._moved(step * given["twist"], step)
            self.body = _sum(self.body, wheel_speed(self._wheels, step * given["twist"]))
        elif self._pose is None and turned is not None:
            self._moved(twist_from_wheel_speed(self._wheels, turned), step)

    def _turned(self, step: float, given: Mapping[str, FloatArray]) -> FloatArray | None:
        """How far the wheels turned since the last time [rad]."""
        if "wheel_angle" in given:
            if self._first_angle is None:
                self._first_angle = given["wheel_angle"]
            before, self.encoders = self.encoders, given["wheel_angle"] - self._first_angle
            return self.encoders - before if before is not None else np.zeros_like(self.encoders)
        if "wheel_speed" in given:
            self.encoders = _sum(self.encoders, step * given["wheel_speed"])
            return step * given["wheel_speed"]
        return None

    def _at(self, t: float, pose: FloatArray) -> None:
        """A measured pose."""
        if self._pose is not None and t > self._pose[0]:
            before, seconds = self._pose[1], t - self._pose[0]
            self.body = _sum(self.body, wheel_speed(self._wheels, np.array(way_between(before, pose))))
            self._at_speed((pose - before)[:2], seconds)
        self.place, self._pose = np.array(pose), (t, np.array(pose))

    def _moved(self, displacement: FloatArray, step: float) -> None:
        """A displacement in the frame of the body."""
        heading = self.place[2] + 0.5 * displacement[2]
        cosine, sine = np.cos(heading), np.sin(heading)
        moved = np.array(
            [
                cosine * displacement[0] - sine * displacement[1],
                sine * displacement[0] + cosine * displacement[1],
                displacement[2],
            ]
        )
        self.place = self.place + moved
        self._at_speed(moved[:2], step)

    def _at_speed(self, displacement: FloatArray, seconds: float) -> None:
        """The speed, smoothed over SMOOTHED."""
        self.speed = self.speed + (displacement - seconds * self.speed) / (SMOOTHED + seconds)


def _sum(total: FloatArray | None, more: FloatArray) -> FloatArray:
    return more if total is None else total + more
