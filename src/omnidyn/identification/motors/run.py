"""Free runs of a fitted motor, and how far they are from logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from omnidyn.identification.motors.engine import BAND, INNER, MotorEngine
from omnidyn.identification.motors.fit import MotorFit
from omnidyn.identification.motors.input import SUB
from omnidyn.identification.motors.log import CURVE, INPUTS, motor_problem, motor_records
from omnidyn.identification.output_error.problem.nuisances import LATENCY
from omnidyn.identification.output_error.problem.record import SHORTEST
from omnidyn.logs.resolved import unresolved_rows
from omnidyn.run import Run

FloatArray = NDArray[np.float64]


def run_motor(fit: MotorFit, runs: Run | Sequence[Run]) -> list[FloatArray]:
    """Free runs of a fitted motor under the inputs of other logs: its speed [rad/s], shape (rows,) each.

    Each piece starts at the measured speed; NaN outside of the pieces. Latencies are included.
    """
    every = [_with_speed(run) for run in ([runs] if isinstance(runs, Run) else runs)]
    kind = next(name for name, unit in INPUTS.items() if unit == fit.unit)
    records, _ = motor_records(every, fit.motor, kind, fit.between, angle=False)
    problem = motor_problem(records, BAND in fit.value, bool(fit.nuisances))
    values = [fit.value[name.removeprefix(INNER)] for name in problem.names[: problem.robot_count]]
    values += [_late(fit) for _ in problem.names[problem.robot_count :]]
    engine = MotorEngine(problem)
    point = replace(problem.start(), values=np.array(values))
    found = [np.full(len(r.t), np.nan) for r in records]
    for piece, (predicted, _) in zip(problem.pieces, engine.outputs(point), strict=True):
        k = next(i for i, r in enumerate(records) if r is piece.record)
        found[k][piece.first : piece.last + 1] = predicted[piece.first : piece.last + 1, 0]
    return [speed[::SUB] for speed in found] if fit.between == CURVE else found


def _late(fit: MotorFit) -> float:
    own = fit.nuisances.get(f"{LATENCY}.wheel_speed") or next(iter(fit.nuisances.values()))
    return own.value


def _with_speed(run: Run) -> Run:
    """The run with a speed; where only the angle is logged, by its slope: that is where a free run starts."""
    if run.wheel_speed is not None or run.wheel_angle is None or len(run) < SHORTEST:
        return run
    return run.replace(wheel_speed=np.gradient(run.wheel_angle, run.t, axis=0))


def fit_rmse(fit: MotorFit, runs: Run | Sequence[Run]) -> float:
    """Root mean square error of the speed [rad/s] of free runs beside logs; NaN where none has a speed.

    Rows whose input the log does not resolve do not count.
    """
    every = [runs] if isinstance(runs, Run) else list(runs)
    kind = next(name for name, unit in INPUTS.items() if unit == fit.unit)
    errors = [
        (ours - run.wheel_speed[:, fit.motor])[~unresolved_rows(getattr(run, kind)[:, fit.motor])]
        for ours, run in zip(run_motor(fit, every), every, strict=True)
        if run.wheel_speed is not None
    ]  # fmt: skip
    known = np.concatenate(errors) if errors else np.zeros(0)
    known = known[np.isfinite(known)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else float("nan")
