"""A step of a fit along the curved valley in which motors that are guesses leave it.

A motion shows what a voltage pushes with, l K_t/(R r), what brakes, l^2 K_t K_v/(R r^2) + B, and what is moved,
M + l^2 J/r^2 of each wheel, not their parts: a longer gear with more resistance, less viscous friction and lighter
rotors moves the same way. Priors alone tell such robots apart. A straight step of logarithms leaves that valley: B must
fall by what a product of them grows by. So a step is bent until push, braking and mass change by as much as their
slopes say (the second-order part of geodesic acceleration, of the numbers of the robot alone: M. K. Transtrum, J. P.
Sethna, arXiv:1201.5885).
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.output_error.problem.problem import Problem
from omnidyn.model.layout import N_AXES
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant

LEAST_SHARE = 1e-3  # of its lower bound: a number that is a logarithm never becomes 0 on the way
EPS = 1e-5  # change of a number that the solver sees, relative
RANK = 1e-7  # share of the largest singular value below which a direction shows in none of the sums
ROUNDS = 3  # of Newton's method by the slopes of the start
MASS_WEIGHT = 0.01  # of what is moved, beside push and braking, where a step cannot hold all three


def bent(problem: Problem, inner: FloatArray, step: FloatArray) -> FloatArray:
    """The step (P,) from the numbers `inner` (P,) that the solver sees, bent; as it is where it would bend back."""
    parameters = problem.robot_parameters
    here, inner_step = inner[: len(parameters)], step[: len(parameters)]
    if not inner_step.any():
        return step

    def at(numbers: FloatArray) -> FloatArray:
        values = [p.outer(float(z)) for p, z in zip(parameters, numbers, strict=True)]
        values = [max(v, LEAST_SHARE * p.low) if p.log else v for p, v in zip(parameters, values, strict=True)]
        return _sums(problem.robot_at(np.array(values)))

    start, sizes = at(here), EPS * np.maximum(np.abs(here), 1e-3)
    changes = [at(here + move) - at(here - move) for move in np.diag(sizes)]
    slopes = np.stack(changes, axis=1) / (2.0 * sizes)
    back = np.abs(inner_step)[:, None] * np.linalg.pinv(
        slopes * np.abs(inner_step), rcond=RANK
    )  # what does not move stays
    goal, there = start + slopes @ inner_step, here + inner_step
    for _ in range(ROUNDS):
        there = there + back @ (goal - at(there))
        if not np.all(np.isfinite(there)) or np.any(np.abs(there - here - inner_step) > np.abs(inner_step)):
            return step
    return np.concatenate([there - here, step[len(parameters) :]])


def _sums(robot: Robot) -> FloatArray:
    """What the motion shows of motors, rotors and viscous friction: force per volt of each wheel, braking (3, 3), mass
    (3, 3)."""
    body, element = plant(robot)
    motors, units = element[N_AXES:], np.array([1.0, 1.0, body.length])
    push, damping = motors["thrust"] / motors["resistance"], element["viscous"].copy()
    damping[N_AXES:] += push * motors["emf"]
    braking = (element["g"].T * damping) @ element["g"] * np.outer(units, units)
    moved = MASS_WEIGHT * mass_matrix(robot)
    return np.concatenate([push, braking.ravel(), moved.ravel()])
