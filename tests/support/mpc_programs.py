"""Programs of the controller with the tables of control/mpc, and the same as dense matrices for other solvers."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from omnidyn import load_robot
from omnidyn.compiled.kernel import kernel
from omnidyn.control.mpc.columns import ANSWER_SIZE, CP, CV, GX, GY, HP, HV, PULL, STAGE_SIZE, WEIGHT, E, V
from omnidyn.control.mpc.interior_point import ROOM_SIZE, QuadraticProgram
from omnidyn.control.mpc.model import numbers, volts
from omnidyn.control.mpc.observer import ESTIMATE_SIZE, SCALE
from omnidyn.control.mpc.program import make_costs, make_stages
from omnidyn.control.mpc.settings import Settings
from omnidyn.control.mpc.solve import is_inaccurate, solve

SPREAD = np.array([0.3, 0.3, 1.0, 1.0, 1.0, 6.0])  # of states, as in the stress test of the peers


class Problem(NamedTuple):
    """A program of n steps: bounds (2, n, wheels), weight (wheels,), wanted (n, wheels), start (6,)."""

    stage: np.ndarray
    push: np.ndarray
    bounds: np.ndarray
    weight: np.ndarray
    wanted: np.ndarray
    start: np.ndarray


@kernel
def _make(numbers, settings, estimate, program, preview):
    make_costs(numbers, settings, estimate, program, preview, 0, 0.0)
    make_stages(numbers, estimate, program)


@kernel
def _solve(program):
    return solve(program)


@kernel
def _is_inaccurate(program, stiff):
    return is_inaccurate(program, stiff)


@lru_cache
def _known(robot: str, dt: float):
    """(robot, its numbers, settings, weights) of a name."""
    known = load_robot(robot)
    settings, weight, *_ = Settings().tables(known, dt, True)
    return known, numbers(known, dt), settings, weight


def random_program(rng: np.random.Generator, scale: float, n: int = 20, robot: str = "axebot", dt: float = 0.02):
    """A program along a random walk, from a random state: scale 5 is up to five metres off."""
    known, table, settings, weight = _known(robot, dt)
    limit = np.broadcast_to(volts(known), (n, known.wheels.count))
    bounds = np.array([-limit, limit])
    preview = np.cumsum(rng.normal(size=(n + 1, 6)) * scale * 0.05, axis=0) + rng.normal(size=6) * scale * 0.3
    start = rng.normal(size=6) * scale * SPREAD
    preview[:, 2] += 2.0 * np.pi * np.round((start[2] - preview[0, 2]) / (2.0 * np.pi))
    along = preview.copy()
    along[0] = start
    estimate = np.zeros((ESTIMATE_SIZE, 3))
    estimate[SCALE] = 1.0
    stage, wanted = np.zeros((n, STAGE_SIZE)), np.zeros((n, known.wheels.count))
    problem = Problem(stage, table.push, bounds, weight, wanted, start)
    _make(table, settings, estimate, Solver(n, known.wheels.count).program(problem, along), preview)
    return problem


class Solver:
    """Rooms for programs of one size; `solve` returns (inputs, passes), from a guess of the active set or none."""

    def __init__(self, n: int, wheels: int) -> None:
        self.answer, self.x = np.zeros((n, ANSWER_SIZE)), np.zeros((n + 1, 6))
        self.inverse, self.target, self.u = (np.zeros((n, wheels)) for _ in range(3))
        self.active, self.room = np.zeros((n, wheels), np.int64), np.zeros((ROOM_SIZE, n, wheels))

    def program(self, problem: Problem, x: np.ndarray) -> QuadraticProgram:
        """The program, with the arrays that it is solved in."""
        return QuadraticProgram(
            problem.push,
            problem.weight,
            problem.stage,
            problem.wanted,
            problem.bounds,
            self.answer,
            self.inverse,
            self.target,
            x,
            self.u,
            self.active,
            self.room,
        )

    def solve(self, problem: Problem, warm: bool = False) -> tuple[np.ndarray, int]:
        if not warm:
            self.active[:] = 0
        self.x[0] = problem.start
        passes = _solve(self.program(problem, self.x))
        return self.u.copy(), passes

    def is_inaccurate(self, problem: Problem, passes: int) -> bool:
        """Whether the answer of the last `solve` says of itself that it may be off."""
        return _is_inaccurate(self.program(problem, self.x), passes < 0)


def reweighed(problem: Problem, factors: np.ndarray) -> Problem:
    """The program with other weights. factors: of pose, twist and volts, shape (3,)."""
    stage = problem.stage.copy()
    for columns in (WEIGHT, PULL):
        stage[:, columns : columns + 6] *= np.repeat(factors[:2], 3)
    return problem._replace(stage=stage, weight=problem.weight * factors[2])


def dense(program: Problem) -> tuple[np.ndarray, np.ndarray]:
    """(H, f) of 1/2 u^T H u + f . u over all inputs, by substitution of the states; nothing of riccati.py in it."""
    n, wheels = program.wanted.shape
    size = n * wheels
    by_input, free = np.zeros((6, size)), program.start.copy()
    hessian, slope = np.diag(np.tile(program.weight, n)), -np.tile(program.weight, n) * program.wanted.ravel()
    for k, row in enumerate(program.stage):
        move, turn = np.zeros((6, 6)), np.eye(3)
        turn[:2, 2] = row[GX], row[GY]
        move[:3, :3], move[:3, 3:], move[3:, 3:] = turn, row[E : E + 9].reshape(3, 3), row[V : V + 9].reshape(3, 3)
        drive = np.concatenate([row[HP : HP + 9].reshape(3, 3), row[HV : HV + 9].reshape(3, 3)]) @ program.push
        by_input, free = move @ by_input, move @ free + np.concatenate([row[CP : CP + 3], row[CV : CV + 3]])
        by_input[:, k * wheels : (k + 1) * wheels] += drive
        weight = row[WEIGHT : WEIGHT + 6]
        hessian += by_input.T @ (weight[:, None] * by_input)
        slope += by_input.T @ (weight * free + row[PULL : PULL + 6])
    return hessian, slope


def residual(program: Problem, hessian: np.ndarray, slope: np.ndarray, u: np.ndarray) -> float:
    """By how much inputs miss the conditions of an optimum [V]: of |u - clip(u - slope of the cost / its scale)|."""
    low, high = (each.ravel() for each in program.bounds)
    along = hessian @ u.ravel() + slope
    return float(np.abs(u.ravel() - np.clip(u.ravel() - along / np.diag(hessian), low, high)).max())
