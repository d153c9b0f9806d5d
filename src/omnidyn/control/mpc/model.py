"""The numbers of a robot that the controller predicts with, for one length of step. All from the model's functions.

    twist' = A twist + a - M^-1 friction(twist) + frame(twist) + d,   a = B u held over the step
    twist+ = DECAY twist + PHI (a + ...),   displacement = PHI twist + PSI (a + ...)      exact for what is constant

A, B: eqs (13) (14), with viscous friction of every shape and what spins in the mass matrix. PHI = integral of e^(A s),
PSI = integral of PHI, both from 0 to dt. Where the drive has a speed loop, B u is that of its commands (`LoopMotor`),
and d grows by dt (SUM_DRIVE a - SUM_TWIST mean twist) in a step: what the sum of the loop does to the robot.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import part
from omnidyn.control.feedforward import LoopMotor
from omnidyn.control.mpc.small import IDENTITY, ZERO_MATRIX, added, matrix, mm, put9, scaled
from omnidyn.model.dynamics import discretise, frame_terms, is_decoupled, motor_wrench, state_space
from omnidyn.model.layout import N_AXES, Plant, blank_plant
from omnidyn.model.mass import per_mass
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, wheel_speed
from omnidyn.simulation.exact.slopes import hold_slopes

DECAY, PHI, PSI, FEED, TURNING, BY_MASS = 0, 9, 18, 27, 36, 45  # columns of `linear`, matrices row by row
ELLIPSE, STEP = 54, 57  # levels Cx, Cy [N], and the width of their slope [N m/s]; dt [s]
ELLIPSE_FALL = 58  # 1/v_s [s/m], shape, exponent, and how much more at rest, along x and y [N]
SUM, SUM_DRIVE, SUM_TWIST, LINEAR_SIZE = 63, 64, 73, 82  # of a speed loop: whether, and what a drive and a twist add
GX, BY_MASS_GX, FORWARD, BACKWARD = 0, 3, 6, 7  # columns of `levels`: direction g, M^-1 g, levels of both directions,
SLOW_SPEED, SOFT_SPEED = 8, 9  # speed below which the level falls to 0, and below which it has a slope
FALLING, SHAPE, POWER, MORE_FORWARD, MORE_BACKWARD, LEVEL_SIZE = 10, 11, 12, 13, 14, 15  # 1/v_s, d, more at rest
SLOW_SPEEDS = np.array([0.002, 0.002, 0.02])  # [m/s, m/s, rad/s] below which the predicted friction falls linearly to 0
SOFTER = np.array([30.0, 30.0, 40.0])  # times as wide, it has a slope: how soon the program may count on friction


class Numbers(NamedTuple):
    """linear (1, LINEAR_SIZE); push B (3, wheels); pull (wheels, 3): volts for a drive; levels (n, LEVEL_SIZE)."""

    linear: FloatArray
    push: FloatArray
    pull: FloatArray
    levels: FloatArray


def numbers(robot: Robot, dt: float, friction: bool = True, loop: LoopMotor | None = None) -> Numbers:
    """The numbers of a robot for steps of dt [s]; friction: whether dry friction is among them; loop: of its drive."""
    plant, directions = _friction(robot)
    viscous = (directions.T * plant.element["viscous"]) @ directions
    motors = motor_wrench(robot)
    rates = per_mass(robot, motors.braking - viscous).T + 0.0
    decay, phi, psi = _held(robot, rates, dt)
    linear = np.zeros((1, LINEAR_SIZE))
    by_mass = per_mass(robot, np.eye(N_AXES)).T
    turning = by_mass @ frame_terms(robot)
    for column, value in {
        DECAY: decay,
        PHI: phi,
        PSI: psi,
        FEED: np.linalg.inv(phi),
        TURNING: turning,
        BY_MASS: by_mass,
    }.items():
        linear[0, column : column + 9] = value.ravel()
    linear[0, STEP] = dt
    push = np.ascontiguousarray(per_mass(robot, motors.driving).T)
    levels = np.zeros((0, LEVEL_SIZE))
    if friction:
        body = plant.body
        linear[0, ELLIPSE : ELLIPSE + 2] = body.coulomb
        linear[0, ELLIPSE + 2] = SLOW_SPEEDS[0] * body.coulomb.max()
        linear[0, ELLIPSE_FALL:SUM] = body.fall, body.form, body.exponent, *(body.breakaway - body.coulomb)
        levels = _levels(robot, plant.element, directions)
    pull = np.asarray(np.linalg.pinv(push), dtype=float)
    if loop is not None and np.any(loop.sum):
        speeds = np.array([wheel_speed(robot.wheels, axis) for axis in np.eye(N_AXES)]).T
        linear[0, SUM] = 1.0
        linear[0, SUM_DRIVE : SUM_DRIVE + 9] = (push @ ((loop.sum / loop.gain)[:, None] * pull)).ravel()
        linear[0, SUM_TWIST : SUM_TWIST + 9] = (push @ (loop.sum[:, None] * speeds)).ravel()
    return Numbers(linear, push, pull, levels)


TERMS = 18  # of the series of a change of dt, which is 1.5 dt at the most


@part
def held_for(linear, elapsed, changed):
    """Write into `changed` the row `linear` for steps of another length [s], at most half of dt off.

    With d what it is longer: e^(A d) = I + A PHI_d by its series, PHI = PHI_dt + DECAY_dt PHI_d and so on.
    """
    decay, phi, psi = matrix(linear, 0, DECAY), matrix(linear, 0, PHI), matrix(linear, 0, PSI)
    rates = mm(added(decay, scaled(IDENTITY, -1.0)), matrix(linear, 0, FEED))
    d = elapsed - linear[0, STEP]
    once = twice = ZERO_MATRIX  # PHI_d / d and PSI_d / d^2
    for k in range(TERMS, 0, -1):
        once = added(scaled(mm(rates, once), d / (k + 1)), IDENTITY)
        twice = added(scaled(mm(rates, twice), d / (k + 2)), scaled(IDENTITY, 0.5))
    short = scaled(once, d)
    for i in range(LINEAR_SIZE):
        changed[0, i] = linear[0, i]
    put9(changed, 0, DECAY, mm(decay, added(IDENTITY, mm(rates, short))))
    put9(changed, 0, PHI, added(phi, mm(decay, short)))
    put9(changed, 0, PSI, added(psi, added(scaled(phi, d), mm(decay, scaled(twice, d * d)))))
    changed[0, STEP] = elapsed


def volts(robot: Robot) -> FloatArray:
    """The voltage limit of each wheel [V]. Shape (wheels,)."""
    return per_wheel(robot.motor.voltage_limit, robot.wheels.count)


def emf(robot: Robot) -> FloatArray:
    """Back-EMF of each wheel per twist [V s/m, V s/m, V s/rad]. Shape (wheels, 3)."""
    motor, count = robot.motor, robot.wheels.count
    per_rim = per_wheel(motor.emf_constant, count) * per_wheel(motor.gear_ratio, count) / robot.wheels.radii
    return np.ascontiguousarray(robot.wheels.wrench_matrix.T * per_rim[:, None])


def _friction(robot: Robot) -> tuple[Plant, FloatArray]:
    """All friction, in SI, and the direction of each element."""
    plant = blank_plant(robot.wheels.count)
    for law in robot.friction.rigid.laws:
        law.add_to(plant, 1.0)
    return plant, np.concatenate([np.eye(N_AXES), robot.wheels.wrench_matrix.T])


def _held(robot: Robot, rates: FloatArray, dt: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(e^(A dt), PHI, PSI): by the exact engine's own functions where no axis moves another, else by expm."""
    system = replace(state_space(robot), A=rates)
    if is_decoupled(system):
        phi = discretise(system, dt)
        psi = np.array([hold_slopes(rate, dt)[2] for rate in -np.diag(rates)])
        return np.diag(1.0 + np.diag(rates) * phi), np.diag(phi), np.diag(psi)
    block = np.zeros((9, 9))
    block[:3, :3], block[:3, 3:6], block[3:6, 6:] = rates, np.eye(3), np.eye(3)
    exponential = expm(block * dt)
    exponential = np.asarray(exponential, dtype=float)
    return exponential[:3, :3], exponential[:3, 3:6], exponential[:3, 6:]


def _levels(robot: Robot, element: Any, directions: FloatArray) -> FloatArray:
    """The parts of dry friction that act on one scalar speed each, those of level 0 left out."""
    coulomb = element["coulomb"]
    elements = np.nonzero(coulomb.sum(axis=1) > 0.0)[0]
    table = np.zeros((len(elements), LEVEL_SIZE))
    table[:, GX : GX + 3] = directions[elements]
    table[:, BY_MASS_GX : BY_MASS_GX + 3] = per_mass(robot, directions[elements])
    table[:, FORWARD], table[:, BACKWARD] = coulomb[elements].T
    for column, field in ((FALLING, "fall"), (SHAPE, "form"), (POWER, "exponent")):
        table[:, column] = element[field][elements]
    table[:, MORE_FORWARD : MORE_BACKWARD + 1] = (element["breakaway"] - coulomb)[elements]
    table[:, SLOW_SPEED] = np.where(elements < N_AXES, SLOW_SPEEDS[np.minimum(elements, 2)], SLOW_SPEEDS[0])
    table[:, SOFT_SPEED] = table[:, SLOW_SPEED] * np.where(
        elements < N_AXES, SOFTER[np.minimum(elements, 2)], SOFTER[0]
    )
    return table
