"""The state space of eqs (13) (14), and its exact discretisation.

    x' = A x + B u + K sgn(x),   y = C x,   x = twist, u = voltage

A, B and K are not typed from the printed (13) but derived from the forces of dynamics.py, which are linear in twist
and voltage: A = -M^-1 (k G G^T + B_viscous), k = (l K_t)(l K_v)/(R r^2); B = M^-1 g G, g = l K_t/(R r);
K = -M^-1 C_coulomb; M, the mass matrix, counts what spins too (mass.py). sgn is set-valued at 0: K sgn(x) balances
what drives an axis at rest, up to its breakaway.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arguments import check_order
from omnidyn.arrays import FloatArray
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.dynamics import drive_wrench, linear_part, wrench_of_motors
from omnidyn.model.mass import per_mass
from omnidyn.model.motor import Motor
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import Wheels


@dataclass(frozen=True)
class StateSpace:
    """Matrices of eqs (13) (14): A [1/s], shape (3, 3); B, shape (3, wheels); K and C, shape (3, 3).

    Units follow the axes: rows of B in m/s^2/V, m/s^2/V, rad/s^2/V; diagonal of K in m/s^2, m/s^2, rad/s^2.
    """

    A: FloatArray
    B: FloatArray
    K: FloatArray
    C: FloatArray

    @property
    def time_constants(self) -> FloatArray:
        """-1/diag(A) [s]: how fast each axis forgets. Shape (3,)."""
        return -1.0 / np.diag(self.A)


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
    found = MotorWrench(
        wrench_of_motors(motor, wheels, np.eye(3), no_volts),
        wrench_of_motors(motor, wheels, at_rest, np.eye(wheels.count)),
    )
    for each in found:
        each.flags.writeable = False
    return found


def state_space(robot: Robot, motors: MotorWrench | None = None) -> StateSpace:
    """Eqs (13) (14) of a robot: what is linear, with the friction of the body axes as K.

    Left out: inductance, drop and limit of the motors, terms of a turning frame, friction of other shapes.
    motors: its `motor_wrench`, where that is known.
    """
    check_order("state_space(robot)", (robot, Robot))
    motors = motors or motor_wrench(robot)
    viscous, coulomb, _ = robot.friction.axes.levels
    return StateSpace(
        A=per_mass(robot, motors.braking - np.diag(viscous)).T + 0.0,
        B=per_mass(robot, motors.driving).T + 0.0,
        K=per_mass(robot, np.diag(-coulomb)).T,
        C=np.eye(3),
    )


def damping(robot: Robot) -> FloatArray:
    """What brakes each axis per speed: viscous friction of every shape and back-EMF, [N s/m, N s/m, N m s], (3,)."""
    braking = drive_wrench(linear_part(robot), np.eye(3), np.zeros(robot.wheels.count))
    axes, direction, wheels = robot.friction.axes, robot.friction.direction, robot.friction.wheels
    along = np.array([direction.viscous, direction.viscous, direction.yaw_viscous])
    rims = robot.wheels.wrench_matrix**2 @ np.broadcast_to(wheels.viscous, robot.wheels.count)
    return np.array(axes.viscous) + along + rims - np.diag(braking)


def push_per_volt(robot: Robot) -> FloatArray:
    """Wrench at rest per volt of the pattern of each axis, `axis_patterns`, [N/V, N/V, N m/V], (3,)."""
    return np.diag(drive_wrench(linear_part(robot), np.zeros(3), axis_patterns(robot))).copy()


def taken(robot: Robot) -> FloatArray:
    """What each volt of a dead band takes of the push along each axis, by `axis_patterns`, [N/V, N/V, N m/V], (3,)."""
    return np.diag(drive_wrench(linear_part(robot), np.zeros(3), np.sign(axis_patterns(robot)))).copy()


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
