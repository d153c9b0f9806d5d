"""One motor by output error: its whole log as a free run, the wheels off the ground or on.

    w' = g u - a w - c sgn w,   u held from row to row:   the exact step of a body axis, with w for the speed
    slope k = a/g [V s/rad]     dead_band c/g [V]         lag 1/a [s]

Speed and the angle turned are both outputs, and stops, reversals, latencies and intervals are those of every other fit.
With a duty in place of the voltage the units of slope and dead band are % s/rad and %.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.identification.methods import AUTO, GAUSS, STUDENT, degrees
from omnidyn.identification.motors.bent_line import BentLine, bend
from omnidyn.identification.motors.estimate import (
    BAND,
    FREE_RUN,
    INERTIA,
    LAG,
    OFFSET,
    SLOPE,
    MotorEstimate,
    named,
)
from omnidyn.identification.motors.input_between_rows import CURVE, WORDS
from omnidyn.identification.motors.log import MotorLog, follows, motor_logs, orientation_of
from omnidyn.identification.motors.motor_engine import SPEED, MotorProblem
from omnidyn.identification.motors.problem import begin, begin_at, motor_problem, motor_record
from omnidyn.identification.motors.rest import turns_both_ways
from omnidyn.identification.motors.steady_windows import rested_under, slope_between, turned_under, turns_at_one_input
from omnidyn.identification.motors.windows import line_numbers
from omnidyn.identification.output_error.conclusion import intervals
from omnidyn.identification.output_error.problem.differences import added_up, differences
from omnidyn.identification.output_error.problem.problem import Point
from omnidyn.identification.output_error.solve.solver import Solution, Solver
from omnidyn.identification.output_error.trust.search_ends import at_the_end
from omnidyn.identification.output_error.trust.uncertainty import RISE, SANDWICH, Trust, trust
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run, as_list
from omnidyn.statement import Statement

LAGS = (0.005, 0.05, 0.5)  # [s] the search begins at each, and the best end counts
EDGE = 0.99  # of an input under which the motor rested
FREE_RUN_INPUTS = ("voltage", "duty", "force")


def fit_motor(
    runs: Run | Sequence[Run],
    motor: int = 0,
    *,
    dead_band: bool = True,
    offset: bool = False,
    kind: str = "",
    between: str = AUTO,
    latency: bool = False,
    angle: bool = False,
    loss: str = GAUSS,
    start: Mapping[str, float] | None = None,
) -> MotorEstimate:
    """Fit slope, dead band and lag of one motor to whole logs by output error.

    motor: its number from 0. dead_band: False leaves Coulomb friction out. offset: fit a constant one of the input.
    kind: "voltage" or "duty"; "" takes the
    first that is there. between: "hold": the input of a row holds to the next; "mean": the mean of both rows applies,
    where inputs are sampled as the speeds are; "curve": a smooth curve through the rows, a line where the input jumps;
    "auto": whichever fits best. Intervals span all ways but those that fit clearly worse, and that of a dead band
    that is seen also what is left of it where a smooth bend of the line is fitted too, if one is needed.
    latency: fit how late speed and angle are [s]; a lag and a latency are told apart only by how the speed sets off.
    angle: the angle is an output too, beside the speed (alone, where no speed is logged); what the log does not resolve
    of the input adds up in it, and then looks like friction. start: numbers to begin at, by name, in place of those
    of a few lags and of the line through windows.
    Raises InputError for a run without the channels, InsufficientDataError where the motor says nothing.
    """
    _check_between(between)
    return fit_ways(
        runs, motor, dead_band=dead_band, offset=offset, kind=kind, latency=latency, angle=angle, loss=loss, start=start
    ).estimate(between)


def _check_between(between: str) -> None:
    if between not in (AUTO, *WORDS):
        expected = f"{AUTO}, {', '.join(WORDS)}"
        raise InputError("no such way", got=between, expected=expected, where="between")


@dataclass(frozen=True, eq=False)
class MotorFits:
    """The fits of one motor in each way that an input may hold between rows; `estimate` says what one of them means."""

    logs: Sequence[MotorLog]
    motor: int
    fit_by_reading: Mapping[str, tuple[Solver[MotorProblem], Solution]]
    trust_by_reading: Mapping[str, Trust]
    resting_input: float

    def estimate(self, between: str) -> MotorEstimate:
        """The fit in one of `WORDS`, or in that which fits best ("auto"), with what the others say beside it."""
        _check_between(between)
        logs, motor = self.logs, self.motor
        answers = {
            reading: _answer(*pair, self.trust_by_reading[reading], logs, motor, reading)
            for reading, pair in self.fit_by_reading.items()
        }
        cost = {reading: end.state.objective for reading, (_, end) in self.fit_by_reading.items()}
        best_reading = between if between != AUTO else min(cost, key=lambda reading: cost[reading])
        fit = answers[best_reading]
        # coloured residuals make every likelihood too steep
        rise = RISE * max(self.trust_by_reading[best_reading].widening, 1.0) ** 2
        for reading in cost:
            if reading != best_reading and 2.0 * (cost[reading] - cost[best_reading]) <= rise:
                fit = _with_rival(fit, answers[reading])
        if fit.dead_band_seen:
            solver, solution = self.fit_by_reading[best_reading]
            fit = _with_bend(fit, bend(solver, solution.state))
        fit = fit.bounded(turned_under(logs, motor, orientation=orientation_of(logs, motor)), self.resting_input)
        if BAND not in fit.unidentifiable:
            return fit
        low, high = slope_between(logs, motor, fit.ci95[BAND])  # both go together
        least, most = fit.ci95[SLOPE]
        return replace(fit, ci95={**fit.ci95, SLOPE: (min(least, low), max(most, high))})


def fit_ways(
    runs: Run | Sequence[Run],
    motor: int = 0,
    *,
    dead_band: bool = True,
    offset: bool = False,
    kind: str = "",
    latency: bool = False,
    angle: bool = False,
    loss: str = GAUSS,
    start: Mapping[str, float] | None = None,
) -> MotorFits:
    """Fit one motor in all ways that an input may hold between rows; arguments and refusals as of `fit_motor`."""
    if loss not in (GAUSS, STUDENT):
        raise InputError("unknown loss", got=loss, expected=f"{GAUSS} or {STUDENT}", where="loss")
    logs = logs_of_free_runs(runs, kind)
    fit_by_reading: dict[str, tuple[Solver[MotorProblem], Solution]] = {}
    line = line_numbers(logs, motor) if start is None else start
    for reading in WORDS:
        problem = motor_problem([motor_record(log, motor, reading, angle) for log in logs], dead_band, latency, offset)
        solution = solved(problem, degrees(loss), line, start is None)
        fit_by_reading[reading] = solution.solver, solution
    # rows of a refined log have no measured neighbours, so that auto would not see whether these resemble
    resting_input = rested_under(logs, motor)
    trust_by_reading = {
        reading: _trusted(*pair, SANDWICH if reading == CURVE else AUTO, resting_input)
        for reading, pair in fit_by_reading.items()
    }
    return MotorFits(logs, motor, fit_by_reading, trust_by_reading, resting_input)


def solved(
    problem: MotorProblem, degrees: float, near_values: Mapping[str, float] | None, is_global: bool = True
) -> Solution:
    """The best end of descents from numbers `near_values` the best ones, where there are any, and from LAGS
    `is_global`.

    degrees: of Student's t, 0 for Gauss.
    """
    solver = Solver(problem, problem.engine, degrees)
    starts = [] if near_values is None else [begin_at(problem, near_values)]
    starts += [begin(problem, lag) for lag in LAGS] if is_global or near_values is None else []
    return min((solver.minimise(start) for start in starts), key=lambda end: end.state.objective)


def _trusted(solver: Solver[MotorProblem], solution: Solution, kind: str, resting_input: float) -> Trust:
    """How far a fit can be trusted, and where only an edge tells of the dead band, how far beyond that.

    resting_input: the largest input under which the motor rested. Just below it rows at rest would turn, which looks
    like information; above it, where they rest, no row of a run at one speed tells of the dead band.
    """
    uncertainty, point, band_index = trust(solver, solution, kind), solution.state.point, solver.problem.where(BAND)
    if band_index < 0 or not EDGE * resting_input < point.values[band_index] <= resting_input:
        return uncertainty
    values = point.values.copy()
    values[band_index] = resting_input / EDGE
    edge_uncertainty = trust(solver, replace(solution, state=solver.state(replace(point, values=values))), kind)
    return edge_uncertainty if edge_uncertainty.blind_parameters[band_index] else uncertainty


def logs_of_free_runs(runs: Run | Sequence[Run], kind: str) -> list[MotorLog]:
    """Runs as a free run takes them.

    Speeds that are differences of counts become the angles that they are of: such a speed is the mean over the row
    before, half a row late by its sensor, and the angle is not.
    """
    logs = as_list(runs)
    count_differences = differences(logs)
    if count_differences is not None and count_differences.reason is None:
        angles = [added_up(run, count_differences) for run in logs]
        if not any(lost[1:].any() for _, lost in angles):
            logs = [run.replace(wheel_angle=a, wheel_speed=None) for run, (a, _) in zip(logs, angles, strict=True)]
    return motor_logs(logs, kind, kinds=FREE_RUN_INPUTS)


def _with_bend(fit: MotorEstimate, bent_line: BentLine | None) -> MotorEstimate:
    """The fit with an interval of the dead band that holds the one with a smooth bend of the line fitted too.

    The slope goes with the dead band, as the two are correlated.
    """
    if bent_line is None or not bent_line.needs_bends:
        return fit
    std = float(np.hypot(max(fit.std[BAND], bent_line.std), fit.value[BAND] - bent_line.value))
    slope_of_band = fit.correlation * fit.std[SLOPE] / fit.std[BAND]
    slope = float(np.hypot(fit.std[SLOPE], slope_of_band * np.sqrt(std**2 - fit.std[BAND] ** 2)))
    ends = sorted(fit.value[SLOPE] + slope_of_band * (end - fit.value[BAND]) for end in bent_line.ci95)
    bends = {"left": bent_line.left, "value": bent_line.value, "std": bent_line.std, "unit": fit.unit}
    warning = Statement("line_bends", numbers=bends)
    return _widened(fit, {BAND: std, SLOPE: slope}, {BAND: bent_line.ci95, SLOPE: (ends[0], ends[1])}, warning)


def _with_rival(fit: MotorEstimate, rival: MotorEstimate) -> MotorEstimate:
    """The fit with intervals that hold those of another way of reading the input, which fits as well or better.

    What the input did between its rows is not in the log: one more number that is fitted or assumed, with a few values.
    Its 95 % region by likelihood holds all ways that fit worse by no more than RISE, so the intervals do too; the
    difference of the values joins the variance.
    """
    names = [name for name in (SLOPE, BAND, OFFSET, LAG, INERTIA) if name in fit.value]
    std = {name: float(np.hypot(fit.std[name], fit.value[name] - rival.value[name])) for name in names}
    warning = Statement(
        "other_reading",
        numbers={
            "better": rival.rmse < 0.99 * fit.rmse,
            "other": rival.between,
            "other_error": rival.rmse,
            "error": fit.rmse,
            "between": fit.between,
            "travel": fit.travel,
        },
    )
    return _widened(fit, std, {name: rival.ci95[name] for name in std}, warning)


def _widened(
    fit: MotorEstimate, std: dict[str, float], ci95: dict[str, tuple[float, float]], warning: Statement
) -> MotorEstimate:
    """The fit with other standard errors, intervals that hold these too, and a warning more."""
    joint_intervals = {
        name: (min(fit.ci95[name][0], low), max(fit.ci95[name][1], high)) for name, (low, high) in ci95.items()
    }
    return replace(fit, std={**fit.std, **std}, ci95={**fit.ci95, **joint_intervals}, warnings=(*fit.warnings, warning))


def _answer(
    solver: Solver[MotorProblem],
    solution: Solution,
    uncertainty: Trust,
    logs: Sequence[MotorLog],
    motor: int,
    between: str,
) -> MotorEstimate:
    problem, values = solver.problem, solution.state.point.values
    if uncertainty.unseen[0]:
        raise InsufficientDataError(
            "the logs say nothing about this motor", got=f"motor {motor + 1}", expected="motion"
        )
    std, ci95 = intervals(problem, values, uncertainty)
    blind_names = {name for name, b in zip(problem.names, uncertainty.blind_parameters, strict=True) if b}
    value = {name: float(v) for name, v in zip(problem.names, values, strict=True)}
    band_index = problem.where(BAND)
    if band_index >= 0:
        high = problem.parameters[band_index].high
        if value[BAND] >= 0.99 * high or std[BAND] > high:
            blind_names |= {BAND}
            std[BAND], ci95[BAND] = float("nan"), (problem.parameters[band_index].low, high)
    parameters_at_bound = {p.name: p for p in at_the_end(problem, values) if p.name != BAND}  # which is no estimate
    blind_names |= parameters_at_bound.keys()
    if LAG in parameters_at_bound and turns_at_one_input(logs, motor):  # no transient and one speed: rounding decides
        blind_names |= {BAND}
    for name, p in parameters_at_bound.items():
        std[name], ci95[name] = float("nan"), (p.low, p.high)
    value[INERTIA] = value[SLOPE] * value[LAG]
    std[INERTIA], ci95[INERTIA] = _of_product(problem, uncertainty, value[INERTIA])
    if parameters_at_bound.keys() & {SLOPE, LAG}:
        std[INERTIA], ci95[INERTIA] = float("nan"), (0.0, float("inf"))
    names = [name for name in (SLOPE, BAND, OFFSET, LAG, INERTIA, *problem.names) if name in value]
    rows, rmse = _speed_errors(problem, solution.state.point)
    size = uncertainty.std[0] * uncertainty.std[band_index]
    correlation = (
        float(uncertainty.covariance[0, band_index] / size)
        if band_index >= 0 and np.isfinite(size) and size > 0.0
        else 0.0
    )
    return MotorEstimate(
        motor=motor,
        kind=logs[0].kind,
        unit=logs[0].unit,
        basis=FREE_RUN,
        between=between,
        value={name: value[name] for name in names},
        std={name: std[name] for name in names},
        ci95={name: ci95[name] for name in names},
        correlation=correlation,
        rmse=rmse,
        count=rows,
        source=named([log.run.source for log in logs]),
        at_bound=tuple(
            name for name, is_held in zip(problem.names, uncertainty.held_parameters, strict=True) if is_held
        ),
        unidentifiable=tuple(name for name in problem.names if name in blind_names),
        left_out=sum(int(unresolved_rows(log.input_values[:, motor]).sum()) for log in logs),
        noise={c[0]: float(np.sqrt(v)) for c, v in zip(problem.columns, solution.state.variance, strict=True)},
        covariance=uncertainty.kind,
        converged=solution.converged,
        answers=follows([(log.input_values[:, motor], log.motion[:, motor]) for log in logs], logs[0].step)
        is not False,
        one_way=not turns_both_ways(logs, motor),
        travel=logs[0].travel,
    )


def _of_product(problem: MotorProblem, uncertainty: Trust, inertia: float) -> tuple[float, tuple[float, float]]:
    """Standard error and interval of slope times lag, both of which the solver sees as logarithms."""
    pair = [problem.where(SLOPE), problem.where(LAG)]
    spread = float(np.sqrt(max(uncertainty.covariance[np.ix_(pair, pair)].sum(), 0.0)))
    if not np.isfinite(spread):
        return float("inf"), (0.0, float("inf"))
    half = min(uncertainty.quantile * spread, 700.0)
    return inertia * spread, (inertia * float(np.exp(-half)), inertia * float(np.exp(half)))


def _speed_errors(problem: MotorProblem, point: Point) -> tuple[int, float]:
    """(rows, root mean square of the error of the speed [rad/s]), of the steps of an angle where no speed is known."""
    squares, count = 0.0, 0
    for piece, (predicted, _) in zip(problem.pieces, problem.engine.outputs(point), strict=True):
        rows = slice(piece.first, piece.last + 1)
        if SPEED in piece.record.columns:
            error = (predicted - piece.record.outputs)[rows, piece.record.columns.index(SPEED)]
        else:  # of the steps of the angle
            errors = (predicted - piece.record.outputs)[rows, 0]
            known_errors = np.isfinite(errors)
            error = np.diff(errors[known_errors]) / np.diff(piece.record.t[rows][known_errors])
        squares, count = squares + float(np.nansum(error**2)), count + int(np.isfinite(error).sum())
    return count, float(np.sqrt(squares / count)) if count else float("nan")
