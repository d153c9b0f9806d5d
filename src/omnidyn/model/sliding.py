"""What all friction of a robot does together while it slides, whatever its parts: their tables, put in one formula."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.model.layout import BODY_SIZE, ELEMENT_SIZE, N_AXES, SLIDE, SLIDE_X, SLIDE_Y, VISCOUS
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel

ROUNDING = 1e-12  # of the fastest element: slower is at rest


def sliding_wrench(robot: Robot, twist: ArrayLike) -> FloatArray:
    """Wrench of friction on a robot in motion [N, N, N m].

    F = -sum g_e (b_e s_e + c_e sgn s_e) - (Cx^2 vx, Cy^2 vy, 0)/sqrt(Cx^2 vx^2 + Cy^2 vy^2) over the elements e (body
    axes and wheels) with the speed s_e = g_e . twist. An element at rest counts as nothing: what it holds balances
    what drives it. `twist` [m/s, m/s, rad/s], shape (*batch, 3); returns the same shape.
    """
    twist = np.asarray(twist, dtype=float)
    body, element = np.zeros(BODY_SIZE), np.zeros((N_AXES + robot.wheels.count, ELEMENT_SIZE))
    for law in robot.friction.laws:
        law.add_to(body, element, 1.0)
    directions = np.concatenate([np.eye(N_AXES), robot.wheels.wrench_matrix.T])
    speed = twist @ directions.T
    speed = np.where(np.abs(speed) <= ROUNDING * np.abs(speed).max(axis=-1, keepdims=True), 0.0, speed)
    coulomb = np.where(speed > 0.0, element[:, SLIDE], element[:, SLIDE + 1])
    wrench = -(element[:, VISCOUS] * speed + coulomb * np.sign(speed)) @ directions
    levels = body[[SLIDE_X, SLIDE_Y]]
    dissipated = np.linalg.norm(levels * twist[..., :2], axis=-1, keepdims=True)
    wrench[..., :2] -= levels**2 * twist[..., :2] / np.where(dissipated > 0.0, dissipated, 1.0)
    return wrench


def top_speeds(robot: Robot) -> FloatArray:
    """Speed along x, along y and about yaw at which the first wheel reaches its no-load speed at the voltage limit.

    [m/s, m/s, rad/s], shape (3,): what the robot would reach without friction.
    """
    count = robot.wheels.count
    rim = no_load_speed(robot.motor, per_wheel(robot.motor.voltage_limit, count)) * robot.wheels.radii
    return np.array([np.min(rim[row > ROUNDING] / row[row > ROUNDING]) for row in np.abs(robot.wheels.wrench_matrix)])
