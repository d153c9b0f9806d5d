"""fit_output_error: whole logs in, a robot with honest intervals out."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError, InsufficientDataError, UnsupportedError
from omnidyn.identification.estimate import Correlation, identified
from omnidyn.identification.output_error.answer import Nuisance, OutputErrorEstimate
from omnidyn.identification.output_error.exact_engine import ExactEngine
from omnidyn.identification.output_error.nuisances import AUTO, LATENCY, nuisance_parameters, pieces
from omnidyn.identification.output_error.parameters import FRICTION, robot_parameters
from omnidyn.identification.output_error.problem import Point, Problem
from omnidyn.identification.output_error.record import Record, record
from omnidyn.identification.output_error.solver import Solution, Solver, State
from omnidyn.identification.output_error.starts import friction_values, integral_start
from omnidyn.identification.output_error.uncertainty import SHARE, Trust, trust
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.simulation.exact import why_not_exact

FloatArray = NDArray[np.float64]

GAUSS, STUDENT = "gaussian", "student-t"
NU = 4.0  # degrees of freedom of Student's t: 2 % of wild samples hardly count, 95 % efficient without them
IDENTIFIED = "identified:"  # how the source of a number begins that an earlier fit has written


@dataclass(frozen=True)
class Options:
    """How to fit; see fit_output_error."""

    free: tuple[str, ...] | None = None
    fixed: tuple[str, ...] = ()
    nuisances: tuple[str, ...] = ()
    start: str = AUTO
    use_priors: bool = False
    outputs: tuple[str, ...] | None = None
    loss: str = GAUSS
    covariance: str = AUTO


def fit_output_error(
    runs: Run | Sequence[Run],
    robot: Robot,
    *,
    free: Sequence[str] | None = None,
    fixed: Sequence[str] = (),
    nuisances: Sequence[str] = (),
    start: str = AUTO,
    use_priors: bool = False,
    outputs: Sequence[str] | None = None,
    loss: str = GAUSS,
    covariance: str = AUTO,
    watch: Callable[[State], None] | None = None,
) -> OutputErrorEstimate:
    """Fit numbers of a robot to whole logs by maximum likelihood of the model's free run.

    runs: one or many, of any length and rate; they are split at gaps. Inputs: voltage, or duty times the supply.
    free: keys of the robot file, such as "body.mass_kg"; by default B and C of the three axes. fixed: keys taken out.
    The EMF constant follows the torque constant unless both are free. Breakaway follows coulomb where the robot has
    none of its own.
    nuisances: what the log does to the model: "latency" (or "latency.twist"), "gain", "dead_band", "fade".
    start: "rest", "free", or "auto": at rest where that shows.
    use_priors: a std in the robot file counts as a Gaussian prior of what is free, and what has one is free too. Off by
    default: a std that an earlier fit wrote from the same log would count the log twice; such ones ("identified: ...")
    are never used.
    outputs: of "twist", "wheel_speed", "current", "heading"; by default all that the log has.
    loss: "gaussian", or "student-t" for logs with outliers. covariance: "white", "sandwich", or "auto".
    watch: is called with every better state on the way.

    Returns an Estimate with nuisances, noise and what is not identifiable. Raises InputError for options and logs that
    cannot be used, InsufficientDataError where nothing can be learnt, UnsupportedError for robots without an exact
    engine.
    """
    given = Options(
        None if free is None else tuple(free), tuple(fixed), tuple(nuisances), start, use_priors,
        None if outputs is None else tuple(outputs), loss, covariance,
    )  # fmt: skip
    records = _records([runs] if isinstance(runs, Run) else list(runs), robot, given)
    problem = make_problem(records, robot, given)
    solver = Solver(problem, ExactEngine(problem), NU if loss == STUDENT else 0.0)
    solution = solver.minimise(first_point(solver, records), watch=watch)
    return _answer(solver, solution, trust(solver, solution, covariance), records, given)


def _records(runs: list[Run], robot: Robot, given: Options) -> list[Record]:
    for value, known, where in (
        (given.loss, (GAUSS, STUDENT), "loss"),
        (given.covariance, (AUTO, "white", "sandwich"), "covariance"),
    ):
        if value not in known:
            raise InputError(f"unknown {where}", got=value, expected=" or ".join(known), where=where)
    if not runs:
        raise InputError("nothing to fit to", got="no runs", expected="one or more", where="runs")
    reasons = why_not_exact(robot)
    if robot.motor.electrical == DYNAMIC:
        reasons.append('winding inductance ([motor] electrical = "dynamic")')
    if reasons:
        raise UnsupportedError(
            "this fit needs the exact engine", got="; ".join(reasons), expected="a robot whose axes do not couple",
            remedy="leave that out of the robot file", where=robot.name,
        )  # fmt: skip
    return [record(run, robot, given.outputs) for run in runs]


def make_problem(records: Sequence[Record], robot: Robot, given: Options) -> Problem:
    """What is free, and how the pieces start. Raises InputError for unknown keys, or where nothing is left free."""
    priors = known_priors(robot) if given.use_priors else {}
    keys = list(given.free) if given.free is not None else [*FRICTION, *(key for key in priors if key not in FRICTION)]
    unknown = [key for key in given.fixed if key not in keys]
    if unknown and given.free is not None:
        raise InputError("fixed, but not free", got=unknown[0], expected=", ".join(keys), where="fixed")
    keys = [key for key in keys if key not in given.fixed]
    if not keys:
        raise InputError("nothing is free", got="no key", expected="at least one", where="free")
    own = robot_parameters(robot, keys, priors)
    more = nuisance_parameters(given.nuisances, records)
    parts = pieces(records, robot, given.start, any(p.name.startswith(LATENCY) for p in more))
    rows = sum(int(np.isfinite(p.record.outputs[p.first : p.last + 1]).sum()) for p in parts)
    if rows <= len(own) + len(more):
        raise InsufficientDataError(
            "too few measurements", got=f"{rows}", expected=f"more than {len(own) + len(more)}, one for each number"
        )
    return Problem(robot, (*own, *more), len(own), tuple(parts))


def known_priors(robot: Robot) -> dict[str, tuple[float, float]]:
    """Priors of the robot file that are independent of any log: key -> (mean, std)."""
    from omnidyn.simulation.tangent import parameter

    found = {}
    for key, prior in robot.priors.items():
        if prior.std is not None and not prior.source.startswith(IDENTIFIED):
            found[key] = (float(parameter(robot, key)), prior.std)
    return found


def first_point(solver: Solver, records: Sequence[Record]) -> Point:
    """The best of: the robot as it is, the integral form; axis by axis where the axes do not share parameters."""
    problem, engine = solver.problem, solver.engine
    own = problem.start()
    count = problem.robot_count
    found = integral_start(engine.mapping, own.values[:count], records)
    values = own.values.copy()
    values[:count] = friction_values(engine.mapping, own.values[:count], found)
    states = [solver.state(own), solver.state(Point(values, own.states))]
    return min(states, key=lambda state: state.objective).point


def _answer(
    solver: Solver, solution: Solution, known: Trust, records: Sequence[Record], given: Options
) -> OutputErrorEstimate:
    problem, values = solver.problem, solution.state.point.values.copy()
    values[known.blind] = problem.start().values[known.blind]
    blind = tuple(p.name for p, b in zip(problem.parameters, known.blind, strict=True) if b)
    own = problem.robot_count
    if known.blind[:own].all():
        raise InsufficientDataError(
            "the logs say nothing about what is free", got=", ".join(p.name for p in problem.parameters[:own]),
            expected="motion", remedy="drive the robot faster than its dead zone", where=records[0].source,
        )  # fmt: skip
    std, ci95 = _intervals(problem, values, known)
    data = _data(records)
    names = [p.name for p in problem.parameters]
    fitted = problem.parameters[:own]
    warnings = _warnings(solver, solution, known, records, blind)
    return OutputErrorEstimate(
        robot=_robot(problem, values, std, blind, data),
        value={p.name: float(v) for p, v in zip(fitted, values, strict=False)},
        std={name: std[name] for name in names[:own]},
        ci95={name: ci95[name] for name in names[:own]},
        correlation=_correlation(names, known),
        degrees_of_freedom={name: known.degrees for name in names[:own]},
        at_bound=tuple(name for name, held in zip(names[:own], known.held, strict=False) if held),
        warnings=tuple(warnings),
        method=_method(given, known),
        data=data,
        nuisances={
            name: Nuisance(float(values[own + j]), std[name], ci95[name], _unit(name))
            for j, name in enumerate(names[own:])
        },
        noise={_column(c): float(s) for c, s in zip(problem.columns, np.sqrt(solution.state.variance), strict=True)},
        unidentifiable=blind,
        blind=tuple(_direction(problem, values, way) for _, way in known.directions),
        covariance=known.kind,
        iterations=solution.iterations,
        converged=solution.converged,
    )


def _intervals(
    problem: Problem, values: FloatArray, known: Trust
) -> tuple[dict[str, float], dict[str, tuple[float, float]]]:
    """Standard errors and 95 % intervals, on the scale on which the solver works; at a bound as for a friction line.

    At a bound: from the bound to what the free fit would reach, or to what it would reach from the bound.
    """
    std: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    for j, p in enumerate(problem.parameters):
        value, own = float(values[j]), float(known.std[j])
        std[p.name] = own * p.slope(value)
        half, inner = known.quantile * own, p.inner(value) if value > 0.0 or not p.log else -math.inf
        if not math.isfinite(own):
            ci95[p.name] = (p.low, math.inf)
            continue
        low, high = inner - half, inner + half
        if known.held[j]:
            pushed = float(known.free_step[j])
            low, high = (
                (inner, inner + max(half, half + pushed)) if pushed < 0 else (inner + min(-half, pushed - half), inner)
            )
        low = max(low, p.inner(p.low)) if not p.log else low
        ci95[p.name] = (p.outer(low), p.outer(high))
    return std, ci95


def _robot(problem: Problem, values: FloatArray, std: Mapping[str, float], blind: Sequence[str], data: str) -> Robot:
    """The robot with the fitted numbers, and where they come from."""
    robot, priors = problem.robot, dict(problem.robot.priors)
    for p, value in zip(problem.parameters[: problem.robot_count], values, strict=False):
        if p.name in blind:
            continue
        robot = p.on(robot, float(value))
        whole = p.name.partition("[")[0]
        if whole != p.name and whole in priors:  # what was known of a list goes to its items
            inherited = priors.pop(whole)
            priors.update({f"{whole}[{i}]": inherited for i in range(3)})
        for key, factor in ((p.name, 1.0), *p.also):
            priors[key] = identified(std[p.name] * factor, f"output error, {data}")
    axes = robot.friction.axes
    if axes.breakaway is not None:
        axes = axes.model_copy(
            update={"breakaway": tuple(max(s, c) for s, c in zip(axes.breakaway, axes.coulomb, strict=True))}
        )
        robot = robot.model_copy(update={"friction": robot.friction.model_copy(update={"axes": axes})})
    return robot.replace(priors=priors)


def _correlation(names: Sequence[str], known: Trust) -> Correlation:
    finite = np.isfinite(np.diag(known.covariance))
    size = np.where(finite & (known.std > 0.0), known.std, 1.0)
    matrix = np.where(np.outer(finite, finite), known.covariance, 0.0) / np.outer(size, size)
    np.fill_diagonal(matrix, 1.0)
    return Correlation(tuple(names), matrix)


def _warnings(
    solver: Solver, solution: Solution, known: Trust, records: Sequence[Record], blind: Sequence[str]
) -> list[str]:
    words = list(dict.fromkeys(f"{r.source or 'log'}: {note}" for r in records for note in r.notes))
    if not solution.converged:
        words.append(f"the fit was cut short after {solution.iterations} iterations: the numbers are of its last step")
    words += [f"{name} is not identifiable from these logs: it stays as it was" for name in blind]
    for j, p in enumerate(solver.problem.parameters):
        if known.held[j]:
            bound = (
                p.low
                if abs(solution.state.point.values[j] - p.low) <= abs(solution.state.point.values[j] - p.high)
                else p.high
            )
            words.append(f"{p.name} is at its bound {bound:.4g}: the best fit lies beyond it")
    if known.kind == "sandwich":
        words.append(
            f"the residuals are not white (correlation of neighbours up to {np.abs(known.neighbours).max():.2f}): the "
            f"intervals allow for it, up to {max(known.widening, 1.0):.2g} times as wide as for white noise"
        )
    return words


def _direction(problem: Problem, values: FloatArray, way: FloatArray) -> str:
    """A direction of the parameters in words: by how many percent each has to move for nothing to change."""
    relative = np.array(
        [w if p.log else w / (abs(v) or 1.0) for p, v, w in zip(problem.parameters, values, way, strict=True)]
    )
    relative /= np.abs(relative).max() or 1.0
    parts = [
        f"{p.name} {100.0 * share:+.0f} %"
        for p, share in zip(problem.parameters, relative, strict=True)
        if abs(share) > SHARE
    ]
    return " with ".join(parts) + " (or any part of it) leaves the outputs as they are"


def _column(column: tuple[str, int]) -> str:
    return f"{column[0]}[{column[1]}]"


def _unit(name: str) -> str:
    return {LATENCY: "s", "dead_band": "V"}.get(name.partition(".")[0], "")


def _method(given: Options, known: Trust) -> str:
    loss = "Gaussian noise" if given.loss == GAUSS else f"Student's t, {NU:g} degrees of freedom"
    return f"output error, maximum likelihood, {loss}, {known.kind} covariance"


def _data(records: Sequence[Record]) -> str:
    rows = sum(last - first + 1 for r in records for first, last in r.pieces)
    first = records[0].source or "unnamed"
    return f"{first}, {rows} rows" if len(records) == 1 else f"{first} and {len(records) - 1} more logs, {rows} rows"
