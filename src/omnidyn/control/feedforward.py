"""Feed-forward: the volts that make a robot move as a path asks, were the model the robot. No measurement is used.

    held over dt:  alpha = Phi^-1 (nu_1 - A_d nu_0),   a = alpha + A nu_0
    volts:         of the motion (nu_0, a), by the inverse of all the forces (model/inverse.py)

A_d = e^(A dt) and Phi = A^-1 (A_d - 1) belong to the sliding robot nu' = A nu + alpha; so one step takes it from nu_0
to nu_1 exactly where nothing else bends its way. Dry friction counts with the direction of (nu_0 + nu_1)/2.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm

from omnidyn.arguments import check_order, is_number
from omnidyn.arrays import FloatArray, product
from omnidyn.control.controller import WHEEL_SPEED, Guarded, output_limit
from omnidyn.control.paths.motion import Path
from omnidyn.errors import InputError
from omnidyn.model.drive import Drive
from omnidyn.model.dynamics import motor_wrench
from omnidyn.model.inverse import Effort, Inverse, inverse
from omnidyn.model.mass import per_mass
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed

DT = 0.02  # [s] between two steps, where nobody says
FADE = 0.25  # on paths and floors beside, errors no longer fall below it, while voltages grow restless
MOST_DELAY = 100  # [steps]
LEAST_GAIN, MOST_EMF, MOST_VOLTS = 1e-6, 999.0, 9e4  # [V s/rad], [V s/rad] of a motor, [V]
SHORTEST_STEP, LONGEST_STEP = 1e-5, 10.0  # [s] that may lie between two steps


class LoopMotor(NamedTuple):
    """A drive with a speed loop as motors of volts: what its proportional part does is back-EMF, its command a voltage.

        u = k (c - w) + k_i sum,   k = k_p + k_i share dt        so  u = U - k w + k_i sum  with  U = k c

    robot: the same with K_v l + k [V s/rad] at each wheel, and the volts U of the fastest command as voltage limit.
    gain: k, which makes volts U of a command, shape (wheels,). sum: k_i [V/rad], shape (wheels,). share: of the sum of
    a step that acts within it: a half on a slow robot, all of it on one that settles at once.
    """

    robot: Robot
    gain: FloatArray
    sum: FloatArray


def loop_motor(robot: Robot, dt: float) -> LoopMotor:
    """The motors that a speed loop makes of those of a robot, for steps of dt [s]."""
    drive, motor, count = robot.drive, robot.motor, robot.wheels.count
    emf, gear = per_wheel(motor.emf_constant, count), per_wheel(motor.gear_ratio, count)
    proportional, integral = per_wheel(drive.kp, count), per_wheel(drive.ki, count)
    fastest = output_limit(robot)

    most = np.minimum(MOST_EMF * gear - emf, MOST_VOLTS / fastest)

    def with_gain(wanted: FloatArray) -> tuple[Robot, FloatArray]:
        gain = np.clip(wanted, LEAST_GAIN, most)
        motors = motor.replace(emf_constant=tuple(emf + gain / gear), voltage_limit=tuple(gain * fastest))
        return robot.replace(motor=motors, drive=Drive(dead_band=drive.dead_band, latency=drive.latency)), gain

    stiff, _ = with_gain(proportional + 0.5 * dt * integral)
    settles = max(dt * float(np.mean(step_matrices(inverse(stiff), dt).rates)), 1e-3)
    share = -1.0 / settles - 1.0 / np.expm1(-settles)
    return LoopMotor(*with_gain(proportional + share * dt * integral), integral)


def voltage_for(robot: Robot, twist: ArrayLike, acceleration: ArrayLike) -> FloatArray:
    """The volts under which a robot that moves with a twist speeds up as wanted: `acceleration` backward.

    Friction of every shape, a turning frame, rotors, losses of gears, drops and the dead band of the driver count. At
    rest friction is what holds until it gives way: the volts are those that just break it loose; without acceleration
    they are 0. More than three wheels share the work by least heat in their windings.
    twist [m/s, m/s, rad/s], acceleration of its entries [m/s^2, m/s^2, rad/s^2], shapes (*batch, 3). Returns volts to
    ask of the drivers, shape (*batch, wheels), limits of voltage and current not applied.
    Raises InputError for other shapes.
    """
    check_order("voltage_for(robot, twist, acceleration)", (robot, Robot), (twist, object), (acceleration, object))
    return effort_for(inverse(robot), _vectors("twist", twist), _vectors("acceleration", acceleration)).voltage


def effort_for(model: Inverse, twist: FloatArray, acceleration: FloatArray) -> Effort:
    """Voltages and currents of a motion. Shapes (*batch, 3) -> (*batch, wheels)."""
    twist, acceleration = np.broadcast_arrays(twist, acceleration)
    wrench = model.wrench(twist, acceleration, model.friction(twist, acceleration))
    return model.effort(twist, wrench, acceleration)


def _vectors(name: str, value: ArrayLike) -> FloatArray:
    array = np.asarray(value, dtype=float)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise InputError("wrong shape", got=array.shape, expected="(*batch, 3)", where=name)
    return array


class StepMatrices(NamedTuple):
    """A sliding robot over one held step: nu' = A nu + alpha. A [1/s], decay A_d, gain Phi [s], shapes (3, 3)."""

    A: FloatArray
    decay: FloatArray
    gain: FloatArray
    back: FloatArray  # Phi^-1

    @property
    def rates(self) -> FloatArray:
        """How fast each axis forgets [1/s]. Shape (3,)."""
        return -np.diag(self.A).copy()


def step_matrices(model: Inverse, dt: float) -> StepMatrices:
    """What a step of dt [s] does, viscous friction of every shape included."""
    levels = model.levels
    viscous = (levels.directions.T * levels.viscous) @ levels.directions
    matrix = per_mass(model.robot, motor_wrench(model.robot).braking - viscous).T
    block = np.asarray(expm(np.block([[matrix, np.eye(3)], [np.zeros((3, 6))]]) * dt), dtype=float)
    return StepMatrices(matrix, block[:3, :3], block[:3, 3:], np.asarray(np.linalg.inv(block[:3, 3:]), dtype=float))


class Volts:
    """Motions as volts, step by step: the inverse model of a robot, made ready for steps of dt [s].

    friction: whether dry friction counts; without it the robot is taken to have none.
    """

    def __init__(self, robot: Robot, dt: float, friction: bool = True) -> None:
        model = inverse(robot)
        if not friction:
            zeros = {name: 0.0 * getattr(model.levels, name) for name in model.levels._fields[2:]}
            model = Inverse(robot, model.mass, model.levels._replace(**zeros), model.per_ampere, model.share)
        self.model, self.dt = model, dt
        self.held = step_matrices(model, dt)
        self.fade = _fade(model, dt)
        count, limit = robot.wheels.count, robot.motor.current_limit
        self.limit = per_wheel(robot.motor.voltage_limit, count)
        self.current_limit = per_wheel(np.inf if limit is None else limit, count)

    def change(self, now: FloatArray, then: FloatArray) -> FloatArray:
        """The acceleration at the start of a step that takes the twist from now to then. Shapes (*batch, 3)."""
        step = self.held
        return product(step.back, then - product(step.decay, now)) + product(step.A, now)

    def exactly(self, now: FloatArray, then: FloatArray) -> Effort:
        """What takes the twist from now to then, friction as the model has it; from rest, what breaks it loose."""
        return self.moving(now, then) if now.any() else self.starting(then)

    def moving(self, now: FloatArray, then: FloatArray) -> Effort:
        """What takes a robot in motion from now to then."""
        change, middle = self.change(now, then), 0.5 * (now + then)
        friction = self.model.friction(middle, then - now) - self._viscous(middle - now)
        return self.model.effort(now, self.model.wrench(middle, change, friction), change)

    def starting(self, then: FloatArray) -> Effort:
        """What takes a robot from rest to then."""
        now, change = np.zeros(3), self.change(np.zeros(3), then)
        friction = self.model.friction(now, then)
        return self.model.effort(now, self.model.wrench(0.5 * then, change, friction), change)

    def softly(self, now: FloatArray, acceleration: FloatArray, direction: FloatArray) -> Effort:
        """What a motion takes, dry friction against `direction` [m/s, m/s, rad/s], in proportion where it is slow.

        Shapes (*batch, 3).
        """
        friction = self.model.soft_friction(direction, self.fade) - self._viscous(direction - now)
        return self.model.effort(now, self.model.wrench(now, acceleration, friction))

    def _viscous(self, off: FloatArray) -> FloatArray:
        """Viscous friction of the difference of two twists."""
        levels = self.model.levels
        return -(levels.viscous * product(levels.directions, off)) @ levels.directions

    def beyond(self, effort: Effort) -> tuple[Any, Any]:
        """Whether an effort meets the limit of the voltage of a motor, and of its current. Truths (*batch,)."""
        volts = (np.abs(effort.voltage) >= self.limit).any(axis=-1)
        return volts, (np.abs(effort.current) > self.current_limit).any(axis=-1)

    def within(self, effort: Effort, together: bool = False) -> tuple[FloatArray, tuple[str, ...]]:
        """The volts within the limit of each motor, and the limits met.

        together: all of them smaller by one factor. That keeps the way of the push, right for a loop on the speed:
        it never makes good what it lost beside its way. One on the pose does, and each motor for itself can do more:
        on fast paths its errors are a half to a fifth.
        """
        met = tuple(name for name, is_met in zip(Effort._fields, self.beyond(effort), strict=True) if is_met)
        if together:
            return effort.voltage / max(float(np.max(np.abs(effort.voltage) / self.limit)), 1.0), met
        return np.clip(effort.voltage, -self.limit, self.limit), met


class LoopCommands:
    """Motions as commands of a speed loop, step by step: made ready for steps of dt [s]; friction: as of `Volts`.

        command = (volts - k_i sum)/k,    sum+ = sum + dt (command - mean speed of the wheels)

    The volts are those of the `LoopMotor`. The sum is that of a robot which moves as wanted: what the loop sums up
    beyond it is its own answer to what the model misses.
    """

    def __init__(self, robot: Robot, dt: float, friction: bool = True) -> None:
        self.loop, self.wheels = loop_motor(robot, dt), robot.wheels
        self.limit = per_wheel(robot.motor.voltage_limit, robot.wheels.count)
        self.volts = Volts(self.loop.robot, dt, friction)
        held = self.volts.held
        self._mean_then = np.linalg.solve(held.A, held.gain - dt * np.eye(3)) @ held.back / dt
        self._mean_now = held.gain / dt - self._mean_then @ held.decay
        self.early = float(np.mean(np.diag(self._mean_then))) - 0.5  # of a step, by which a robot is faster than a ramp

    def command(
        self, now: FloatArray, then: FloatArray, total: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(command [rad/s], mean speed of the wheels [rad/s], volts at the motors) of a step from twist to twist (3,).

        total: the sum, shape (wheels,).
        """
        voltage = self.volts.softly(now, self.volts.change(now, then), then).voltage
        twist = product(self._mean_now, now) + product(self._mean_then, then)
        mean = wheel_speed(self.wheels, twist)
        return (voltage - self.loop.sum * total) / self.loop.gain, mean, voltage - self.loop.gain * mean


def _fade(model: Inverse, dt: float) -> FloatArray:
    """The speed of each axis below which its dry friction is compensated in part [m/s, m/s, rad/s]. Shape (3,).

    FADE of what friction takes away within a step: one that changed its side at every speed would push a robot at rest
    to and fro with every bit of noise. Where nothing rubs, 1.
    """
    force = -model.friction(np.eye(3), np.zeros((3, 3)))[range(3), range(3)]
    levels = model.levels
    dry = force - ((levels.directions**2).T @ levels.viscous)
    fade = FADE * dry / np.diag(model.mass) * dt
    return np.where(fade > 1e-12, fade, 1.0)


def check_dt(dt: float) -> float:
    """The time between two steps [s]. Raises InputError outside 1e-5..10 s."""
    if not is_number(dt) or not SHORTEST_STEP <= dt <= LONGEST_STEP:
        raise InputError("step out of range", got=dt, expected=f"{SHORTEST_STEP:g} to {LONGEST_STEP:g} s", where="dt")
    return float(dt)


def check_delay(delay: int | None) -> int | None:
    """Steps until an output acts. Raises InputError outside 0..100."""
    if delay is not None and (isinstance(delay, bool) or delay != int(delay) or not 0 <= delay <= MOST_DELAY):
        raise InputError("not a delay in steps", got=delay, expected=f"0 to {MOST_DELAY}", where="delay")
    return delay


def lateness(robot: Robot, delay: int | None, dt: float) -> float:
    """How long an output takes to act [s]: the delay in steps, else the latency of the drive."""
    return robot.drive.latency if delay is None else delay * dt


class Feedforward(Guarded):
    """Open loop: what the path asks for, by the model alone. See Controller.

    dt [s]: between two steps. friction: whether dry friction counts. delay: steps until an output acts, looked ahead
    over; the latency of the drive by default.
    """

    name = "feedforward"

    def __init__(
        self,
        robot: Robot,
        *,
        dt: float = DT,
        friction: bool = True,
        delay: int | None = None,
        supply: float | None = None,
    ) -> None:
        self.dt, self.friction, self.delay = check_dt(dt), friction, check_delay(delay)
        self.name = type(self).name if friction else f"{type(self).name}_no_friction"
        super().__init__(robot, supply)

    def _take(self, robot: Robot) -> None:
        super()._take(robot)
        self.volts, self.late = Volts(robot, self.dt, self.friction), lateness(robot, self.delay, self.dt)

    def _output(
        self, t: float, dt: float, pose: FloatArray, twist: FloatArray, path: Path
    ) -> tuple[FloatArray, tuple[str, ...]]:
        ahead = t + self.late
        _, twists, _ = path.twist_at(np.array([ahead, ahead + self.dt]))
        if self.output == WHEEL_SPEED:
            return wheel_speed(self.robot.wheels, 0.5 * (twists[0] + twists[1])), ()
        volts, met = self.volts.within(self.volts.exactly(twists[0], twists[1]))
        return self._sent(volts), met
