"""LatePose: where a robot is now, from a pose that is old when it arrives, and its speeds since.

    pose now = pose seen + R(heading seen - heading counted then) (counted now - counted then)

`counted` adds the measured twists up. So a camera of 40 ms makes no loop late; a pose that comes again as it was is no
new one, and only grows older.
"""

from __future__ import annotations

import math
from collections import deque
from copy import deepcopy

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.robot import Robot

Place = tuple[float, float, float]


def late_pose(robot: Robot, dt: float, before: LatePose | None = None) -> LatePose | None:
    """That of a robot in a loop with steps of dt [s]; None where its poses are new.

    before: of the same controller; where the sensors are the same, a copy of it.
    """
    sensors = robot.sensor_model
    age = sensors.pose_age(dt)
    if before is not None and (before.age, before.averaged) == (age, sensors.averaged):
        return deepcopy(before)
    return LatePose(age, sensors.averaged) if age > 0.0 else None


class LatePose:
    """age [s]: of a pose that is new. averaged: whether twists are means since the call before."""

    def __init__(self, age: float, averaged: bool) -> None:
        self.age, self.averaged = age, averaged
        self.reset()

    def reset(self) -> None:
        """Forget all poses."""
        self._counted: deque[tuple[float, Place]] = deque()
        self._twist: Place = (0.0, 0.0, 0.0)
        self._seen: tuple[Place, Place] | None = None  # a pose, and what was counted when the robot was there

    def now(self, t: float, pose: FloatArray, twist: FloatArray) -> FloatArray:
        """The pose at time t [s], from what was measured. Shapes (3,). NaN for what is no number."""
        if not (np.isfinite(pose).all() and np.isfinite(twist).all()):
            return np.full(3, np.nan)
        x, y, heading = pose.tolist()
        counted = self._count(t, *twist.tolist())
        if self._seen is None or self._seen[0] != (x, y, heading):
            self._seen = (x, y, heading), self._counted_at(t - self.age)
        then = self._seen[1]
        angle = heading - then[2]
        cos, sin = math.cos(angle), math.sin(angle)
        dx, dy = counted[0] - then[0], counted[1] - then[1]
        return np.array([x + cos * dx - sin * dy, y + sin * dx + cos * dy, heading + counted[2] - then[2]])

    def _count(self, t: float, vx: float, vy: float, omega: float) -> Place:
        """Add a step up."""
        if not self._counted or t <= self._counted[-1][0]:
            self.reset()
            self._counted.append((t, (0.0, 0.0, 0.0)))
        last_t, (x, y, heading) = self._counted[-1]
        dt, twist = t - last_t, (vx, vy, omega)
        if not self.averaged:
            vx, vy, omega = (0.5 * (now + before) for now, before in zip(twist, self._twist, strict=True))
        middle = heading + 0.5 * omega * dt
        cos, sin = math.cos(middle), math.sin(middle)
        place = x + dt * (cos * vx - sin * vy), y + dt * (sin * vx + cos * vy), heading + dt * omega
        self._counted.append((t, place))
        while len(self._counted) > 2 and self._counted[1][0] <= t - self.age:
            self._counted.popleft()
        self._twist = twist
        return place

    def _counted_at(self, t: float) -> Place:
        """What was counted at a time, straight between two steps; at first the oldest there is."""
        later = next(k for k, (time, _) in enumerate(self._counted) if time >= t - 1e-12)
        if later == 0:
            return self._counted[0][1]
        (t0, before), (t1, after) = self._counted[later - 1], self._counted[later]
        share = (t - t0) / (t1 - t0)
        x, y, heading = (a + share * (b - a) for a, b in zip(before, after, strict=True))
        return x, y, heading
