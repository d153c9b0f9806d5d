"""A loop on the speed of the body: what a driver of /cmd_vel needs. Body velocity in, volts or a duty out.

    r+    = c + p (r - c)                                   the reference follows the command c as fast as the loop can
    volts = inverse model of (r -> r+), friction included,  plus (k e + k_i sum e dt) as an acceleration,  e = r - nu

r in e is that of the time the measured nu is of: earlier by what an output is late, and by half a step for a mean.
The inverse model does the work; the loop corrects what it misses. The sum stops where a motor is at its limit.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.control.controller import BAD_COMMAND, BAD_TWIST, OK, WHEEL_SPEED, Guarded, Safe, vector
from omnidyn.control.feedforward import DT, Volts, check_delay, check_dt, lateness
from omnidyn.control.paths.motion import Path
from omnidyn.errors import InputError
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


# Gains by where the poles of the closed loop should lie, from the state space of the robot. Each axis for itself
#
# A step of dt [s] takes the errors of an axis (e, its rate, the sum of e dt) and the acceleration alpha to
#
#     e+ = e + phi e' - beta alpha,   e'+ = d e' - phi alpha,   sum+ = sum + dt e,      d = e^(-a dt), phi = (1 - d)/a,
#                                                                                     beta = (dt - phi)/a
#
# and alpha = k_p e + k_d e' + k_i (sum + dt e) puts the three poles where they are wanted (Ackermann's formula), for
# any dt. A pole at 1 needs no sum: k_i = 0. a is what the robot does by itself: -diag(A) of eqs (13), viscous friction
# included.

SWIFT = 0.4  # the fastest pole of a loop, in radians a step
SWIFT_LATE = 0.6  # and in radians of a step and all that its outputs are late: at twice that a loop begins to swing
MOST_FASTER = 1e3


class PoseGains(NamedTuple):
    """Of each axis: on the error of the place [1/s^2], of the speed [1/s], of the sum of the place [1/s^3]. (3,)."""

    place: FloatArray
    speed: FloatArray
    sum: FloatArray


class SpeedGains(NamedTuple):
    """Of each axis: on the error of the speed [1/s], of its sum [1/s^2]; decay of the reference a step [1]. (3,)."""

    speed: FloatArray
    sum: FloatArray
    decay: FloatArray


def pole_rate(rates: FloatArray, faster: float, dt: float, late: float = 0.0) -> FloatArray:
    """How fast the loop of each axis shall forget [1/s]: so many times as fast as the robot, within what time allows.

    dt [s]: between two steps; late [s]: until an output acts.
    """
    return np.minimum(faster * np.maximum(rates, 1e-3), min(SWIFT / dt, SWIFT_LATE / (dt + late)))


def pose_gains(rates: FloatArray, faster: float, integral: float, dt: float, late: float = 0.0) -> PoseGains:
    """Two poles at `pole_rate`, one at the share `integral` of it. rates a [1/s], shape (3,)."""
    gains = [
        _ackermann(float(a), float(rate), float(integral * rate), dt)
        for a, rate in zip(rates, pole_rate(rates, faster, dt, late), strict=True)
    ]
    return PoseGains(*np.array(gains).T)


def place_gains(rates: FloatArray, faster: float, integral: float, dt: float, late: float = 0.0) -> PoseGains:
    """The same where speeds are had as they are asked for: k_p = (1 - p q)/dt, k_i = (1 - p)(1 - q)/dt^2."""
    rate = pole_rate(rates, faster, dt, late)
    p, q = np.exp(-rate * dt), np.exp(-integral * rate * dt)
    return PoseGains((1.0 - p * q) / dt, 0.0 * rate, (1.0 - p) * (1.0 - q) / dt**2)


def _ackermann(a: float, rate: float, slow: float, dt: float) -> FloatArray:
    """(k_p, k_d, k_i) of an axis."""
    d, phi = np.exp(-a * dt), -np.expm1(-a * dt) / a
    move = np.array([[1.0, phi, 0.0], [0.0, d, 0.0], [dt, 0.0, 1.0]])
    push = np.array([-(dt - phi) / a, -phi, 0.0])
    p, q = np.exp(-rate * dt), np.exp(-slow * dt)
    if slow == 0.0:  # no sum: two poles, two gains
        move, push = move[:2, :2], push[:2]
    polynomial = (move - p * np.eye(len(move))) @ (move - p * np.eye(len(move)))
    reach = [push]
    for _ in range(len(push) - 1):
        reach.append(move @ reach[-1])
    if slow > 0.0:
        polynomial = polynomial @ (move - q * np.eye(3))
    last = np.zeros(len(push))
    last[-1] = 1.0
    gains = -last @ np.linalg.inv(np.column_stack(reach)) @ polynomial  # alpha = gains . errors, and the errors fall
    return np.array([gains[0] - dt * gains[2], gains[1], gains[2]]) if slow > 0.0 else np.append(gains, 0.0)


def speed_gains(rates: FloatArray, faster: float, dt: float, late: float = 0.0) -> SpeedGains:
    """Both poles of each axis at `pole_rate`: k = (d - p^2)/phi, k_i dt = (1 - p)^2/phi, p = e^(-rate dt)."""
    rate = pole_rate(rates, faster, dt, late)
    d, phi = np.exp(-rates * dt), -np.expm1(-rates * dt) / rates
    p = np.exp(-rate * dt)
    return SpeedGains((d - p**2) / phi, (1.0 - p) ** 2 / (phi * dt), p)


def check_faster(faster: float) -> float:
    """How many times as fast as the robot. Raises InputError outside 0.05..1000."""
    if not isinstance(faster, int | float) or not 0.05 <= faster <= MOST_FASTER:
        raise InputError(
            "no speed for a loop",
            got=faster,
            expected=f"0.05 to {MOST_FASTER:g} times that of the robot",
            where="faster",
        )
    return float(faster)


def check_integral(integral: float) -> float:
    """The share of the slow pole. Raises InputError outside 0..1."""
    if not isinstance(integral, int | float) or not 0.0 <= integral <= 1.0:
        raise InputError(
            "no share for the slow pole", got=integral, expected="0 (no sum of errors) to 1", where="integral"
        )
    return float(integral)
