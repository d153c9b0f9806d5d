"""The rivals: a hand-made PID with and without friction in front, and LQR with an integral, as users write them.

They know mass, geometry and motors of the data sheet, and of friction only what is said below. Their gains were chosen
by hand for each robot and stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.linalg import expm, solve_discrete_are

from benchmarks.control_real.plant import Plant
from omnidyn.arrays import FloatArray

DT = 0.02
POLE, INTEGRAL = 18.0, 0.25  # [1/s], share of it
LQR_GAIN = {"axebot": 10.0, "xdrive": 3.0, "mecanum": 10.0}  # how much errors weigh beside volts
FRICTION_SHARE = 0.9  # of dry friction that "PID + kS" puts in front
SOFT = np.array([0.01, 0.01, 0.05])  # [m/s, m/s, rad/s] width of its tanh
MOST_SUM, MOST_LQR_SUM = 20.0, 0.5
PI_GAIN, PI_INTEGRAL, MOST_PI_SUM = 12.0, 0.5, 0.05  # [1/s], share of its square, [m/s] and [rad/s]


def to_body(heading: float) -> FloatArray:
    """World to body. Shape (3, 3)."""
    c, s = math.cos(heading), math.sin(heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


class Rival:
    """What all share: an inverse model of mass, motors and viscous friction, in front of a feedback."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        constant, resistance = plant.motors[0].mean() * np.ones(plant.wheels), plant.motors[1]
        self.mass = np.diag(plant.mass).copy()
        self.braking = np.diag(plant.directions @ np.diag(constant**2 / resistance) @ plant.directions.T)
        self.per_volt = plant.directions @ np.diag(constant / resistance)
        self.volts_of = np.linalg.pinv(self.per_volt)
        self.sum = np.zeros(3)

    def step(self, t: float, pose: FloatArray, twist: FloatArray, path: Any) -> FloatArray:
        """Volts or duties. Shape (wheels,)."""
        motion = path.at(np.array([t, t + DT]))
        error = motion.pose[0] - pose
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        turned = to_body(pose[2])
        velocity, change = turned @ motion.velocity[0], turned @ (motion.velocity[1] - motion.velocity[0]) / DT
        wrench = self.mass * change + (self.braking + self.plant.viscous) * velocity
        wrench = wrench + self.feedback(turned @ error, velocity - twist, turned @ self.sum, velocity)
        volts = self.volts_of @ wrench
        over = np.abs(volts).max() / self.plant.volts
        if over <= 1.0:
            self.add(error)
        volts = volts / max(over, 1.0)
        return volts / self.plant.volts if self.plant.duty else volts

    def feedback(self, error: FloatArray, slower: FloatArray, total: FloatArray, velocity: FloatArray) -> FloatArray:
        """A wrench from errors of pose, of speed and their sum, in the body frame. Shape (3,)."""
        raise NotImplementedError

    def add(self, error: FloatArray) -> None:
        """Sum an error of the pose up."""
        raise NotImplementedError


class HandPid(Rival):
    """Two poles at POLE. friction: share of dry friction that it puts in front."""

    def __init__(self, plant: Plant, friction: float = 0.0) -> None:
        super().__init__(plant)
        self.friction = friction

    def feedback(self, error: FloatArray, slower: FloatArray, total: FloatArray, velocity: FloatArray) -> FloatArray:
        """PID as an acceleration, and dry friction along the way."""
        damping = np.maximum(2.0 * POLE - self.braking / self.mass, 0.0)
        wrench = self.mass * (POLE**2 * error + damping * slower + total)
        way = velocity + 0.5 * POLE * error
        return wrench + self.friction * self.plant.friction * np.tanh(way / SOFT)

    def add(self, error: FloatArray) -> None:
        """The integral, an acceleration."""
        self.sum = np.clip(self.sum + INTEGRAL * POLE**3 * error * DT, -MOST_SUM, MOST_SUM)


class KinematicPi:
    """A drive with a speed loop, as a user of /cmd_vel writes it: the speed of the path in the middle of the step, and
    PI of the pose."""

    def __init__(self, plant: Plant) -> None:
        self.plant, self.sum = plant, np.zeros(3)

    def step(self, t: float, pose: FloatArray, twist: FloatArray, path: Any) -> FloatArray:
        """Speeds of the wheels [rad/s], NaN where the pose is. Shape (wheels,)."""
        motion = path.at(np.array([t, t + self.plant.latency + 0.5 * DT]))
        error = motion.pose[0] - pose
        error[2] = math.remainder(error[2], 2.0 * math.pi)
        wanted = to_body(pose[2]) @ (motion.velocity[1] + PI_GAIN * error + self.sum)
        if np.isfinite(error).all():
            self.sum = np.clip(self.sum + PI_INTEGRAL * PI_GAIN**2 * error * DT, -MOST_PI_SUM, MOST_PI_SUM)
        return self.plant.directions.T @ wanted / self.plant.radius


class LqrIntegral(Rival):
    """LQR on each axis, with the integral of its error as a state. gain: weight of errors beside volts."""

    def __init__(self, plant: Plant, gain: float) -> None:
        super().__init__(plant)
        push = np.abs(plant.directions * plant.motors[0].mean() / plant.motors[1]).sum(axis=1)
        rows = []
        for axis in range(3):
            rate = (self.braking[axis] + plant.viscous[axis]) / self.mass[axis]
            block = np.zeros((4, 4))
            block[:3, :3], block[1, 3] = [[0.0, 1.0, 0.0], [0.0, -rate, 0.0], [1.0, 0.0, 0.0]], 1.0
            step = np.asarray(expm(block * DT))
            move, by = step[:3, :3], step[:3, 3:]
            weight = np.array([[2e-3 * plant.wheels * (self.mass[axis] / push[axis]) ** 2]])
            cost = solve_discrete_are(move, by, gain * np.diag([200.0, 1.0, 800.0]), weight)
            rows.append((np.linalg.inv(weight + by.T @ cost @ by) @ by.T @ cost @ move)[0])
        self.gains = np.array(rows).T

    def feedback(self, error: FloatArray, slower: FloatArray, total: FloatArray, velocity: FloatArray) -> FloatArray:
        """State feedback as an acceleration."""
        return self.mass * (self.gains[0] * error + self.gains[1] * slower + self.gains[2] * total)

    def add(self, error: FloatArray) -> None:
        """The integral of the error."""
        self.sum = np.clip(self.sum + error * DT, -MOST_LQR_SUM, MOST_LQR_SUM)


class Behind:
    """A rival behind a filter of first order: speeds are added up, and a share of the error of each late pose.

    Where a measurement is missing, the speeds before hold on.

    make: makes the rival for a plant. delay [s]: age of a pose when it arrives.
    """

    SHARE, KEPT = 0.1, 12  # of a new error; places remembered

    def __init__(self, make: Callable[[Plant], Any], delay: float, plant: Plant) -> None:
        self.plant, self._rival, self._age = plant, make(plant), delay + 0.5 * DT
        self._believed: FloatArray | None = None
        self._seen, self._past = np.full(3, np.nan), list[tuple[float, FloatArray]]()
        self._twist = np.zeros(3)

    def step(self, t: float, pose: FloatArray, twist: FloatArray, path: Any) -> FloatArray:
        """What the rival says of the pose that is believed."""
        if self._believed is None:
            self._believed = pose.copy()
        if np.isfinite(pose).all() and np.isfinite(twist).all():
            self._twist = twist
        else:
            pose, twist = self._seen, self._twist
        believed = self._believed + to_body(self._believed[2] + 0.5 * DT * twist[2]).T @ twist * DT
        self._past = [*self._past, (t, believed)][-self.KEPT :]
        if (pose != self._seen).any():
            times, places = (np.array(rows) for rows in zip(*self._past, strict=True))
            then = np.array([np.interp(t - self._age, times, places[:, k]) for k in range(3)])
            off = pose - then
            off[2] = math.remainder(off[2], 2.0 * math.pi)
            if not np.isnan(self._seen).any():
                believed = believed + self.SHARE * off
                self._past = [(time, place + self.SHARE * off) for time, place in self._past]
            self._seen = pose.copy()
        self._believed = believed
        return self._rival.step(t, believed, twist, path)
