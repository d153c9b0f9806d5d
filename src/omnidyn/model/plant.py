"""Plant: a robot as two tables of numbers that the compiled solvers read and work in.

Yaw is measured as length, rho = sqrt(I/M): the velocity x = (v_x, v_y, rho omega) [m/s] has the same mass M in every
direction, and a wrench (F_x, F_y, T/rho) is in newtons throughout. Elements are where dry friction acts on one scalar
speed: rows 0..2 the body axes, 3.. the wheels. The ellipse of the direction of travel acts on (v_x, v_y) as a whole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

FloatArray = NDArray[np.float64]
AXES = 3  # rows of the body axes

# Body: entries of a vector. The first are the robot's, the rest belong to the problem being solved.
MASS, LENGTH, TURNING = 0, 1, 2  # M [kg]; rho [m]; M/rho where the body frame turns, else 0
SLIDE_X, SLIDE_Y, HOLD_X, HOLD_Y = 3, 4, 5, 6  # the ellipse, Coulomb and breakaway levels [N]
ELLIPSE = 7  # its sign: 1 slides, 0 stuck, 2 there is none
TAU, GOAL, PUSH = 8, 9, 12  # length of the stage [s]; x* [m/s], 3 entries; constant wrench [N], 3 entries
BODY_SIZE = 15

# Element: columns of a table with one row per element.
GX, GY, GZ, VISCOUS = 0, 1, 2, 3  # local speed = g . x; [N s/m]
SLIDE, HOLD = 4, 6  # Coulomb and breakaway level [N]: against forward motion, and (+1) against backward motion
ACTIVE = 8  # 1 when the element can stick
GAIN, EMF, RESISTANCE, INDUCTANCE, DROP, LIMIT, EFFICIENCY = 9, 10, 11, 12, 13, 14, 15  # of a wheel's motor
SIGN = 16  # 1 and -1 slide forward and backward, 0 stuck, 2 no dry friction
VOLTAGE, BOUND, NOW, CURRENT = 17, 18, 19, 20  # applied [V]; current limit in force [A]; i* and i at the solution [A]
LOSS, FOUND, BEFORE = 21, 23, 24  # gear loss at rest [N], forward and (+1) backward; marks of the solver
ELEMENT_SIZE = 25


class Plant(NamedTuple):
    """body: shape (BODY_SIZE,). element: shape (3 + wheels, ELEMENT_SIZE). Entries as named above."""

    body: FloatArray
    element: FloatArray

    @property
    def wheels(self) -> int:
        """Number of wheels."""
        return len(self.element) - AXES

    def copy(self) -> Plant:
        """The same numbers in arrays of their own."""
        return Plant(self.body.copy(), self.element.copy())


def plant(robot: Robot) -> Plant:
    """The numbers of a robot, all friction put together; everything that can stick is stuck."""
    length = float(np.sqrt(robot.body.inertia / robot.body.mass))
    body, element = np.zeros(BODY_SIZE), np.zeros((AXES + robot.wheels.count, ELEMENT_SIZE))
    along = robot.friction.direction
    body[[MASS, LENGTH]] = robot.body.mass, length
    body[TURNING] = robot.body.mass / length if robot.body.rotating_frame else 0.0
    body[[SLIDE_X, SLIDE_Y]] = along.coulomb
    body[[HOLD_X, HOLD_Y]] = along.breakaway or along.coulomb
    body[ELLIPSE] = 0.0 if body[HOLD_X] > 0.0 else 2.0
    element[:AXES, GX : GZ + 1] = np.eye(AXES)
    element[AXES:, GX : GZ + 1] = robot.wheels.wrench_matrix.T * [1.0, 1.0, 1.0 / length]
    _fill_axes(robot, element, length)
    _fill_wheels(robot, element[AXES:])
    element[:, ACTIVE] = (element[:, HOLD] > 0.0) | (element[:, HOLD + 1] > 0.0)
    element[AXES:, ACTIVE] += element[AXES:, EFFICIENCY] < 1.0  # a lossy gear holds too
    element[:, SIGN] = np.where(element[:, ACTIVE] > 0.0, 0.0, 2.0)
    return Plant(body, element)


def _fill_axes(robot: Robot, element: FloatArray, length: float) -> None:
    """Friction of the body axes and of the direction of travel; what acts on the same scalar speed adds up."""
    along = robot.friction.direction
    viscous, coulomb, breakaway = robot.friction.axes.levels
    yaw_hold = along.yaw_coulomb if along.yaw_breakaway is None else along.yaw_breakaway
    units = np.array([1.0, 1.0, length])
    element[:AXES, VISCOUS] = np.add(viscous, [along.viscous, along.viscous, along.yaw_viscous]) / units**2
    for side in range(2):
        element[:AXES, SLIDE + side] = np.add(coulomb, [0.0, 0.0, along.yaw_coulomb]) / units
        element[:AXES, HOLD + side] = np.add(breakaway, [0.0, 0.0, yaw_hold]) / units


def _fill_wheels(robot: Robot, element: FloatArray) -> None:
    """Motors, gears and friction of the wheels, seen at the rim."""
    n, motor, friction = robot.wheels.count, robot.motor, robot.friction.wheels
    at_rim = per_wheel(motor.gear_ratio, n) / robot.wheels.radii
    no_limit = np.inf if motor.current_limit is None else motor.current_limit
    columns = {
        VISCOUS: friction.viscous, SLIDE: friction.coulomb, SLIDE + 1: friction.backward,
        HOLD: friction.hold_forward, HOLD + 1: friction.hold_backward,
        RESISTANCE: motor.resistance, DROP: motor.voltage_drop, EFFICIENCY: motor.gear_efficiency,
        LIMIT: no_limit, BOUND: no_limit,
    }  # fmt: skip
    for column, value in columns.items():
        element[:, column] = per_wheel(value, n)
    element[:, GAIN] = at_rim * per_wheel(motor.torque_constant, n)
    element[:, EMF] = at_rim * per_wheel(motor.emf_constant, n)
    if motor.electrical == DYNAMIC:
        element[:, INDUCTANCE] = per_wheel(motor.inductance or 0.0, n)
