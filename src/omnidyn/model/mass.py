"""What a robot weighs: its body, and what spins with it, the rotors of its motors and its wheels.

A body whose centre of mass stands at c beside the centre of the wheels has the momenta

    p = M (v_x - omega c_y, v_y + omega c_x),   L = I_n omega + c x p

the latter about the centre of the wheels, of which the twist is.

A wheel that does not slip turns with g . twist / r, its rotor l times as fast. With the kinetic energy

    1/2 twist^T M twist = 1/2 (M (v_x^2 + v_y^2) + I_n omega^2) + 1/2 sum_i (J_i l_i^2 + J_w,i) (g_i . twist / r_i)^2

the mass matrix is that of the body + G diag((J l^2 + J_w)/r^2) G^T. The terms of a turning frame belong to the body
alone: what spins is pushed by J l^2 + J_w times the change of its own speed, however the robot turns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.model.motor import mass_at_rim
from omnidyn.model.robot import Robot

ROUNDING = 1e-12  # of the two axes that an entry joins: less is none, so that axes which do not couple have exact zeros


def mass_matrix(robot: Robot) -> FloatArray:
    """The mass matrix [kg, kg m, kg m^2], symmetric: that of the body and `added_mass`. Shape (3, 3)."""
    return np.diag([robot.body.mass, robot.body.mass, robot.body.inertia]) + (off_centre(robot) + added_mass(robot))


def off_centre(robot: Robot) -> FloatArray:
    """What a centre of mass beside that of the wheels makes of diag(M, M, I_n), added to it. Shape (3, 3)."""
    if not any(robot.body.centre):
        return np.zeros((3, 3))
    x, y = robot.body.centre
    return robot.body.mass * np.array([[0.0, 0.0, -y], [0.0, 0.0, x], [-y, x, x * x + y * y]])


def added_mass(robot: Robot) -> FloatArray:
    """What rotors and wheels add by their spin: G diag(`mass_at_rim`) G^T [kg, kg m, kg m^2]. Shape (3, 3)."""
    if robot.motor.rotor_inertia == 0.0 and robot.wheels.wheel_inertia == 0.0:  # asked for often, and mostly so
        return np.zeros((3, 3))
    wrench, rim_mass = robot.wheels.wrench_matrix, mass_at_rim(robot.motor, robot.wheels)
    added = (wrench * rim_mass) @ wrench.T
    added = 0.5 * (added + added.T)  # symmetric to the last bit
    along = np.sqrt(np.abs(np.diag(added)))
    return np.where(np.abs(added) <= ROUNDING * np.outer(along, along), 0.0, added)


def of_body_alone(robot: Robot) -> Robot:
    """The same robot, rotors and wheels as light as a feather, its centre of mass in the middle: M is diagonal."""
    if not any(robot.body.centre) and robot.motor.rotor_inertia == 0.0 and robot.wheels.wheel_inertia == 0.0:
        return robot
    motor = robot.motor.model_copy(update={"rotor_inertia": 0.0})  # valid: not checked again
    wheels = robot.wheels.model_copy(update={"wheel_inertia": 0.0})
    body = robot.body.model_copy(update={"centre": (0.0, 0.0)})
    return robot.model_copy(update={"motor": motor, "wheels": wheels, "body": body})


def axis_masses(robot: Robot) -> FloatArray:
    """Diagonal of the mass matrix [kg, kg, kg m^2]: all there is where the axes do not couple. Shape (3,)."""
    return np.diag(mass_matrix(robot)).copy()


def masses_couple(robot: Robot) -> bool:
    """Whether a force along one axis speeds up another one: the mass matrix is not diagonal."""
    return _couples(mass_matrix(robot))


def spin_couples(robot: Robot) -> bool:
    """Whether what spins makes it so, wherever the centre of mass is."""
    return _couples(added_mass(robot))


def per_mass(robot: Robot, wrench: ArrayLike) -> FloatArray:
    """Acceleration M^-1 wrench [m/s^2, m/s^2, rad/s^2]. `wrench` [N, N, N m], shape (*batch, 3); returns the same."""
    mass, wrench = mass_matrix(robot), np.asarray(wrench, dtype=float)
    if _couples(mass):
        return np.asarray(np.linalg.solve(mass, wrench[..., None])[..., 0], dtype=float)
    return wrench / np.diag(mass)


def _couples(mass: FloatArray) -> bool:
    """Whether anything stands beside the diagonal."""
    return bool(mass[0, 1] != 0.0 or mass[0, 2] != 0.0 or mass[1, 2] != 0.0)
