"""Intervals that do not rest on a quadratic likelihood: its profile, and the bootstrap over runs; both on request."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

from omnidyn.errors import InsufficientDataError
from omnidyn.identification.output_error.problem import Point
from omnidyn.identification.output_error.solver import Solution, Solver

FloatArray = NDArray[np.float64]

RISE = float(chdtri(1, 0.05))  # of 2 F at the ends of a 95 % interval: 3.84
OUTWARD, HALVINGS = 12, 12  # steps of 1.5 standard errors out, then halvings
LEAST_RUNS = 5
SEED = 20120101


def profile_interval(solver: Solver, solution: Solution, index: int, std: float) -> tuple[float, float]:
    """95 % interval of one parameter by the profile of the likelihood, all others fitted anew at each value.

    2 (F - least F) = 3.84 at its ends; an end at a bound is that bound. std: standard error on the scale of the solver.
    For white residuals: colour is not seen.
    """
    own = solver.problem.parameters[index]
    best = own.inner(float(solution.state.point.values[index]))
    low, high = (
        _end(solver, solution, index, best, way * (std if np.isfinite(std) and std > 0.0 else abs(best) or 1.0))
        for way in (-1.0, 1.0)
    )
    return own.outer(low), own.outer(high)


def _end(solver: Solver, solution: Solution, index: int, best: float, step: float) -> float:
    own, point = solver.problem.parameters[index], solution.state.point
    bound = own.inner(own.low) if step < 0.0 else own.inner(own.high)
    inside, outside = best, best
    for _ in range(OUTWARD):
        outside = min(outside + 1.5 * step, bound) if step > 0.0 else max(outside + 1.5 * step, bound)
        rise, point = _rise(solver, solution, index, outside, point)
        if rise > RISE:
            break
        inside = outside
        if outside == bound:
            return bound
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        rise, point = _rise(solver, solution, index, middle, point)
        inside, outside = (middle, outside) if rise <= RISE else (inside, middle)
    return 0.5 * (inside + outside)


def _rise(solver: Solver, solution: Solution, index: int, inner: float, point: Point) -> tuple[float, Point]:
    """2 (F - least F) with one parameter held at a value, and the point there."""
    parameters = list(solver.problem.parameters)
    value = parameters[index].outer(inner)
    parameters[index] = replace(parameters[index], value=value, low=value, high=value)
    values = point.values.copy()
    values[index] = value
    held = Solver(replace(solver.problem, parameters=tuple(parameters)), solver.engine, solver.nu)
    found = held.minimise(Point(values, point.states))
    return 2.0 * (found.state.objective - solution.state.objective), found.state.point


def bootstrap(solver: Solver, solution: Solution, draws: int, seed: int = SEED) -> FloatArray:
    """Fits to runs drawn with replacement. Shape (draws, P).

    Runs are the blocks: whatever their residuals remember, from one run to the next they do not.
    Raises InsufficientDataError for fewer than LEAST_RUNS runs.
    """
    pieces, states = solver.problem.pieces, solution.state.point.states
    runs = list(dict.fromkeys(id(piece.record) for piece in pieces))
    if len(runs) < LEAST_RUNS:
        raise InsufficientDataError(
            "too few runs for a bootstrap", got=f"{len(runs)}", expected=f"{LEAST_RUNS} or more",
            remedy="cut a long log into runs, or take the sandwich", where="bootstrap",
        )  # fmt: skip
    rng, found = np.random.default_rng(seed), []
    for _ in range(draws):
        drawn = [runs[k] for k in rng.integers(len(runs), size=len(runs))]
        chosen = [k for run in drawn for k, piece in enumerate(pieces) if id(piece.record) == run]
        problem = replace(solver.problem, pieces=tuple(pieces[k] for k in chosen))
        again = Solver(problem, solver.engine.on(problem), solver.nu)
        point = Point(solution.state.point.values, tuple(states[k] for k in chosen))
        found.append(again.minimise(point).state.point.values)
    return np.array(found)
