"""A loop on the speed of the body: what a driver of /cmd_vel needs. Body velocity in, volts or a duty out.

    r+    = c + p (r - c)                                   the reference follows the command c as fast as the loop can
    volts = inverse model of (r -> r+), friction included,  plus (k e + k_i sum e dt) as an acceleration,  e = r - nu

r in e is that of the time the measured nu is of: earlier by what an output is late, and by half a step for a mean.
The inverse model does the work; the loop corrects what it misses. The sum stops where a motor is at its limit.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.controller import BAD_COMMAND, BAD_TWIST, OK, WHEEL_SPEED, Guarded, Safe, vector
from omnidyn.control.feedforward import DT, Volts, check_delay, check_dt, lateness
from omnidyn.control.paths.motion import Path
from omnidyn.control.pole_placement import check_faster, speed_gains
from omnidyn.model.inverse import Effort
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import wheel_speed

FASTER = 3.0
MOST_STEPS = 5.0  # no error counts for longer: a loop that stood still has not measured meanwhile
SETTLED = 0.2  # of the speed below which friction fades: so near, the command is reached


class _VelocityLoop(Safe):
    """What both loops share: a reference for the twist, the inverse model in front, PI behind."""

    name = "speed"

    def __init__(
        self,
        robot: Robot,
        *,
        dt: float = DT,
        faster: float = FASTER,
        friction: bool = True,
        delay: int | None = None,
        supply: float | None = None,
    ) -> None:
        self.dt, self.faster, self.friction = check_dt(dt), check_faster(faster), friction
        self.delay = check_delay(delay)
        self.name = type(self).name if friction else f"{type(self).name}_no_friction"
        super().__init__(robot, supply)

    def _take(self, robot: Robot) -> None:
        super()._take(robot)
        self.volts, self.late = Volts(robot, self.dt, self.friction), lateness(robot, self.delay, self.dt)
        self.gains = speed_gains(self.volts.held.rates, self.faster, self.dt, self.late)

    def reset(self) -> None:
        """Forget all steps."""
        super().reset()
        self._sum, self._reference, self._past = np.zeros(3), None, []

    def _drive(
        self, dt: float, off: FloatArray, now: FloatArray, then: FloatArray
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """The output that takes the reference from now to then, the twist being off by so much."""
        if self.output == WHEEL_SPEED:  # a loop in the firmware does the rest
            return wheel_speed(self.robot.wheels, then), ()
        raised_sum = self._sum + off * min(dt, MOST_STEPS * self.dt)
        for total in (raised_sum, self._sum):  # at a limit, nothing is added to the sum
            sent, met = self.volts.within(self.effort(off, now, then, total), together=True)
            if not met and np.isfinite(sent).all():
                self._sum = total
                break
        return self._sent(sent), met

    def effort(self, off: FloatArray, now: FloatArray, then: FloatArray, total: FloatArray) -> Effort:
        """What takes the reference from now to then, with a sum of errors [m, m, rad]. Shape (3,) -> (wheels,)."""
        acceleration = self.volts.change(now, then) + self.gains.speed * off + self.gains.sum * total
        return self.volts.softly(now, acceleration, 0.5 * (now + then))


class SpeedLoop(_VelocityLoop):
    """Follows commanded twists: `step(t, twist, command)`, as often as the robot measures its twist.

    dt [s]: between two steps. faster: how many times as fast as the robot by itself the loop settles. friction: whether
    dry friction is compensated. delay: steps until an output acts; the latency of the drive by default. supply [V]:
    behind a duty; the robot's own by default.
    output, limit, info, reset and replace are those of every Controller (controller.py).
    """

    def step(self, t: float, twist: Any, command: Any) -> FloatArray:
        """What to send to the drive from t [s] on, shape (wheels,). Never raises.

        twist: measured, command: wanted, both (v_x, v_y, omega) in the body frame [m/s, m/s, rad/s].
        """
        speed, set_point = vector(twist), vector(command)
        if speed is None or set_point is None:
            return self._guarded(t, BAD_TWIST if speed is None else BAD_COMMAND, "", None)
        speed = self._unfiltered(t, speed)
        return self._guarded(t, "", OK, lambda dt: self._follow(dt, speed, set_point))

    def _follow(self, dt: float, twist: FloatArray, command: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
        now = twist if self._reference is None else self._reference
        then = command + self.gains.decay * (now - command)
        then = np.where(np.abs(then - command) < SETTLED * self.volts.fade, command, then)
        self._reference = then
        return self._drive(dt, self._due(now) - twist, now, then)

    def _due(self, now: FloatArray) -> FloatArray:
        """The reference at the time that a twist measured now is of, straight between two steps. Shape (3,)."""
        back = self.late / self.dt + 0.5 * self.sensors.averaged
        whole = int(back)
        self._past = [now, *self._past[: whole + 1]]
        newer, older = (self._past[min(k, len(self._past) - 1)] for k in (whole, whole + 1))
        return newer + (back - whole) * (older - newer)


class SpeedController(_VelocityLoop, Guarded):
    """A SpeedLoop as a Controller: its command is the twist of the path; where the robot stands it does not ask.

    That is how a robot comes along that has no place to measure. Arguments as for SpeedLoop.
    """

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Path
    ) -> tuple[FloatArray, tuple[str, ...]]:
        ahead = t + self.late
        _, twists, _ = path.twist_at(np.array([t, ahead, ahead + self.dt]))
        return self._drive(dt, self.due(twists) - twist, twists[1], twists[2])

    def due(self, twists: FloatArray) -> FloatArray:
        """The twist that should be measured now, of those of the path now, when an output acts, and a step later."""
        return twists[0] - 0.5 * (twists[2] - twists[1]) if self.sensors.averaged else twists[0]
