"""The state space of eqs (13) (14), and its exact discretisation.

    x' = A x + B u + K sgn(x),   y = C x,   x = twist, u = voltage

A, B and K are not typed from the printed (13) but derived from the forces of dynamics.py, which are linear in twist
and voltage: A = -M^-1 (k G G^T + B_viscous), k = (l K_t)(l K_v)/(R r^2); B = M^-1 g G, g = l K_t/(R r);
K = -M^-1 C_coulomb. sgn is set-valued at 0: K sgn(x) balances what drives an axis at rest, up to its breakaway.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.dynamics import drive_wrench, linear_part, mass_matrix
from omnidyn.model.robot import Robot

FloatArray = NDArray[np.float64]


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


def state_space(robot: Robot) -> StateSpace:
    """Eqs (13) (14) of a robot: what is linear, with the friction of the body axes as K.

    Left out: inductance, drop and limit of the motors, terms of a turning frame, friction of other shapes.
    """
    count = robot.wheels.count
    at_rest, no_voltage = np.zeros(3), np.zeros(count)
    mass = mass_matrix(robot)
    viscous, coulomb, _ = robot.friction.axes.levels
    linear = linear_part(robot)
    braking = drive_wrench(linear, np.eye(3), no_voltage)
    driving = drive_wrench(linear, at_rest, np.eye(count))
    return StateSpace(
        A=(braking.T - np.diag(viscous)) / mass[:, None] + 0.0,
        B=driving.T / mass[:, None] + 0.0,
        K=np.diag(-coulomb / mass),
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
