"""The options of a fit that best predict logs left out, each in turn."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InsufficientDataError, OmnidynError
from omnidyn.identification.methods import AUTO
from omnidyn.identification.motors.choice import BLOCKS, SHARES, Score, block_errors, fit_rmse, parts_of
from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.fit import MotorFits, fit_motor, fit_ways
from omnidyn.identification.motors.input_between_rows import CURVE, HOLD, MEAN
from omnidyn.identification.selection.blocks import BlockComparison, compare_blocks
from omnidyn.run import Run, as_list

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
