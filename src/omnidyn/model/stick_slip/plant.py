"""Plant: a robot as two tables of numbers that the compiled solvers read and work in; layout.py names the entries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.model.layout import (
    ACTIVE,
    BODY_SIZE,
    BOUND,
    DROP,
    EFFICIENCY,
    ELEMENT_SIZE,
    ELLIPSE,
    EMF,
    GX,
    GZ,
    HOLD,
    HOLD_X,
    INDUCTANCE,
    LENGTH,
    LIMIT,
    MASS,
    MEMORY,
    N_AXES,
    RESISTANCE,
    SIGN,
    THRUST,
    TURNING,
    VISCOUS,
)
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel


class Plant(NamedTuple):
    """body: shape (BODY_SIZE,). element: shape (3 + wheels, ELEMENT_SIZE). Entries as named above."""

    body: FloatArray
    element: FloatArray

    @property
    def wheels(self) -> int:
        """Number of wheels."""
        return len(self.element) - N_AXES

    def copy(self) -> Plant:
        """The same numbers in arrays of their own."""
        return Plant(self.body.copy(), self.element.copy())


def plant(robot: Robot) -> Plant:
    """The numbers of a robot, all friction put together; everything that can stick is stuck."""
    length = float(np.sqrt(robot.body.inertia / robot.body.mass))
    body, element = np.zeros(BODY_SIZE), np.zeros((N_AXES + robot.wheels.count, ELEMENT_SIZE))
    body[[MASS, LENGTH]] = robot.body.mass, length
    body[TURNING] = robot.body.mass / length if robot.body.rotating_frame else 0.0
    element[:N_AXES, GX : GZ + 1] = np.eye(N_AXES)
    element[N_AXES:, GX : GZ + 1] = robot.wheels.wrench_matrix.T * [1.0, 1.0, 1.0 / length]
    _fill_motors(robot, element[N_AXES:])
    for law in robot.friction.laws:
        law.add_to(body, element, length)
    body[ELLIPSE] = 0.0 if body[HOLD_X] > 0.0 else 2.0
    element[:, ACTIVE] = (element[:, HOLD] > 0.0) | (element[:, HOLD + 1] > 0.0)
    element[N_AXES:, ACTIVE] += element[N_AXES:, EFFICIENCY] < 1.0  # a lossy gear holds too
    element[:, SIGN] = np.where(element[:, ACTIVE] > 0.0, 0.0, 2.0)
    body[MEMORY], body[MEMORY + 1] = _memory(body[MASS], element, True), _memory(body[MASS], element, False)
    return Plant(body, element)


def _memory(mass: float, element: FloatArray, driven: bool) -> float:
    """M over the least eigenvalue of sum_e g g^T (b + K E/R), plus the longest L/R of a motor [s]."""
    motors, damping = element[N_AXES:], element[:, VISCOUS].copy()
    if driven:
        damping[N_AXES:] += motors[:, THRUST] * motors[:, EMF] / motors[:, RESISTANCE]
    g = element[:, GX : GZ + 1]
    least = np.linalg.eigvalsh((g.T * damping) @ g)[0]
    return float(mass / max(least, 1e-9 * mass) + (motors[:, INDUCTANCE] / motors[:, RESISTANCE]).max())


def _fill_motors(robot: Robot, element: FloatArray) -> None:
    """Motors and gears of the wheels, seen at the rim."""
    n, motor = robot.wheels.count, robot.motor
    at_rim = per_wheel(motor.gear_ratio, n) / robot.wheels.radii
    no_limit = np.inf if motor.current_limit is None else motor.current_limit
    element[:, RESISTANCE], element[:, DROP] = per_wheel(motor.resistance, n), per_wheel(motor.voltage_drop, n)
    element[:, LIMIT] = element[:, BOUND] = per_wheel(no_limit, n)
    element[:, EFFICIENCY] = per_wheel(motor.gear_efficiency, n)
    element[:, THRUST] = at_rim * per_wheel(motor.torque_constant, n)
    element[:, EMF] = at_rim * per_wheel(motor.emf_constant, n)
    if motor.electrical == DYNAMIC:
        element[:, INDUCTANCE] = per_wheel(motor.inductance or 0.0, n)
