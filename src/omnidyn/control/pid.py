"""PID control of the pose, with the inverse model of the robot in front.

    alpha = R (k_p e + k_i sum e dt) + k_d (nu_ref - nu),      e = pose of the path - pose, in the world
    volts = inverse model of the path's motion, friction included, plus alpha as an acceleration

The gains follow from two poles and a slow one (speed_loop.py). Dry friction is compensated in the direction in which
the robot is to move, the way back to the path included: nu_ref + (p/2) e, p the rate of the two poles. That is k_p/k_d
of a robot that nothing slows down; k_d itself falls below 0 where an axis by itself is faster than the loop may be.
Without `feedforward` nothing is known of the robot but what its volts push.

A drive with a speed loop is asked for a twist, nu_ref + k_p e + k_i sum e dt, by the commands that make it (see
LoopCommands). p, q: what the fast and the slow pole leave of an error in a step:

    k_p = (1 - p q)/dt,  k_i = (1 - p)(1 - q)/dt^2
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, product
from omnidyn.control.controller import WHEEL_SPEED, Guarded
from omnidyn.control.feedforward import DT, LoopCommands, Volts, check_delay, check_dt, lateness
from omnidyn.control.paths.motion import Path
from omnidyn.control.speed_loop import (
    MOST_STEPS,
    SWIFT,
    check_faster,
    check_integral,
    place_gains,
    pole_rate,
    pose_gains,
)
from omnidyn.model.frames import world_to_body
from omnidyn.model.inverse import Effort
from omnidyn.model.robot import Robot

FASTER, INTEGRAL = 3.0, 0.25
CALM = 0.5  # of the fastest pole: that of a speed loop, whose commands show the noise of poses as it is


class Aim(NamedTuple):
    """What a step of the loop shall do, but for the sum of errors.

    turned: world to body, shape (*batch, 3, 3). now: twist of the path, change: acceleration wanted, way: twist which
    friction opposes; shape (*batch, 3).
    """

    turned: FloatArray
    now: FloatArray
    change: FloatArray
    way: FloatArray


class Pid(Guarded):
    """PID control of the pose. See Controller.

    dt [s]: between two steps. faster: how many times as fast as the robot by itself the loop settles. integral: the
    slow pole, as a share of the others; 0 takes no sum of errors. friction: whether dry friction is compensated.
    feedforward: whether the motion of the path is. delay: steps until an output acts; the latency of the drive by
    default: the loop is no faster than that allows. supply [V]: behind a duty.
    """

    name = "pid"

    def __init__(
        self,
        robot: Robot,
        *,
        dt: float = DT,
        faster: float = FASTER,
        integral: float = INTEGRAL,
        friction: bool = True,
        feedforward: bool = True,
        delay: int | None = None,
        supply: float | None = None,
    ) -> None:
        self.dt, self.faster, self.integral = check_dt(dt), check_faster(faster), check_integral(integral)
        self.friction, self.feedforward, self.delay = friction, feedforward, check_delay(delay)
        without = "" if friction else "_no_friction"
        self.name = f"{type(self).name}{without}{'' if feedforward else '_no_feedforward'}"
        super().__init__(robot, supply)

    def _take(self, robot: Robot) -> None:
        super()._take(robot)
        self.late = lateness(robot, self.delay, self.dt)
        if self.output == WHEEL_SPEED:
            self.commands = LoopCommands(robot, self.dt, self.friction)
            self.volts = self.commands.volts
            rates = np.minimum(self.volts.held.rates, CALM * SWIFT / (FASTER * self.dt))
            self.gains = place_gains(rates, self.faster, self.integral, self.dt, self.late)
            return
        self.volts = Volts(robot, self.dt, self.friction)
        self.gains = pose_gains(self.volts.held.rates, self.faster, self.integral, self.dt, self.late)
        self.home = 0.5 * pole_rate(self.volts.held.rates, self.faster, self.dt, self.late)

    def reset(self) -> None:
        """Forget all steps."""
        super().reset()
        self._sum = np.zeros(3)
        self._forget_loop()

    def _safe(self, word: str, start: float) -> FloatArray:
        """Zeros, and why: the robot does not go on as it was asked to."""
        self._forget_loop()
        return super()._safe(word, start)

    def _forget_loop(self) -> None:
        """What is remembered of a speed loop: its sum [rad], mean speeds of the wheels asked for, the last twist."""
        self._loop_sum = self._mean = self._zeros.copy()
        self._reached: FloatArray | None = None

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Path
    ) -> tuple[FloatArray, tuple[str, ...]]:
        motion = path.at(np.array([t, t + self.late, t + self.late + self.dt]))
        off = motion.pose[0] - pose
        off[2] = math.remainder(off[2], 2.0 * math.pi)
        dt = min(dt, MOST_STEPS * self.dt)
        raised_sum = self._sum + off * dt
        if self.output == WHEEL_SPEED:
            return self._commanded(dt, off, pose[2], twist, motion.velocity, raised_sum)
        aim = self.aim(off, pose[2], twist, motion.velocity)
        for total in (raised_sum, self._sum):  # at a limit, nothing is added to the sum
            sent, met = self.volts.within(self.effort(aim, total))
            if not met and np.isfinite(sent).all():
                self._sum = total
                break
        return self._sent(sent), met

    def _commanded(
        self,
        dt: float,
        off: FloatArray,
        heading: FloatArray,
        twist: FloatArray,
        velocity: FloatArray,
        raised_sum: FloatArray,
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """The commands of a speed loop; where the volts are at their limit, nothing is added to the sum of errors."""
        if self._reached is None:
            self._reached = twist
        else:
            self._loop_sum = self._loop_sum + dt * (self._last - self._mean)
        then = self.wanted(off, heading, velocity, raised_sum)
        sent, mean, volts = self.commands.command(self._reached, then, self._loop_sum)
        share = float(np.max(np.abs(volts) / self.commands.limit))
        if share <= 1.0:
            self._sum = raised_sum
        else:  # slower, as the motors can
            then = self.wanted(off, heading, velocity, self._sum) / share
            sent, mean, _ = self.commands.command(self._reached, then, self._loop_sum)
        self._reached, self._mean = then, mean
        return sent, () if share <= 1.0 else ("voltage",)

    def wanted(self, off: FloatArray, heading: FloatArray, velocity: FloatArray, total: FloatArray) -> FloatArray:
        """The twist that a robot with a speed loop shall have a step later: as `aim` and `effort` (3,)."""
        turned = world_to_body(heading[..., None] + np.array([0.0, 1.0]) * self.dt * velocity[1, 2])
        first, second = turned[..., 0, :, :], turned[..., 1, :, :]
        back = self.gains.place * product(first, off) + self.gains.sum * product(first, total)
        then = velocity[2] - self.commands.early * (velocity[2] - velocity[1])
        return product(second, then) + back if self.feedforward else back

    def aim(self, off: FloatArray, heading: FloatArray, twist: FloatArray, velocity: FloatArray) -> Aim:
        """What a step shall do: off, the error of the pose in the world, its angle within half a turn, and the twist.

        Shapes (*batch, 3), that of heading (*batch,). velocity: of the path in the world now, when the output acts,
        and a step later. Shape (3, 3).
        """
        turned = world_to_body(heading[..., None] + np.array([0.0, 1.0]) * self.dt * velocity[1, 2])
        first, second = turned[..., 0, :, :], turned[..., 1, :, :]
        error, now, then = product(first, off), product(first, velocity[1]), product(second, velocity[2])
        speed = product(first, velocity[0])
        if self.sensors.averaged:  # a mean is half a step old
            speed = speed - 0.5 * (then - now)
        back = self.gains.speed * (speed - twist) + self.gains.place * error
        change, way = self.volts.change(now, then), 0.5 * (now + then) + self.home * error
        if not self.feedforward:
            now, change = 0.0 * now, 0.0 * change
        return Aim(first, now, change + back, way)

    def effort(self, aim: Aim, total: FloatArray) -> Effort:
        """What that takes, with a sum of errors in the world [m s, m s, rad s]. (*batch, 3) -> (*batch, wheels)."""
        return self.volts.softly(aim.now, aim.change + self.gains.sum * product(aim.turned, total), aim.way)
