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

The sum is of what a model misses, and that is little. Errors for which k_p alone asks for more than SUMMED of what the
motors can do, e > e_s, raise it by e (e_s/e)^2 and no more: a robot that is held and let go overshoots little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray, product
from omnidyn.compiled.scalar_function import scalar_function
from omnidyn.control.controller import WHEEL_SPEED, Guarded
from omnidyn.control.feedforward import DT, LoopCommands, Volts, check_delay, check_dt, lateness
from omnidyn.control.paths.ahead import Ahead
from omnidyn.control.paths.motion import Path
from omnidyn.control.pole_placement import SWIFT, check_faster, check_integral, place_gains, pole_rate, pose_gains
from omnidyn.control.speed_loop import MOST_STEPS
from omnidyn.control.swing import Swing
from omnidyn.model.frames import world_to_body
from omnidyn.model.inverse import Effort
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds

FASTER, INTEGRAL = 3.0, 0.25
SUMMED = 0.15  # of the top speed, or of the acceleration towards it
MOST_FAR = 1e6  # [m], [rad]
CALM = 0.5  # of the fastest pole: that of a speed loop, whose commands show the noise of poses as it is


Three = tuple[float, float, float]


class Aim(NamedTuple):
    """What a step of the loop shall do, but for the sum of errors.

    turned: world to body, shape (*batch, 3, 3). now: twist of the path, change: acceleration wanted. friction_twist:
    what friction opposes; shape (*batch, 3).
    """

    turned: FloatArray
    now: FloatArray
    change: FloatArray
    friction_twist: FloatArray


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
        self.swing = Swing(robot, self.dt)
        self._ahead = Ahead(self.dt, self.late, vars(self).get("_ahead"))
        if self.output == WHEEL_SPEED:
            self.commands = LoopCommands(robot, self.dt, self.friction)
            self.volts = self.commands.volts
            rates = np.minimum(self.volts.held.rates, CALM * SWIFT / (FASTER * self.dt))
            self.gains = place_gains(rates, self.faster, self.integral, self.dt, self.late)
        else:
            self.volts = Volts(robot, self.dt, self.friction)
            self.gains = pose_gains(self.volts.held.rates, self.faster, self.integral, self.dt, self.late)
            self.home = 0.5 * pole_rate(self.volts.held.rates, self.faster, self.dt, self.late)
        self.farthest = self._farthest()
        self._limits = tuple((self.volts if self.output != WHEEL_SPEED else self.commands).limit.tolist())
        self._current_limits = tuple(self.volts.current_limit.tolist())
        self._has_current_limit = bool(np.isfinite(self.volts.current_limit).any())
        self._law = _in_numbers(*self.law())

    def _farthest(self) -> tuple[float, float]:
        """Squares of the largest errors that are summed up as they are [m^2], [rad^2]."""
        reach = SUMMED * top_speeds(self.robot) * (1.0 if self.output == WHEEL_SPEED else self.volts.held.rates)
        x, y, turn = np.divide(reach, self.gains.place, out=np.full(3, np.inf), where=reach > 0.0).tolist()
        return min(x, y, MOST_FAR) ** 2, min(turn, MOST_FAR) ** 2

    def law(self) -> tuple[dict[str, tuple[int, ...]], Callable[..., dict[str, Any]]]:
        """What a step works out: shapes of its arguments by name, and the function of them, arrays by name."""
        if self.output == WHEEL_SPEED:
            shapes = {"off": (3,), "heading": (), "velocity": (3, 3), "total": (3,), "share": (), "now": (3,)}
            return shapes | {"loop": (self.robot.wheels.count,)}, self._commands
        return {"off": (3,), "heading": (), "twist": (3,), "velocity": (3, 3), "total": (3,)}, self._volts

    def _volts(self, off: Any, heading: Any, twist: Any, velocity: Any, total: Any) -> dict[str, Any]:
        effort = self.effort(self.aim(off, heading, twist, velocity), total)
        return {"output": effort.voltage, "current": effort.current}

    def _commands(
        self, off: Any, heading: Any, velocity: Any, total: Any, share: Any, now: Any, loop: Any
    ) -> dict[str, Any]:
        then = self.wanted(off, heading, velocity, total) / share
        sent, mean, volts = self.commands.command(now, then, loop)
        return {"output": sent, "mean": mean, "volts": volts, "then": then}

    def reset(self) -> None:
        """Forget all steps."""
        super().reset()
        self._sum = (0.0, 0.0, 0.0)
        self.swing.reset()
        self._forget_loop()

    def _safe(self, word: str, start: float) -> FloatArray:
        """Zeros, and why: the robot does not go on as it was asked to."""
        self._forget_loop()
        return super()._safe(word, start)

    def _forget_loop(self) -> None:
        """What is remembered of a speed loop: its sum [rad], mean speeds of the wheels asked for, the last twist."""
        self._loop_sum = self._mean = (0.0,) * len(self._zeros)
        self._reached: tuple[float, ...] | None = None

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Path
    ) -> tuple[FloatArray, tuple[str, ...]]:
        place, velocity = self._ahead.at(t, path)
        x, y, heading = pose.tolist()
        vx, vy, omega = speed = tuple(twist.tolist())
        cos, sin, (east, north) = math.cos(heading), math.sin(heading), velocity[:2]
        self._swinging = self.swing.found(
            t, vx - cos * east - sin * north, vy + sin * east - cos * north, omega - velocity[2]
        )
        off = place[0] - x, place[1] - y, math.remainder(place[2] - heading, 2.0 * math.pi)
        dt = min(dt, MOST_STEPS * self.dt)
        place, turn = self.farthest
        place, turn = place / max(place, off[0] * off[0] + off[1] * off[1]), turn / max(turn, off[2] * off[2])
        sum_x, sum_y, sum_heading = self._sum
        raised_sum = (
            summed(sum_x, off[0] * dt, place),
            summed(sum_y, off[1] * dt, place),
            summed(sum_heading, off[2] * dt, turn),
        )
        if self.output == WHEEL_SPEED:
            return self._commanded(dt, off, heading, speed, velocity, raised_sum)
        count = len(self._zeros)
        for total in (raised_sum, self._sum):  # at a limit, nothing is added to the sum
            found = self._law(off, heading, speed, velocity, total)
            sent, met = self._within(found[:count], found[count:])
            if not met and math.isfinite(sum(sent)):
                self._sum = total
                break
        return self._sent(np.array(sent)), met

    def _within(self, volts: Sequence[float], currents: Sequence[float]) -> tuple[Sequence[float], tuple[str, ...]]:
        """The volts within the limit of each motor, and the limits met: see `Volts.within`."""
        met: tuple[str, ...] = ()
        for volt, limit in zip(volts, self._limits, strict=True):
            if not abs(volt) < limit:
                met = ("voltage",)
        if met:
            volts = [min(max(volt, -limit), limit) for volt, limit in zip(volts, self._limits, strict=True)]
        for current, limit in zip(currents, self._current_limits, strict=True) if self._has_current_limit else ():
            if abs(current) > limit:
                return volts, (*met, "current")
        return volts, met

    def _commanded(
        self,
        dt: float,
        off: Three,
        heading: float,
        twist: tuple[float, ...],
        velocity: tuple[float, ...],
        raised_sum: Three,
    ) -> tuple[FloatArray, tuple[str, ...]]:
        """The commands of a speed loop; where the volts are at their limit, nothing is added to the sum of errors."""
        if self._reached is None:
            self._reached = twist
        else:
            rows = zip(self._loop_sum, self._last.tolist(), self._mean, strict=True)
            self._loop_sum = tuple([total + dt * (sent - mean) for total, sent, mean in rows])
        count = len(self._zeros)
        found = self._law(off, heading, velocity, raised_sum, 1.0, self._reached, self._loop_sum)
        volts = found[2 * count : 3 * count]
        share = max([abs(volt) / limit for volt, limit in zip(volts, self._limits, strict=True)])
        if share <= 1.0:
            self._sum = raised_sum
        else:  # slower, as the motors can
            found = self._law(off, heading, velocity, self._sum, share, self._reached, self._loop_sum)
        self._mean, self._reached = found[count : 2 * count], found[3 * count :]
        return np.array(found[:count]), () if share <= 1.0 else ("voltage",)

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
        change, friction_twist = self.volts.change(now, then), 0.5 * (now + then) + self.home * error
        if not self.feedforward:
            now, change = 0.0 * now, 0.0 * change
        return Aim(first, now, change + back, friction_twist)

    def effort(self, aim: Aim, total: FloatArray) -> Effort:
        """What that takes, with a sum of errors in the world [m s, m s, rad s]. (*batch, 3) -> (*batch, wheels)."""
        return self.volts.softly(aim.now, aim.change + self.gains.sum * product(aim.turned, total), aim.friction_twist)


def summed(total: float, more: float, weight: float) -> float:
    """A sum of errors and one more: raised by its weight, lowered by all of it, a weight below 1 not beyond 0."""
    if more * total >= 0.0:
        return total + weight * more
    lowered = total + more
    return 0.0 if weight < 1.0 and lowered * total < 0.0 else lowered


def _in_numbers(
    shapes: Mapping[str, tuple[int, ...]], law: Callable[..., dict[str, Any]]
) -> Callable[..., tuple[float, ...]]:
    """A law of arrays as one of plain numbers, flat and in order: traced, or where that cannot be, as it stands."""
    traced = scalar_function(shapes, law)
    if traced is not None:
        return traced

    def called(*arguments: Any) -> tuple[float, ...]:
        arrays = (np.reshape(value, shape) for value, shape in zip(arguments, shapes.values(), strict=True))
        return tuple(np.concatenate(list(law(*arrays).values())).tolist())

    return called
