"""Forces and accelerations, eqs (4)-(12) put together.

    M v'_x = F_x - B_x v_x - C_x sgn v_x   (+ M omega v_y)
    M v'_y = F_y - B_y v_y - C_y sgn v_y   (- M omega v_x)
    I omega' = T - B_w omega - C_w sgn omega

without what spins with motors and wheels; with it, or with a centre of mass beside that of the wheels, the mass matrix
of mass.py stands on the left, and with p, the momentum there, the terms in brackets are (omega p_y, -omega p_x,
v_y p_x - v_x p_y).

The terms in brackets belong to a turning body frame; eqs (4) (5) leave them out, `rotating_frame` keeps them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import check_order
from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.errors import InputError
from omnidyn.model.layout import N_AXES, new_states
from omnidyn.model.mass import mass_matrix, masses_couple, per_mass
from omnidyn.model.motor import QUASI_STATIC, Motor, settled_current, traction
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.stick_slip.release import accelerations, moving_states, with_given_currents
from omnidyn.model.surroundings import refuse_slope
from omnidyn.model.wheels import Wheels, refuse_slip, wheel_speed, wrench_from_traction
from omnidyn.shown import SYSTEM, make


def settled_currents(robot: Robot, twist: ArrayLike, voltage: ArrayLike) -> FloatArray:
    """Motor currents [A] with settled windings (L di/dt = 0), eq (11).

    `twist` [m/s, m/s, rad/s], shape (*batch, 3); `voltage` [V], shape (*batch, wheels). Returns (*batch, wheels).
    """
    return settled_current(robot.motor, voltage, wheel_speed(robot.wheels, twist))


def wrench_from_currents(robot: Robot, current: ArrayLike) -> FloatArray:
    """Wrench of the motors on the body [N, N, N m], eqs (7)-(10). `current` [A], shape (*batch, wheels)."""
    return wrench_from_traction(robot.wheels, traction(robot.motor, robot.wheels, current))


def drive_wrench(robot: Robot, twist: ArrayLike, voltage: ArrayLike) -> FloatArray:
    """Wrench of the motors on the body [N, N, N m], eqs (7)-(11), currents settled.

    `twist` [m/s, m/s, rad/s], shape (*batch, 3); `voltage` [V], shape (*batch, wheels). Returns (*batch, 3).
    """
    return wrench_of_motors(robot.motor, robot.wheels, twist, voltage)


def wrench_of_motors(motor: Motor, wheels: Wheels, twist: ArrayLike, voltage: ArrayLike) -> FloatArray:
    """The same, of motors and wheels alone: nothing else of a robot has a part in it."""
    current = settled_current(motor, voltage, wheel_speed(wheels, twist))
    return wrench_from_traction(wheels, traction(motor, wheels, current))


def linear_part(robot: Robot) -> Robot:
    """The same robot with motors whose current is linear in voltage and speed: no drop, no current limit."""
    if robot.motor.current_limit is None and robot.motor.voltage_drop == 0.0:
        return robot
    motor = robot.motor.model_copy(update={"voltage_drop": 0.0, "current_limit": None})  # valid: not checked again
    return robot.model_copy(update={"motor": motor})


def frame_wrench(robot: Robot, twist: ArrayLike) -> FloatArray:
    """Apparent wrench [N, N, N m] of the turning body frame, M omega (v_y, -v_x, 0) where the centre of mass is that of
    the wheels; zero where the robot leaves it out."""
    twist = np.asanyarray(twist, dtype=float)
    if not robot.body.rotating_frame:
        return np.zeros_like(twist)
    x, y, omega = np.moveaxis(twist, -1, 0)
    about = np.zeros_like(omega)
    if any(robot.body.centre):
        c, d = robot.body.centre
        about = -omega * (c * x + d * y)
        x, y = x - omega * d, y + omega * c  # of the centre of mass
    return robot.body.mass * np.stack([omega * y, -omega * x, about], axis=-1)


def frame_terms(robot: Robot) -> FloatArray:
    """The same wrench as a matrix: per omega v_y, -omega v_x and omega^2 [kg, kg, kg m], columns. Shape (3, 3)."""
    turned = frame_wrench(robot, np.array([[0.0, 1.0, 1.0], [-1.0, 0.0, 1.0], [0.0, 0.0, 1.0]]))
    return np.stack([turned[0] - turned[2], turned[1] - turned[2], turned[2]], axis=1) + 0.0


def acceleration(robot: Robot, twist: ArrayLike, voltage: ArrayLike) -> FloatArray:
    """Acceleration of the twist [m/s^2, m/s^2, rad/s^2], eqs (4)-(6), currents settled.

    Friction at rest balances what drives it; where several parts hold at once, stick_slip/inclusion.py decides. What
    bends (Dahl, LuGre) counts as it has settled at that speed.
    `twist` [m/s, m/s, rad/s], shape (*batch, 3); `voltage` [V], shape (*batch, wheels). Returns (*batch, 3).
    Raises InputError for other shapes, UnsupportedError on a slope, whose pull depends on the heading.
    """
    check_order("acceleration(robot, twist, voltage)", (robot, Robot), (twist, object), (voltage, object))
    refuse_slope(robot.floor, "accelerations know")
    refuse_slip(robot.wheels, "accelerations know")
    twist, voltage = _vectors("twist", twist, N_AXES), _vectors("voltage", voltage, robot.wheels.count)
    batch, n = _batch(twist, voltage), robot.wheels.count
    if axes_move_alone(robot):
        applied = drive_wrench(robot, twist, voltage) + frame_wrench(robot, twist)
        return per_mass(robot, applied + robot.friction.axes.wrench(twist, applied))
    twists = np.broadcast_to(twist, (*batch, 3)).reshape(-1, 3)
    volts = np.array(np.broadcast_to(voltage, (*batch, n)), dtype=float).reshape(-1, n)  # writable: one kernel for all
    numbers = plant(robot.rigid.replace(motor=robot.motor.replace(electrical=QUASI_STATIC)))
    return (accelerations(numbers, moving_states(numbers, twists), volts) / [1.0, 1.0, numbers.body.length]).reshape(
        *batch, 3
    )


def friction_wrench(robot: Robot, twist: ArrayLike, voltage: ArrayLike) -> FloatArray:
    """Wrench of friction on the body [N, N, N m], eqs (4)-(6) solved for it: M a - G f - the turning frame's.

    In motion it resists, at rest it balances what drives. Arguments, shapes and errors: `acceleration`.
    """
    total = np.asarray(acceleration(robot, twist, voltage) @ mass_matrix(robot), dtype=float)
    return total - drive_wrench(robot, twist, voltage) - frame_wrench(robot, np.asarray(twist, dtype=float))


def holds_under(robot: Robot) -> Callable[[FloatArray], BoolArray]:
    """A test of whether nothing at all moves from rest under voltages [V], to the last bit: (k, wheels) -> (k,).

    For many tests of one robot: what they share is made once.
    """
    if axes_hold_alone(robot):
        return lambda voltage: np.all(
            robot.friction.axes.holds(drive_wrench(robot, np.zeros((len(voltage), 3)), voltage)), axis=-1
        )
    numbers = plant(
        robot.rigid.model_copy(update={"motor": robot.motor.model_copy(update={"electrical": QUASI_STATIC})})
    )
    bare = with_given_currents(numbers)

    def holds(voltage: FloatArray) -> BoolArray:
        volts = np.ascontiguousarray(voltage, dtype=float)
        at_rest = new_states(numbers, len(volts))
        return np.all(accelerations(numbers, at_rest, volts, bare) == 0.0, axis=-1)

    return holds


def _vectors(name: str, value: ArrayLike, size: int) -> FloatArray:
    """An array of vectors of so many entries. Raises InputError for another shape."""
    array = np.asarray(value, dtype=float)
    if array.ndim == 0 or array.shape[-1] != size:
        raise InputError(
            "wrong shape",
            got=array.shape,
            expected=f"(*batch, {size})",
            where=name,
            remedy="give one value per wheel of the robot" if name == "voltage" else "give vx, vy and omega",
        )
    return array


def _batch(twist: FloatArray, voltage: FloatArray) -> tuple[int, ...]:
    """The leading axes of both. Raises InputError where they do not go together."""
    try:
        return np.broadcast_shapes(twist.shape[:-1], voltage.shape[:-1])
    except ValueError:
        raise InputError(
            "twist and voltage do not go together",
            got=f"{twist.shape} and {voltage.shape}",
            expected="the same leading axes",
            remedy="give a voltage for each twist, or one for all",
            where="voltage",
        ) from None


def axes_hold_alone(robot: Robot) -> bool:
    """Whether nothing but the friction of each body axis, for itself, can hold the robot: the paper's case."""
    return robot.friction.only_axes and bool(np.all(np.asarray(robot.motor.gear_efficiency) == 1.0))


def direction_holds_alone(robot: Robot) -> bool:
    """Whether nothing but friction along the direction of travel and about yaw can hold the robot."""
    return robot.friction.only_direction and bool(np.all(np.asarray(robot.motor.gear_efficiency) == 1.0))


def axes_move_alone(robot: Robot) -> bool:
    """Whether, besides, no axis at rest has to hold against another one that speeds up."""
    return axes_hold_alone(robot) and not masses_couple(robot)


# The state space of eqs (13) (14), and its exact discretisation
#
# x' = A x + B u + K sgn(x),   y = C x,   x = twist, u = voltage
#
# A, B and K are not typed from the printed (13) but derived from the forces of dynamics.py, which are linear in twist
# and voltage: A = -M^-1 (k G G^T + B_viscous), k = (l K_t)(l K_v)/(R r^2); B = M^-1 g G, g = l K_t/(R r);
# K = -M^-1 C_coulomb; M, the mass matrix, counts what spins too (mass.py). sgn is set-valued at 0: K sgn(x) balances
# what drives an axis at rest, up to its breakaway.


@dataclass(frozen=True)
class StateSpace:
    """Matrices of eqs (13) (14): A [1/s], shape (3, 3); B, shape (3, wheels); K and C, shape (3, 3); D, (3, wheels).

        x' = A (x - x0) + B (u - u0) + K sgn(x),   y = C x + D u,   D = 0

    Units follow the axes: rows of B in m/s^2/V, m/s^2/V, rad/s^2/V; diagonal of K in m/s^2, m/s^2, rad/s^2.
    twist x0 [m/s, m/s, rad/s], shape (3,), voltage u0 [V], shape (wheels,): the operating point, which holds itself;
    zeros without one. At one K is 0: the friction there is in u0, its slope in A.
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray
    C: FloatArray
    D: FloatArray
    twist: FloatArray
    voltage: FloatArray

    @property
    def time_constants(self) -> FloatArray:
        """-1/diag(A) [s]: how fast each axis forgets. Shape (3,)."""
        return -1.0 / np.diag(self.A)

    def to_control(self) -> Any:
        """The linear part as a control.StateSpace: inputs u1, ... [V], states and outputs vx, vy, omega.

        Of deviations from the operating point. Raises MissingExtraError where python-control is missing.
        """
        return make(SYSTEM, self)


class MotorWrench(NamedTuple):
    """What the motors do, as linear maps: -k G G^T and g G of the equations above, transposed.

    braking: wrench [N, N, N m] of each unit of the twist without voltage, shape (3, 3). driving: of each volt at rest,
    shape (wheels, 3).
    """

    braking: FloatArray
    driving: FloatArray


def motor_wrench(robot: Robot) -> MotorWrench:
    """The motors of a robot, without their drop and limit. Its arrays are read-only."""
    return _motor_wrench(linear_part(robot).motor, robot.wheels)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=64)
def _motor_wrench(motor: Motor, wheels: Wheels) -> MotorWrench:
    """Asked for several times in each fit, mostly of the same motors."""
    at_rest, no_volts = np.zeros(3), np.zeros(wheels.count)
    wrench = MotorWrench(
        wrench_of_motors(motor, wheels, np.eye(3), no_volts),
        wrench_of_motors(motor, wheels, at_rest, np.eye(wheels.count)),
    )
    for matrix in wrench:
        matrix.flags.writeable = False
    return wrench


def state_space(robot: Robot, motors: MotorWrench | None = None, *, twist: ArrayLike | None = None) -> StateSpace:
    """Eqs (13) (14) of a robot: what is linear, with the friction of the body axes as K; or its linear part elsewhere.

    Left out: inductance, drop and limit of the motors, terms of a turning frame, friction of other shapes.
    motors: its `motor_wrench`, where that is known.
    twist: an operating point [m/s, m/s, rad/s], shape (3,); then the slopes of `acceleration` there, friction of every
    shape and the turning frame included. Where it rests, dry friction is left out of A: it has no slope there.
    Raises InputError for what is no twist.
    """
    check_order("state_space(robot)", (robot, Robot))
    if twist is not None:
        return _at_operating_point(robot, _vectors("twist", twist, N_AXES))
    motors = motors or motor_wrench(robot)
    viscous, coulomb, _ = robot.friction.axes.levels
    return StateSpace(
        A=per_mass(robot, motors.braking - np.diag(viscous)).T + 0.0,
        B=per_mass(robot, motors.driving).T + 0.0,
        K=per_mass(robot, np.diag(-coulomb)).T,
        C=np.eye(3),
        D=np.zeros((3, robot.wheels.count)),
        twist=np.zeros(3),
        voltage=np.zeros(robot.wheels.count),
    )


ASIDE = 1e-6  # [m/s, rad/s] by which an axis at rest is moved, so that its friction has one sign


def _at_operating_point(robot: Robot, twist: FloatArray) -> StateSpace:
    """Central differences of `acceleration`, on one side of every jump; the voltage of least squares that holds it."""
    if twist.shape != (3,):
        raise InputError("not an operating point", got=f"shape {twist.shape}", expected="(3,): vx, vy, omega")
    if not np.isfinite(twist).all():
        raise InputError("not an operating point", got=twist.tolist(), expected="finite numbers", where="twist")
    friction, still = robot.friction, not twist[:2].any()
    if still:  # its direction is open, and so is that of its friction
        bare = friction.direction.replace(coulomb=(0.0, 0.0), breakaway=None)
        friction = friction.replace(direction=bare)
    moved = robot.replace(friction=friction)
    point = np.where(twist == 0.0, ASIDE, twist)
    count, step = robot.wheels.count, 0.1 * ASIDE
    volts = np.zeros(count)
    ends = np.concatenate([point + step * np.eye(3), point - step * np.eye(3)])
    first, second = np.split(acceleration(moved, ends, volts), 2)
    pushed = acceleration(moved, point, np.concatenate([np.eye(count), np.zeros((1, count))]))
    B = (pushed[:-1] - pushed[-1]).T
    return StateSpace(
        A=(first - second).T / (2.0 * step),
        B=B,
        K=np.zeros((3, 3)),
        C=np.eye(3),
        D=np.zeros((3, count)),
        twist=twist,
        voltage=-np.linalg.pinv(B) @ acceleration(robot, twist, volts),
    )


def damping(robot: Robot) -> FloatArray:
    """What brakes each axis per speed: viscous friction of every shape and back-EMF, [N s/m, N s/m, N m s], (3,)."""
    braking = drive_wrench(linear_part(robot), np.eye(3), np.zeros(robot.wheels.count))
    axes, direction, wheels = robot.friction.axes, robot.friction.direction, robot.friction.wheels
    along = np.array([direction.viscous, direction.viscous, direction.yaw_viscous])
    rims = robot.wheels.wrench_matrix**2 @ np.broadcast_to(wheels.viscous, robot.wheels.count)
    return np.array(axes.viscous) + along + rims - np.diag(braking)


def is_decoupled(system: StateSpace, tolerance: float = 1e-12) -> bool:
    """Whether each axis moves for itself: A diagonal within `tolerance`, relative to the axes it joins."""
    scale = np.sqrt(np.abs(np.outer(np.diag(system.A), np.diag(system.A))))
    # An entry joins axes of different units; A[i, j] A[j, i] has none.
    coupling = np.sqrt(np.abs(system.A * system.A.T)) / scale
    return bool(np.all(coupling - np.eye(3) <= tolerance))


def discretise(system: StateSpace, dt: ArrayLike) -> FloatArray:
    """phi = (1 - e^(-a dt))/a of each decoupled axis, a = -diag(A): the voltage held over dt moves a sliding axis by

        v(dt) = v + phi (drive - a v),   so  A_d = 1 - a phi,  B_d = phi B,  K_d = phi K.

    `dt` [s], shape (*batch,). Returns phi [s], shape (*batch, 3). expm1 keeps every digit of a short step.
    """
    rate = -np.diag(system.A)
    return -np.expm1(-rate * np.asarray(dt, dtype=float)[..., None]) / rate
