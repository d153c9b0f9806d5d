"""One motor by output error: its whole log as a free run, the wheels off the ground or on.

    w' = g u - a w - c sgn w,   u held from row to row:   the exact step of a body axis, with w for the speed
    slope k = a/g [V s/rad]     dead_band c/g [V]         lag 1/a [s]

Speed and the angle turned are both outputs, and stops, reversals, latencies and intervals are those of every other fit.
With a duty in place of the voltage the units of slope and dead band are % s/rad and %.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.methods import AUTO, GAUSS, STUDENT
from omnidyn.identification.motors.bend import Bend, bend
from omnidyn.identification.motors.between import CURVE, WORDS
from omnidyn.identification.motors.engine import SPEED, MotorEngine, MotorProblem
from omnidyn.identification.motors.estimate import (
    BAND,
    FREE_RUN,
    INERTIA,
    LAG,
    SLOPE,
    MotorEstimate,
    named,
)
from omnidyn.identification.motors.log import MotorLog, motor_logs, orientation_of
from omnidyn.identification.motors.problem import begin, motor_problem, motor_record
from omnidyn.identification.motors.rest import rested_under, turned_under
from omnidyn.identification.output_error.conclusion import intervals
from omnidyn.identification.output_error.fit import degrees
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.support import at_the_end
from omnidyn.identification.output_error.trust.uncertainty import RISE, SANDWICH, Trust, trust
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run, as_list
from omnidyn.statement import Statement

LAGS = (0.005, 0.05, 0.5)  # [s] the search begins at each, and the best end counts
EDGE = 0.99  # of an input under which the motor rested
FREE_RUN_INPUTS = ("voltage", "duty")


def fit_motor(
    runs: Run | Sequence[Run], motor: int = 0, *, dead_band: bool = True, kind: str = "", between: str = AUTO,
    latency: bool = False, angle: bool = False, loss: str = GAUSS,
) -> MotorEstimate:  # fmt: skip
    """Fit slope, dead band and lag of one motor to whole logs by output error.

    motor: its number from 0. dead_band: False leaves Coulomb friction out. kind: "voltage" or "duty"; "" takes the
    first that is there. between: "hold": the input of a row holds to the next; "mean": the mean of both rows applies,
    where inputs are sampled as the speeds are; "curve": a smooth curve through the rows, a line where the input jumps;
    "auto": whichever fits best. Intervals span all ways but those that fit clearly worse, and that of a dead band
    that is seen also what is left of it where a smooth bend of the line is fitted too, if one is needed.
    latency: fit how late speed and angle are [s]; a lag and a latency are told apart only by how the speed sets off.
    angle: the angle is an output too, beside the speed (alone, where no speed is logged); what the log does not resolve
    of the input adds up in it, and then looks like friction.
    Raises InputError for a run without the channels, InsufficientDataError where the motor says nothing.
    """
    if between not in (AUTO, *WORDS):
        expected = f"{AUTO}, {', '.join(WORDS)}"
        raise InputError("no such way", got=between, expected=expected, where="between")
    if loss not in (GAUSS, STUDENT):
        raise InputError("unknown loss", got=loss, expected=f"{GAUSS} or {STUDENT}", where="loss")
    logs = logs_of_free_runs(runs, kind)
    found: dict[str, tuple[Solver[MotorProblem], Solution]] = {}
    for way in WORDS:
        problem = motor_problem([motor_record(log, motor, way, angle) for log in logs], dead_band, latency)
        solver = Solver(problem, MotorEngine(problem), degrees(loss))
        ends = [solver.minimise(begin(problem, lag)) for lag in LAGS]
        found[way] = solver, min(ends, key=lambda end: end.state.objective)
    cost = {way: end.state.objective for way, (_, end) in found.items()}
    chosen = between if between != AUTO else min(cost, key=lambda way: cost[way])
    # rows of a refined log have no measured neighbours, so that auto would not see whether these resemble
    rested = rested_under(logs, motor)
    known = {way: _trusted(*pair, SANDWICH if way == CURVE else AUTO, rested) for way, pair in found.items()}
    answers = {way: _answer(*pair, known[way], logs, motor, way) for way, pair in found.items()}
    fit = answers[chosen]
    rise = RISE * max(known[chosen].widening, 1.0) ** 2  # coloured residuals make every likelihood too steep
    for way in cost:
        if way != chosen and 2.0 * (cost[way] - cost[chosen]) <= rise:
            fit = _with_rival(fit, answers[way])
    if fit.dead_band_seen:
        fit = _with_bend(fit, bend(found[chosen][0], found[chosen][1].state))
    return fit.bounded(turned_under(logs, motor, way=orientation_of(logs, motor)), rested)


def _trusted(solver: Solver[MotorProblem], solution: Solution, kind: str, rested: float) -> Trust:
    """How far a fit can be trusted, and where only an edge tells of the dead band, how far beyond that.

    rested: the largest input under which the motor rested. Just below it rows at rest would turn, which looks like
    information; above it, where they rest, no row of a run at one speed tells of the dead band.
    """
    known, point, at = trust(solver, solution, kind), solution.state.point, solver.problem.where(BAND)
    if at < 0 or not EDGE * rested < point.values[at] <= rested:
        return known
    values = point.values.copy()
    values[at] = rested / EDGE
    beyond = trust(solver, replace(solution, state=solver.state(replace(point, values=values))), kind)
    return beyond if beyond.blind[at] else known


def logs_of_free_runs(runs: Run | Sequence[Run], kind: str) -> list[MotorLog]:
    """Runs as a free run takes them."""
    return motor_logs(as_list(runs), kind, kinds=FREE_RUN_INPUTS)


def _with_bend(fit: MotorEstimate, bent: Bend | None) -> MotorEstimate:
    """The fit with an interval of the dead band that holds the one with a smooth bend of the line fitted too.

    The slope goes with the dead band, as the two are correlated.
    """
    if bent is None or not bent.needed:
        return fit
    std = float(np.hypot(max(fit.std[BAND], bent.std), fit.value[BAND] - bent.value))
    along = fit.correlation * fit.std[SLOPE] / fit.std[BAND]
    slope = float(np.hypot(fit.std[SLOPE], along * np.sqrt(std**2 - fit.std[BAND] ** 2)))
    ends = sorted(fit.value[SLOPE] + along * (end - fit.value[BAND]) for end in bent.ci95)
    bends = {"left": bent.left, "value": bent.value, "std": bent.std, "unit": fit.unit}
    warning = Statement("line_bends", numbers=bends)
    return _widened(fit, {BAND: std, SLOPE: slope}, {BAND: bent.ci95, SLOPE: (ends[0], ends[1])}, warning)


def _with_rival(fit: MotorEstimate, rival: MotorEstimate) -> MotorEstimate:
    """The fit with intervals that hold those of another way of reading the input, which fits as well or better.

    What the input did between its rows is not in the log: one more number that is fitted or assumed, with a few values.
    Its 95 % region by likelihood holds all ways that fit worse by no more than RISE, so the intervals do too; the
    difference of the values joins the variance.
    """
    own = [name for name in (SLOPE, BAND, LAG, INERTIA) if name in fit.value]
    std = {name: float(np.hypot(fit.std[name], fit.value[name] - rival.value[name])) for name in own}
    warning = Statement("other_reading", numbers={
        "better": rival.rmse < 0.99 * fit.rmse, "other": rival.between, "other_error": rival.rmse, "error": fit.rmse,
        "between": fit.between,
    })  # fmt: skip
    return _widened(fit, std, {name: rival.ci95[name] for name in std}, warning)


def _widened(
    fit: MotorEstimate, std: dict[str, float], ci95: dict[str, tuple[float, float]], warning: Statement
) -> MotorEstimate:
    """The fit with other standard errors, intervals that hold these too, and a warning more."""
    both = {name: (min(fit.ci95[name][0], low), max(fit.ci95[name][1], high)) for name, (low, high) in ci95.items()}
    return replace(fit, std={**fit.std, **std}, ci95={**fit.ci95, **both}, warnings=(*fit.warnings, warning))


def _answer(
    solver: Solver[MotorProblem], solution: Solution, known: Trust, logs: Sequence[MotorLog], motor: int, between: str
) -> MotorEstimate:
    problem, values = solver.problem, solution.state.point.values
    if known.unseen[0]:
        raise InsufficientDataError(
            "the logs say nothing about this motor", got=f"motor {motor + 1}", expected="motion"
        )
    std, ci95 = intervals(problem, values, known)
    blind = {name for name, b in zip(problem.names, known.blind, strict=True) if b}
    value = {name: float(v) for name, v in zip(problem.names, values, strict=True)}
    at = problem.where(BAND)
    if at >= 0:
        high = problem.parameters[at].high
        if value[BAND] >= 0.99 * high or std[BAND] > high:
            blind |= {BAND}
            std[BAND], ci95[BAND] = float("nan"), (problem.parameters[at].low, high)
    ended = {p.name: p for p in at_the_end(problem, values) if p.name != BAND}  # which is no estimate
    blind |= ended.keys()
    for name, p in ended.items():
        std[name], ci95[name] = float("nan"), (p.low, p.high)
    value[INERTIA] = value[SLOPE] * value[LAG]
    std[INERTIA], ci95[INERTIA] = _of_product(problem, known, value[INERTIA])
    if ended.keys() & {SLOPE, LAG}:
        std[INERTIA], ci95[INERTIA] = float("nan"), (0.0, float("inf"))
    names = [name for name in (SLOPE, BAND, LAG, INERTIA, *problem.names) if name in value]
    rows, rmse = _speed_errors(MotorEngine(problem), solution.state.point)
    return MotorEstimate(
        motor=motor, kind=logs[0].kind, unit=logs[0].unit, way=FREE_RUN, between=between,
        value={name: value[name] for name in names}, std={name: std[name] for name in names},
        ci95={name: ci95[name] for name in names}, correlation=_correlation(known, 0, at), rmse=rmse, count=rows,
        source=named([log.run.source for log in logs]),
        at_bound=tuple(name for name, held in zip(problem.names, known.held, strict=True) if held),
        unidentifiable=tuple(name for name in problem.names if name in blind),
        left_out=sum(int(unresolved_rows(log.put_in[:, motor]).sum()) for log in logs),
        noise={c[0]: float(np.sqrt(v)) for c, v in zip(problem.columns, solution.state.variance, strict=True)},
        covariance=known.kind, converged=solution.converged,
    )  # fmt: skip


def _correlation(known: Trust, one: int, other: int) -> float:
    """Between two numbers; 0 where one of them is not there, or not known."""
    size = known.std[one] * known.std[other]
    return float(known.covariance[one, other] / size) if other >= 0 and np.isfinite(size) and size > 0.0 else 0.0


def _of_product(problem: MotorProblem, known: Trust, inertia: float) -> tuple[float, tuple[float, float]]:
    """Standard error and interval of slope times lag, both of which the solver sees as logarithms."""
    pair = [problem.where(SLOPE), problem.where(LAG)]
    spread = float(np.sqrt(max(known.covariance[np.ix_(pair, pair)].sum(), 0.0)))
    if not np.isfinite(spread):
        return float("inf"), (0.0, float("inf"))
    half = min(known.quantile * spread, 700.0)
    return inertia * spread, (inertia * float(np.exp(-half)), inertia * float(np.exp(half)))


def _speed_errors(engine: MotorEngine, point: Point) -> tuple[int, float]:
    """(rows, root mean square of the error of the speed [rad/s]); NaN where no speed is an output."""
    squares, count = 0.0, 0
    for piece, (predicted, _) in zip(engine.problem.pieces, engine.outputs(point), strict=True):
        if SPEED in piece.record.columns:
            c = piece.record.columns.index(SPEED)
            error = (predicted - piece.record.outputs)[piece.first : piece.last + 1, c]
            squares, count = squares + float(np.nansum(error**2)), count + int(np.isfinite(error).sum())
    return count, float(np.sqrt(squares / count)) if count else float("nan")
