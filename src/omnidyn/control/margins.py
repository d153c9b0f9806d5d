"""Margins: how much later its outputs may act, and how much stronger, before a loop no longer settles.

A simulated robot slides along at a steady twist, a fifth too slow at first, and the loop is to take it there: it
settles where its speeds scatter by no more than SETTLED after `SECONDS`. Both margins are found by halving: of an
additional latency, and of a factor on all outputs. Sliding, no friction changes its direction: what settles here is the
loop itself, whatever the controller is made of, with the sensors of the robot but without their noise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.control.circumstances import Circumstances
from omnidyn.control.controller import Controller
from omnidyn.control.instruments import Instruments
from omnidyn.control.paths.motion import Path, Reference
from omnidyn.control.readings import Readings
from omnidyn.model.frames import body_to_world
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.simulation.live import LiveRobot

FARTHEST_DELAY, FARTHEST_GAIN = 0.06, 4.0  # [s]; times
HALVINGS = 5
SECONDS, LEAST_STEPS = 2.0, 100
END = 0.25  # of it
SETTLED = 0.02  # of the speeds: so little they scatter in the end
SLOWER = 0.8  # times the speed of the path, at first
SHARES = np.array([0.25, 0.15, 0.2])  # of the top speeds: that of the path


@dataclass(frozen=True)
class Margins:
    """Of one loop. delay [s]: outputs may act so much later than they do; gain: be so many times as strong.

    FARTHEST_DELAY and FARTHEST_GAIN: that much at least.
    """

    delay: float
    gain: float


class _SteadyTwist(Path):
    """A twist in the frame of the body [m/s, m/s, rad/s] that never changes."""

    name, duration, end = "steady", SECONDS, np.inf

    def __init__(self, twist: FloatArray) -> None:
        self._twist = twist

    def at(self, t: ArrayLike) -> Reference:
        """Along a circle, its heading turning along."""
        heading = self._twist[2] * np.asarray(t, dtype=float)
        turn = body_to_world(heading)
        velocity = turn @ self._twist
        place = (turn - np.eye(3)) @ np.array([self._twist[1], -self._twist[0], 0.0]) / self._twist[2]
        place[..., 2] = heading
        change = self._twist[2] * np.stack([-velocity[..., 1], velocity[..., 0], 0.0 * heading], axis=-1)
        return Reference(place, velocity, change)


def loop_margins(plant: Robot, controller: Controller, around: Circumstances) -> Margins:
    """The margins of a controller that drives a robot; it begins anew, and forgets all steps in the end."""
    speeds = SHARES * top_speeds(plant)
    if not (np.isfinite(speeds) & (speeds > 0.0)).all():
        return Margins(0.0, 1.0)

    def settles(delay: float, gain: float) -> bool:
        later = plant.replace(drive=plant.drive.replace(latency=plant.drive.latency + delay))
        return _settles(later, controller, around, speeds, gain)

    try:
        if not settles(0.0, 1.0):
            return Margins(0.0, 1.0)
        delay = _largest(lambda share: settles(share * FARTHEST_DELAY, 1.0)) * FARTHEST_DELAY
        gain = FARTHEST_GAIN ** _largest(lambda share: settles(0.0, FARTHEST_GAIN**share))
    finally:
        controller.reset()
    return Margins(delay, gain)


def has_delay_margin(plant: Robot, controller: Controller, around: Circumstances, delay: float) -> bool:
    """Whether a loop still settles where its outputs act so much later [s]."""
    speeds = SHARES * top_speeds(plant)
    later = plant.replace(drive=plant.drive.replace(latency=plant.drive.latency + delay))
    try:
        return bool((speeds > 0.0).all()) and _settles(later, controller, around, speeds, 1.0)
    finally:
        controller.reset()


def _largest(settles: Callable[[float], bool]) -> float:
    """The largest share for which it does: 1, or what halving finds."""
    if settles(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if settles(middle) else (low, middle)
    return low


def _settles(plant: Robot, controller: Controller, around: Circumstances, speeds: FloatArray, gain: float) -> bool:
    """Whether a loop does, its outputs so many times as strong."""
    path, dt, kit = _SteadyTwist(speeds), around.dt, around.sensors or Instruments(plant.sensor_model)
    still = kit.sensors.replace(
        encoder_counts=None, gyro_noise=None, gyro_bias=None, pose_noise=None, heading_noise=None
    )
    start = path.at(0.0).pose
    live = LiveRobot(plant, dt, pose=start, twist=SLOWER * speeds, delay=around.delay, supply=around.supply)
    readings = Readings(Instruments(still, kit.odometry), live, 0.0, np.zeros(6), controller.robot.wheels)
    controller.reset()
    count, limit = max(LEAST_STEPS, round(SECONDS / dt)), controller.limit
    off, draw = np.empty((count, 3)), np.zeros(6)
    for k in range(count):
        output = controller.step(k * dt, *readings.seen(draw, False), path)
        live.step(np.clip(gain * output, -limit, limit))
        readings.passed(dt)
        off[k] = (live.twist - speeds) / speeds
    return _scatter(off[-round(END * count) :]) <= SETTLED


def _scatter(rows: FloatArray) -> float:
    """Rms of what is no line in time, over all axes."""
    t = np.linspace(-1.0, 1.0, len(rows))
    lines = np.stack([np.ones(len(rows)), t])
    left = rows - lines.T @ np.linalg.lstsq(lines.T, rows, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2)))
