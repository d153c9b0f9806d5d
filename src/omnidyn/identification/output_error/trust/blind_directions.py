"""What the logs do not tell: directions of the free numbers along which their outputs stay, by the SVD of the scaled
Fisher matrix.

D I D = V diag(1/s^2) V',   I: what the rows tell, without priors;   D: what a change of 1 is for each number

A direction is blind where s, how far it may go within a standard error, is LOST_DISTANCE or more. D is the number
itself, so that 0.5 is half of it; of a friction it is at least a tenth of what the motors can push: one near 0 is not
lost because it may as well be twice as large. Where several directions are blind, any mixture of them is: they are
told apart so that each holds as few numbers as possible (row echelon form, the largest pivot first).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.identification.output_error.problem.nuisances import LATENCY, PUSH, TILT
from omnidyn.identification.output_error.problem.parameters import Parameter
from omnidyn.identification.output_error.problem.problem import FitProblem, Problem
from omnidyn.model.actuation import DEAD_BAND
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.keys import BREAKAWAY, COULOMB, VISCOUS, find_key
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds

LOST_DISTANCE = 0.5  # how far a blind direction may go within a standard error, over the size of its numbers
EIGEN_TOLERANCE = 1e-13  # of the largest eigenvalue: below it there is only rounding
SMALL = 0.1  # of what the motors push with, that a friction counts as, at least
LATENCY_SIZE = 0.05  # [s] that a latency counts as
SHARE, VISIBLE_ERRORS = (
    0.05,
    3.0,
)  # of the largest; standard errors: less of both, and a number has no part in a direction


@dataclass(frozen=True)
class Way:
    """A blind direction. reach: how far it goes within a standard error. step (P,): in the numbers that the solver
    sees, 0 for what has no part in it; size (P,): what a change of 1 is there."""

    reach: float
    step: FloatArray
    size: FloatArray


def blind_ways(problem: FitProblem, values: FloatArray, information: FloatArray) -> tuple[Way, ...]:
    """The blind directions of a fit. values (P,); information (P, P): of the rows alone, states eliminated."""
    # What shows where sizes are the numbers themselves shows no less where they are larger; to find these takes time.
    if values.all() and not _lost(information, _own_sizes(problem, values))[1].any():
        return ()
    size, blind_list = sizes(problem, values), []
    scaled, lost, vectors = _lost(information, size)
    for direction in _sparse(vectors[:, lost].T):
        way_information = float(direction @ scaled @ direction)
        named_numbers = (np.abs(direction) > SHARE) | (direction**2 * np.diag(scaled) > VISIBLE_ERRORS**2)
        reach = way_information**-0.5 if way_information > 0.0 else np.inf
        blind_list.append(Way(reach, np.where(named_numbers, direction, 0.0) * size, size))
    return tuple(blind_list)


def _lost(information: FloatArray, size: FloatArray) -> tuple[FloatArray, BoolArray, FloatArray]:
    """(scaled information (P, P), which of its eigenvectors are blind (P,), these in columns)."""
    scaled = information * np.outer(size, size)
    eigen, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return scaled, eigen < max(LOST_DISTANCE**-2.0, EIGEN_TOLERANCE * float(eigen.max(initial=0.0))), vectors


def sizes(problem: FitProblem, values: FloatArray) -> FloatArray:
    """What a change of 1 is for each number, in the numbers that the solver sees. Shape (P,)."""
    # Of several groups there are as many robots: the one that their fit began from says how large things are.
    robot = problem.robot if isinstance(problem, Problem) else None
    if robot is None:
        return _own_sizes(problem, values)
    push, top = _pushes(problem, robot), top_speeds(robot)
    return np.array([_size(p, v, push, top) for p, v in zip(problem.parameters, values.tolist(), strict=True)])


def _own_sizes(problem: FitProblem, values: FloatArray) -> FloatArray:
    """The same by the numbers alone, whatever the motors can push. Shape (P,)."""
    push, top = np.zeros(3), np.ones(3)
    return np.array([_size(p, v, push, top) for p, v in zip(problem.parameters, values.tolist(), strict=True)])


def _size(p: Parameter, value: float, push: FloatArray, top: FloatArray) -> float:
    """push (3,) [N, N, N m], top (3,) [m/s, m/s, rad/s]."""
    if p.log:
        return 1.0
    key = find_key(p.name.partition("@")[0])
    if key is not None:
        axis = key.axis or 0
        limits_by_level = {COULOMB: push[axis], BREAKAWAY: push[axis], VISCOUS: push[axis] / top[axis]}.get(
            key.level or "", 0.0
        )
        return max(abs(value), SMALL * float(limits_by_level)) or 1.0
    if p.part == LATENCY:
        return LATENCY_SIZE
    if p.part == DEAD_BAND:
        return max(abs(value), 0.1)
    return max(SMALL * float(push.max()), 1e-9) if p.part in (TILT, PUSH) else 1.0


def _pushes(problem: FitProblem, robot: Robot) -> FloatArray:
    """The greatest wrench that the voltages of the logs give at rest [N, N, N m]. Shape (3,)."""
    push = np.zeros(3)
    for record in {id(piece.record): piece.record for piece in problem.pieces}.values():
        limit = np.eye(robot.wheels.count) * robot.motor.voltage_limit
        volts = record.voltage if record.set_point is None else limit
        push = np.fmax(push, np.nanmax(np.abs(drive_wrench(robot, np.zeros(3), volts)), axis=0, initial=0.0))
    return push


def _sparse(basis: FloatArray) -> list[FloatArray]:
    """Directions that span the same, each with as few numbers as may be, its largest entry 1. Shape (K, P)."""
    rows, pivot_rows = basis.copy(), []
    for k in range(len(rows)):
        open_entries = np.abs(rows[k:]).copy()
        open_entries[:, pivot_rows] = 0.0
        pivot_row, pivot = np.unravel_index(int(open_entries.argmax()), open_entries.shape)
        rows[[k, k + pivot_row]] = rows[[k + pivot_row, k]]
        rows[k] /= rows[k, pivot]
        other_rows = np.arange(len(rows)) != k
        rows[other_rows] -= np.outer(rows[other_rows, pivot], rows[k])
        pivot_rows.append(int(pivot))
    return [row / row[int(np.abs(row).argmax())] for row in rows]
