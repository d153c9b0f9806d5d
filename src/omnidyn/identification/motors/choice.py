"""Which way to fit a motor: by its error on logs left out, each in turn, of those that are fitted to and no others."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.identification.motors.estimate import BAND, OFFSET, MotorEstimate
from omnidyn.identification.motors.fit import logs_of_free_runs
from omnidyn.identification.motors.input_between_rows import CURVE, SUB
from omnidyn.identification.motors.motor_engine import SPEED
from omnidyn.identification.motors.problem import motor_problem, motor_record
from omnidyn.identification.output_error.problem.record import SHORTEST
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run, as_list

SHARES = 4  # parts in time of a single log, of which each is left out
BLOCKS = 12  # of all logs left out, which are predicted each by itself

Score = Callable[[MotorEstimate, Sequence[Run]], float]


def run_motor(fit: MotorEstimate, runs: Run | Sequence[Run]) -> list[FloatArray]:
    """Free runs of a fitted motor under the inputs of other logs: its speed [rad/s], shape (rows,) each.

    Each piece starts at the measured speed, or by the slope of the angle where no speed is logged, and at rest where
    the log begins so; NaN outside of the pieces. Latencies are included.
    """
    assert fit.motor is not None
    logs = [
        replace(log, speed=log.motion if log.speed is None and len(log.t) >= SHORTEST else log.speed)
        for log in logs_of_free_runs(runs, fit.kind)
    ]
    records = [motor_record(log, fit.motor, fit.between, angle=False) for log in logs]
    problem = motor_problem(records, BAND in fit.value, bool(fit.late), OFFSET in fit.value)
    latency = fit.value.get(f"latency.{SPEED[0]}", next(iter(fit.late.values()), 0.0))
    values = [fit.value.get(name, latency) for name in problem.names]
    point = replace(problem.start(), values=np.array(values))
    speeds_by_record = {id(r): np.full(len(r.t), np.nan) for r in records}
    for piece, (predicted, _) in zip(problem.pieces, problem.engine.outputs(point), strict=True):
        rows = slice(piece.first, piece.last + 1)
        speeds_by_record[id(piece.record)][rows] = predicted[rows, 0]
    step = SUB if fit.between == CURVE else 1
    return [speed[int(r.begins_at_rest) :: step] for r, speed in zip(records, speeds_by_record.values(), strict=True)]


def fit_rmse(fit: MotorEstimate, runs: Run | Sequence[Run]) -> float:
    """Root mean square error of the speed [rad/s] of free runs beside logs, or of the slope of their angle.

    Rows whose input the log does not resolve do not count.
    """
    logs = as_list(runs)
    errors = [
        (predicted_speed - (log.motion if log.speed is None else log.speed)[:, fit.motor])[
            ~unresolved_rows(log.input_values[:, fit.motor])
        ]
        for predicted_speed, log in zip(run_motor(fit, logs), logs_of_free_runs(logs, fit.kind), strict=True)
    ]
    all_errors = np.concatenate(errors)
    all_errors = all_errors[np.isfinite(all_errors)]
    return float(np.sqrt(np.mean(all_errors**2))) if len(all_errors) else float("nan")


def block_errors(
    fit: MotorEstimate, runs: Sequence[Run], score: Score = fit_rmse, count: int | None = None
) -> FloatArray:
    """Squared errors of free runs over blocks of logs, each by itself; NaN where one has none. count: of each log."""
    errors = []
    for run in runs:
        for block in parts_of(run, count or -(-BLOCKS // len(runs))):
            try:
                errors.append(score(fit, [block]) ** 2)
            except OmnidynError:
                errors.append(np.nan)
    return np.array(errors)


def parts_of(run: Run, count: int) -> list[Run]:
    """A log in so many parts in time."""
    edges = np.linspace(0, len(run), count + 1).astype(int).tolist()
    return [
        run.replace(t=run.t[a:b], **{name: values[a:b] for name, values in run.channels.items()})
        for a, b in pairwise(edges)
    ]
