"""Which way to fit a motor: by its error on logs left out, each in turn, of those that are fitted to and no others."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InsufficientDataError, OmnidynError
from omnidyn.identification.methods import AUTO
from omnidyn.identification.motors.estimate import BAND, OFFSET, MotorEstimate
from omnidyn.identification.motors.fit import MotorFits, fit_motor, fit_ways, logs_of_free_runs
from omnidyn.identification.motors.log import CURVE, HOLD, MEAN, SUB
from omnidyn.identification.motors.problem import SPEED, motor_problem, motor_record
from omnidyn.identification.output_error.problem.record import SHORTEST
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
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


# ---- the way that best predicts logs left out

Options = Mapping[str, Any]  # options of fit_motor

WAYS = tuple(
    {"between": between, "latency": latency, "dead_band": dead_band}
    for dead_band, latency, between in product((False, True), (False, True), (HOLD, MEAN, CURVE))
)


@dataclass(frozen=True, eq=False)
class MotorChoice:
    """options: those chosen; fit: with them, to all logs; errors: of every way on the logs left out, in the order
    tried, infinite where a fit without one of the logs was not possible. comparison: with the simplest of them, of
    blocks of the logs left out; None where it is that.
    """

    options: Options
    fit: MotorEstimate
    errors: tuple[tuple[Options, float], ...]
    comparison: BlockComparison | None = None


def choose_motor(
    runs: Run | Sequence[Run], motor: int = 0, *, ways: Sequence[Options] = WAYS, score: Score = fit_rmse, **shared: Any
) -> MotorChoice:
    """Fit a motor in the way that best predicts logs left out, one after the other; a single log by parts in time.

    ways: options of `fit_motor`, simplest first: a later one must predict blocks of the logs left out better
    (`compare_blocks`). score: error of a fit on runs, by default of the speed [rad/s]; combined as root mean square.
    shared: options that all ways have.
    Raises InsufficientDataError where no way could be tried, and what `fit_motor` raises.
    """
    logs = as_list(runs)
    left_out = _LeftOut(logs, motor, score)
    tried = [(options, *left_out.errors({**shared, **options})) for options in ways]
    possible = [(options, blocks) for options, error, blocks in tried if np.isfinite(error)]
    if not possible:
        raise InsufficientDataError(
            "no log can be predicted from the others", got=f"{len(logs)} logs", expected="more, or longer ones"
        )
    simplest = best = possible[0]
    for candidate in possible[1:]:
        if compare_blocks(best[1], candidate[1]).is_better:
            best = candidate
    comparison = None if best is simplest else compare_blocks(simplest[1], best[1])
    fit = fit_motor(logs, motor, **{**shared, **best[0]})
    return MotorChoice(best[0], fit, tuple((options, error) for options, error, _ in tried), comparison)


class _LeftOut:
    """Errors on logs left out. Ways that follow one another and differ in `between` alone share their fits."""

    def __init__(self, runs: Sequence[Run], motor: int, score: Score):
        self.folds, self.motor, self.score = list(_folds(runs)), motor, score
        self.options: Mapping[str, Any] | None = None
        self.fits: list[MotorFits] = []

    def errors(self, fit_options: Mapping[str, Any]) -> tuple[float, FloatArray]:
        """(root mean square of the scores of all folds, infinite where a fit was not possible; squared, of blocks)."""
        options = {name: value for name, value in fit_options.items() if name != "between"}
        between = fit_options.get("between", AUTO)
        try:
            if options != self.options:
                self.options, self.fits = options, []
                self.fits = [fit_ways(fitted_runs, self.motor, **options) for fitted_runs, _ in self.folds]
            if not self.fits:  # the fit before, with the same options, was not possible
                return float("inf"), np.zeros(0)
            estimates = [fits.estimate(between) for fits in self.fits]
            left_out = [run for _, run in self.folds]
            errors = [self.score(fit, [run]) for fit, run in zip(estimates, left_out, strict=True)]
        except OmnidynError:
            return float("inf"), np.zeros(0)
        count = -(-BLOCKS // len(left_out))
        blocks = [block_errors(fit, [run], self.score, count) for fit, run in zip(estimates, left_out, strict=True)]
        return float(np.sqrt(np.mean(np.square(errors)))), np.concatenate(blocks)


def _folds(runs: Sequence[Run]) -> Iterator[tuple[list[Run], Run]]:
    """(logs kept, the one left out)."""
    parts = parts_of(runs[0], SHARES) if len(runs) == 1 else list(runs)
    for k, left_out_run in enumerate(parts):
        yield [*parts[:k], *parts[k + 1 :]], left_out_run
