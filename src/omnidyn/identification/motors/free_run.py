"""Free runs of a fitted motor, and how far they are from logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.identification.motors.between import CURVE, SUB
from omnidyn.identification.motors.engine import SPEED, MotorEngine
from omnidyn.identification.motors.estimate import BAND, MotorEstimate
from omnidyn.identification.motors.fit import logs_of_free_runs
from omnidyn.identification.motors.problem import motor_problem, motor_record
from omnidyn.identification.output_error.problem.record import SHORTEST
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run


def run_motor(fit: MotorEstimate, runs: Run | Sequence[Run]) -> list[FloatArray]:
    """Free runs of a fitted motor under the inputs of other logs: its speed [rad/s], shape (rows,) each.

    Each piece starts at the measured speed, or by the slope of the angle where no speed is logged; NaN outside of the
    pieces. Latencies are included.
    """
    assert fit.motor is not None
    logs = [
        replace(log, speed=log.motion if log.speed is None and len(log.t) >= SHORTEST else log.speed)
        for log in logs_of_free_runs(runs, fit.kind)
    ]  # fmt: skip
    records = [motor_record(log, fit.motor, fit.between, angle=False) for log in logs]
    problem = motor_problem(records, BAND in fit.value, bool(fit.late))
    late = fit.value.get(f"latency.{SPEED[0]}", next(iter(fit.late.values()), 0.0))
    values = [fit.value.get(name, late) for name in problem.names]
    point = replace(problem.start(), values=np.array(values))
    found = {id(r): np.full(len(r.t), np.nan) for r in records}
    for piece, (predicted, _) in zip(problem.pieces, MotorEngine(problem).outputs(point), strict=True):
        rows = slice(piece.first, piece.last + 1)
        found[id(piece.record)][rows] = predicted[rows, 0]
    return [speed[:: SUB if fit.between == CURVE else 1] for speed in found.values()]


def fit_rmse(fit: MotorEstimate, runs: Run | Sequence[Run]) -> float:
    """Root mean square error of the speed [rad/s] of free runs beside logs; NaN where none has a speed.

    Rows whose input the log does not resolve do not count.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    errors = [
        (ours - run.wheel_speed[:, fit.motor])[~unresolved_rows(getattr(run, fit.kind)[:, fit.motor])]
        for ours, run in zip(run_motor(fit, every), every, strict=True)
        if run.wheel_speed is not None
    ]  # fmt: skip
    known = np.concatenate(errors) if errors else np.zeros(0)
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
