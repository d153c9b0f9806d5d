"""The numbers of a robot that the controller predicts with, for one length of step. All from the model's functions.

    twist' = A twist + a - M^-1 friction(twist) + frame(twist) + d,   a = B u held over the step
    twist+ = DECAY twist + PHI (a + ...),   displacement = PHI twist + PSI (a + ...)      exact for what is constant

A, B: eqs (13) (14), with viscous friction of every shape and what spins in the mass matrix. PHI = integral of e^(A s),
PSI = integral of PHI, both from 0 to dt.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from omnidyn.arrays import FloatArray
from omnidyn.model.layout import (
    BODY_SIZE,
    ELEMENT_SIZE,
    EXPONENT,
    EXPONENT_XY,
    FALL,
    FALL_XY,
    HOLD,
    HOLD_X,
    HOLD_Y,
    N_AXES,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    VISCOUS,
)
from omnidyn.model.mass import per_mass
from omnidyn.model.robot import Robot
from omnidyn.model.statespace import discretise, is_decoupled, motor_wrench, state_space
from omnidyn.model.wheels import per_wheel
from omnidyn.simulation.exact.slopes import hold_slopes

DECAY, PHI, PSI, FEED, TURNING, BY_MASS = 0, 9, 18, 27, 36, 45  # columns of `linear`, matrices row by row
ELLIPSE, STEP = 54, 57  # levels Cx, Cy [N], and the width of their slope [N m/s]; dt [s]
ELLIPSE_FALL, LINEAR_SIZE = 58, 62  # 1/v_s [s/m], the exponent, and how much more at rest, along x and y [N]
GX, ACROSS, FORWARD, BACKWARD = 0, 3, 6, 7  # columns of `levels`: direction g, M^-1 g, levels of both directions,
WIDTH, SOFT = 8, 9  # speed below which the level falls to 0, and below which it has a slope
FALLING, POWER, MORE_FORWARD, MORE_BACKWARD, LEVEL_SIZE = 10, 11, 12, 13, 14  # 1/v_s, d, and how much more at rest
SLOW = np.array([0.002, 0.002, 0.02])  # [m/s, m/s, rad/s] below which the predicted friction falls linearly to 0
SOFTER = np.array([30.0, 30.0, 40.0])  # times as wide, it has a slope: how soon the program may count on friction


class Numbers(NamedTuple):
    """linear (1, LINEAR_SIZE); push B (3, wheels); pull (wheels, 3): volts for a drive; levels (n, LEVEL_SIZE)."""

    linear: FloatArray
    push: FloatArray
    pull: FloatArray
    levels: FloatArray


def numbers(robot: Robot, dt: float, friction: bool = True) -> Numbers:
    """The numbers of a robot for steps of dt [s]; friction: whether dry friction is among them."""
    body, element, directions = _tables(robot)
    viscous = (directions.T * element[:, VISCOUS]) @ directions
    motors = motor_wrench(robot)
    rates = per_mass(robot, motors.braking - viscous).T + 0.0
    decay, phi, psi = _held(robot, rates, dt)
    linear = np.zeros((1, LINEAR_SIZE))
    by_mass = per_mass(robot, np.eye(N_AXES)).T
    turning = by_mass * robot.body.mass if robot.body.rotating_frame else np.zeros((3, 3))
    for column, value in {DECAY: decay, PHI: phi, PSI: psi, FEED: np.linalg.inv(phi), TURNING: turning,
                          BY_MASS: by_mass}.items():  # fmt: skip
        linear[0, column : column + 9] = value.ravel()
    linear[0, STEP] = dt
    push = np.ascontiguousarray(per_mass(robot, motors.driving).T)
    levels = np.zeros((0, LEVEL_SIZE))
    if friction:
        linear[0, ELLIPSE : ELLIPSE + 2] = body[SLIDE_X], body[SLIDE_Y]
        more = body[HOLD_X] - body[SLIDE_X], body[HOLD_Y] - body[SLIDE_Y]
        linear[0, ELLIPSE_FALL:LINEAR_SIZE] = body[FALL_XY], body[EXPONENT_XY], *more
        linear[0, ELLIPSE + 2] = SLOW[0] * max(body[SLIDE_X], body[SLIDE_Y])
        levels = _levels(robot, element, directions)
    return Numbers(linear, push, np.asarray(np.linalg.pinv(push), dtype=float), levels)


def volts(robot: Robot) -> FloatArray:
    """The voltage limit of each wheel [V]. Shape (wheels,)."""
    return per_wheel(robot.motor.voltage_limit, robot.wheels.count)


def emf(robot: Robot) -> FloatArray:
    """Back-EMF of each wheel per twist [V s/m, V s/m, V s/rad]. Shape (wheels, 3)."""
    motor, count = robot.motor, robot.wheels.count
    per_rim = per_wheel(motor.emf_constant, count) * per_wheel(motor.gear_ratio, count) / robot.wheels.radii
    return np.ascontiguousarray(robot.wheels.wrench_matrix.T * per_rim[:, None])


def _tables(robot: Robot) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Body and elements of all friction, in SI, and the direction of each element."""
    body, element = np.zeros(BODY_SIZE), np.zeros((N_AXES + robot.wheels.count, ELEMENT_SIZE))
    for law in robot.friction.rigid.laws:
        law.add_to(body, element, 1.0)
    return body, element, np.concatenate([np.eye(N_AXES), robot.wheels.wrench_matrix.T])


def _held(robot: Robot, rates: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(e^(A dt), PHI, PSI): by the exact engine's own functions where no axis moves another, else by expm."""
    system = replace(state_space(robot), A=rates)
    if is_decoupled(system):
        phi = discretise(system, dt)
        psi = np.array([hold_slopes(rate, dt)[2] for rate in -np.diag(rates)])
        return np.diag(1.0 + np.diag(rates) * phi), np.diag(phi), np.diag(psi)
    block = np.zeros((9, 9))
    block[:3, :3], block[:3, 3:6], block[3:6, 6:] = rates, np.eye(3), np.eye(3)
    whole = expm(block * dt)
    whole = np.asarray(whole, dtype=float)
    return whole[:3, :3], whole[:3, 3:6], whole[:3, 6:]


def _levels(robot: Robot, element: FloatArray, directions: FloatArray) -> FloatArray:
    """The parts of dry friction that act on one scalar speed each, those of level 0 left out."""
    kept = np.nonzero(element[:, SLIDE] + element[:, SLIDE + 1] > 0.0)[0]
    table = np.zeros((len(kept), LEVEL_SIZE))
    table[:, GX : GX + 3] = directions[kept]
    table[:, ACROSS : ACROSS + 3] = per_mass(robot, directions[kept])
    table[:, FORWARD], table[:, BACKWARD] = element[kept, SLIDE], element[kept, SLIDE + 1]
    table[:, FALLING], table[:, POWER] = element[kept, FALL], element[kept, EXPONENT]
    table[:, MORE_FORWARD : MORE_BACKWARD + 1] = element[kept, HOLD : HOLD + 2] - element[kept, SLIDE : SLIDE + 2]
    table[:, WIDTH] = np.where(kept < N_AXES, SLOW[np.minimum(kept, 2)], SLOW[0])
    table[:, SOFT] = table[:, WIDTH] * np.where(kept < N_AXES, SOFTER[np.minimum(kept, 2)], SOFTER[0])
    return table
