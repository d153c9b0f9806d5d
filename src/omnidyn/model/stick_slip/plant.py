"""The plant of a robot: the constants that the compiled solvers read; layout.py names them."""

from __future__ import annotations

from typing import Any

import numpy as np

from omnidyn.compiled.kernel import part
from omnidyn.model.friction.bristle import fade_of
from omnidyn.model.friction.stribeck import BRISTLE_STEEPNESS, steepest_of, steepest_of_all
from omnidyn.model.layout import N_AXES, Plant, blank_plant
from omnidyn.model.mass import added_mass, off_centre
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel


def plant(robot: Robot) -> Plant:
    """The numbers of a robot, all friction put together."""
    length = float(np.sqrt(robot.body.inertia / robot.body.mass))
    numbers = blank_plant(robot.wheels.count)
    body, element = numbers
    body.mass, body.length = robot.body.mass, length
    body.centre[:], body.off = np.array(robot.body.centre) / length, float(any(robot.body.centre))
    body.spin[:] = (off_centre(robot) + added_mass(robot)) / np.outer([1.0, 1.0, length], [1.0, 1.0, length])
    body.least = _least(robot.body.mass, float(np.hypot(*body.centre)))
    body.turning = robot.body.mass / length if robot.body.rotating_frame else 0.0
    body.room[:] = robot.floor.pull(robot.body.mass)
    element["g"][:N_AXES] = np.eye(N_AXES)
    element["g"][N_AXES:] = robot.wheels.wrench_matrix.T * [1.0, 1.0, 1.0 / length]
    _fill_motors(robot, element[N_AXES:])
    for law in robot.friction.laws:
        law.add_to(numbers, length)
    lossy = element["efficiency"] < np.repeat([0.0, 1.0], [N_AXES, numbers.wheels])  # a lossy gear holds too
    body.active, element["active"] = body.breakaway[0] > 0.0, lossy | (element["breakaway"] > 0.0).any(axis=1)
    if body.band > 0.0 or np.any(element["band"] > 0.0):
        without_band = np.any((element["active"] > 0.0) & (element["band"] == 0.0)) or (
            body.active and body.band == 0.0
        )
        body.gathers = 2.0 if without_band else 1.0
    heaviest = float(body.mass + np.linalg.eigvalsh(body.spin)[-1])
    _bound_laws(numbers)
    body.memory[:] = _memory(heaviest, element, True), _memory(heaviest, element, False)
    return numbers


def _least(mass: float, off: float) -> float:
    """The least eigenvalue of mass x [[1, off], [off, 1 + off^2]]; what spins only adds to it."""
    return mass / (1.0 + 0.5 * off**2 + off * float(np.sqrt(1.0 + 0.25 * off**2)))


def _bound_laws(plant: Plant) -> None:
    """What the solvers must know beforehand of what falls with the speed, and of what bends."""
    body = plant.body
    if (plant.element["fall"] > 0.0).any() or (plant.element["fade"] > 0.0).any():
        for row in plant.element:
            row.steep = (steepest_of(row) + fade_of(row)) * float(row.g @ row.g) / body.least
    steep = fade_of(body)
    if body.fall > 0.0:
        excess_level = (body.breakaway - body.coulomb).max()
        bends = float((body.bristle_breakaway - body.bristle_coulomb).max())
        round_ = body.coulomb[0] == body.coulomb[1] and body.breakaway[0] == body.breakaway[1]
        rate = (
            excess_level * (1.0 if round_ else 2.0) + 2.0 * BRISTLE_STEEPNESS * bends
        )  # an ellipse falls faster than its levels do
        steep += rate * body.fall * steepest_of_all(body.form, body.exponent)
    body.steep = steep / body.least
    body.steep_sum = body.steep + plant.element["steep"].sum()
    body.bristles = plant.element["bristle_breakaway"].max(axis=1).sum() + body.bristle_breakaway.sum()
    body.laws = float(body.steep_sum > 0.0 or body.stiffness > 0.0 or bool(np.any(plant.element["stiffness"] > 0.0)))


def _memory(mass: float, element: Any, driven: bool) -> float:
    """Mass over the least eigenvalue of sum_e g g^T (b + K E/R), plus the longest L/R of a motor [s]."""
    motors, damping, g = element[N_AXES:], element["viscous"].copy(), element["g"]
    if driven:
        damping[N_AXES:] += motors["thrust"] * motors["emf"] / motors["resistance"]
    least_damping = np.linalg.eigvalsh((g.T * damping) @ g)[0]
    return float(mass / max(least_damping, 1e-9 * mass) + (motors["inductance"] / motors["resistance"]).max())


def _fill_motors(robot: Robot, element: Any) -> None:
    """Motors and gears of the wheels, seen at the rim."""
    n, motor = robot.wheels.count, robot.motor
    at_rim = per_wheel(motor.gear_ratio, n) / robot.wheels.radii
    element["resistance"], element["drop"] = per_wheel(motor.resistance, n), per_wheel(motor.voltage_drop, n)
    element["limit"] = per_wheel(np.inf if motor.current_limit is None else motor.current_limit, n)
    element["efficiency"] = per_wheel(motor.gear_efficiency, n)
    element["thrust"] = at_rim * per_wheel(motor.torque_constant, n)
    element["emf"] = at_rim * per_wheel(motor.emf_constant, n)
    if motor.electrical == DYNAMIC:
        element["inductance"] = per_wheel(motor.inductance or 0.0, n)


# Copies of vectors, tables and states within kernels, and whether two states stick alike


@part
def copy_row(to, source):
    """to[:] = source for vectors, of numbers or of records.

    Numba would make an array on the way, and take seconds to compile a message.
    """
    for j in range(len(to)):
        to[j] = source[j]


@part
def copy_table(to, source):
    """to[:, :] = source for tables."""
    for i in range(to.shape[0]):
        for j in range(to.shape[1]):
            to[i, j] = source[i, j]


@part
def copy_state(to, source):
    """Take over all of a state."""
    copy_row(to.x, source.x)
    copy_row(to.each, source.each)


@part
def state_of_row(to, states, k):
    """Take over all of one of many states."""
    copy_row(to.x, states.x[k])
    copy_row(to.each, states.each[k])


@part
def row_of_state(states, k, source):
    """Make one of many states the one given."""
    copy_row(states.x[k], source.x)
    copy_row(states.each[k], source.each)


@part
def signs_differ(a, b):
    """Whether two states differ in what sticks or in a direction of sliding, element by element."""
    apart = False
    for e in range(len(a.each)):
        apart |= a.each[e].sign != b.each[e].sign
    return apart
