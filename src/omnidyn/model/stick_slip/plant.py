"""Plant: a robot as two tables of numbers that the compiled solvers read and work in; layout.py names the entries."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import UnsupportedError
from omnidyn.model.friction.stribeck import steepest
from omnidyn.model.layout import (
    ACTIVE,
    BAND,
    BEND_HOLD,
    BEND_HOLD_XY,
    BEND_SLIDE,
    BEND_SLIDE_XY,
    BODY_SIZE,
    BOUND,
    BRISTLES,
    DAMP,
    DAMP_XY,
    DROP,
    EFFICIENCY,
    ELEMENT_SIZE,
    ELLIPSE,
    EMF,
    EXPONENT,
    EXPONENT_XY,
    FADE,
    FADE_XY,
    FALL,
    FALL_XY,
    GATHERS,
    GX,
    GZ,
    HOLD,
    HOLD_X,
    HOLD_Y,
    INDUCTANCE,
    KEEP,
    LAWS,
    LENGTH,
    LIMIT,
    MASS,
    MEMORY,
    N_AXES,
    RESISTANCE,
    ROOM,
    SIGN,
    SLIDE,
    SLIDE_X,
    SLIDE_Y,
    SPIN,
    STEEP,
    STIFF,
    STIFF_XY,
    THRUST,
    TURNING,
    VISCOUS,
)
from omnidyn.model.mass import added_mass
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
    spin = added_mass(robot) / np.outer([1.0, 1.0, length], [1.0, 1.0, length])
    body[SPIN : SPIN + 6] = spin[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    body[TURNING] = robot.body.mass / length if robot.body.rotating_frame else 0.0
    body[ROOM : ROOM + 2] = robot.floor.pull(robot.body.mass)
    element[:N_AXES, GX : GZ + 1] = np.eye(N_AXES)
    element[N_AXES:, GX : GZ + 1] = robot.wheels.wrench_matrix.T * [1.0, 1.0, 1.0 / length]
    _fill_motors(robot, element[N_AXES:])
    for law in robot.friction.laws:
        law.add_to(body, element, length)
    if np.any(element[:, BAND] > 0.0):
        _make_band(robot, body, element)
    body[ELLIPSE] = 0.0 if body[HOLD_X] > 0.0 else 2.0
    element[:, ACTIVE] = (element[:, HOLD] > 0.0) | (element[:, HOLD + 1] > 0.0)
    element[N_AXES:, ACTIVE] += element[N_AXES:, EFFICIENCY] < 1.0  # a lossy gear holds too
    element[:, SIGN] = np.where(element[:, ACTIVE] > 0.0, 0.0, 2.0)
    heaviest = float(body[MASS] + np.linalg.eigvalsh(spin)[-1])
    _bound_laws(body, element)
    body[MEMORY], body[MEMORY + 1] = _memory(heaviest, element, True), _memory(heaviest, element, False)
    return Plant(body, element)


def _make_band(robot: Robot, body: FloatArray, element: FloatArray) -> None:
    """Karnopp's band on the body axes. Raises UnsupportedError where axes do not gather momentum each for itself."""
    if bool(np.any(body[SPIN + 3 : SPIN + 6] != 0.0)) or bool(np.any(np.asarray(robot.motor.gear_efficiency) != 1.0)):
        raise UnsupportedError(
            'law = "karnopp" knows axes that rest each for itself',
            got="unequal inertias of rotors or wheels, or gears that lose", expected="neither",
            remedy='take law = "coulomb": it sticks exactly, which the band stands in for', where="friction.axes.law",
        )  # fmt: skip
    body[GATHERS] = 1.0
    element[:N_AXES, KEEP : KEEP + 2] = element[:N_AXES, HOLD : HOLD + 2]


BENDS = 1.5  # a bristle follows what falls late: so much steeper at the most
FADES = 0.75  # times the damping: the steepest way in which one that fades lets go


def _bound_laws(body: FloatArray, element: FloatArray) -> None:
    """What the solvers must know beforehand of what falls with the speed, and of what bends."""
    steep = 0.0
    for row in element[(element[:, FALL] > 0.0) | (element[:, STIFF] > 0.0)]:
        more = max((row[HOLD : HOLD + 2] - row[SLIDE : SLIDE + 2]).max(), 0.0)
        bends = max((row[BEND_HOLD : BEND_HOLD + 2] - row[BEND_SLIDE : BEND_SLIDE + 2]).max(), 0.0)
        rate = (more + BENDS * bends) * row[FALL] * (steepest(0.0, row[EXPONENT]) if row[FALL] > 0.0 else 0.0)
        steep += (rate + (FADES * row[DAMP] if row[FADE] > 0.0 else 0.0)) * float(row[GX : GZ + 1] @ row[GX : GZ + 1])
    if body[FALL_XY] > 0.0:
        more = max(body[HOLD_X] - body[SLIDE_X], body[HOLD_Y] - body[SLIDE_Y])
        bends = float((body[BEND_HOLD_XY : BEND_HOLD_XY + 2] - body[BEND_SLIDE_XY : BEND_SLIDE_XY + 2]).max())
        round_ = body[SLIDE_X] == body[SLIDE_Y] and body[HOLD_X] == body[HOLD_Y]
        rate = more * (1.0 if round_ else 2.0) + 2.0 * BENDS * bends  # an ellipse falls faster than its levels do
        steep += rate * body[FALL_XY] * steepest(0.0, body[EXPONENT_XY])
    steep += FADES * body[DAMP_XY] if body[FADE_XY] > 0.0 else 0.0
    body[STEEP] = steep / body[MASS]
    body[BRISTLES] = (
        element[:, BEND_HOLD : BEND_HOLD + 2].max(axis=1).sum() + body[BEND_HOLD_XY : BEND_HOLD_XY + 2].sum()
    )
    body[LAWS] = float(body[STEEP] > 0.0 or body[STIFF_XY] > 0.0 or bool(np.any(element[:, STIFF] > 0.0)))


def _memory(mass: float, element: FloatArray, driven: bool) -> float:
    """Mass over the least eigenvalue of sum_e g g^T (b + K E/R), plus the longest L/R of a motor [s]."""
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
