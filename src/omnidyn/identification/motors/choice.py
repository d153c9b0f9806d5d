"""Which way to fit a motor: by its error on logs left out, each in turn, of those that are fitted to and no others."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from typing import Any

import numpy as np

from omnidyn.errors import InsufficientDataError, OmnidynError
from omnidyn.identification.motors.between import CURVE, HOLD, MEAN
from omnidyn.identification.motors.estimate import MotorEstimate
from omnidyn.identification.motors.fit import fit_motor
from omnidyn.identification.motors.free_run import fit_rmse
from omnidyn.run import Run, as_list

TIE = 0.01  # relative difference of errors that does not pay for one more number
SHARES = 4  # parts in time of a single log

Way = Mapping[str, Any]  # options of fit_motor
Score = Callable[[MotorEstimate, Sequence[Run]], float]

WAYS = tuple(
    {"between": between, "latency": latency, "dead_band": dead_band}
    for dead_band, latency, between in product((False, True), (False, True), (HOLD, MEAN, CURVE))
)


@dataclass(frozen=True, eq=False)
class MotorChoice:
    """way: the options chosen; fit: with them, to all logs; errors: of every way on the logs left out, in the order
    tried, infinite where a fit without one of the logs was not possible.
    """

    way: Way
    fit: MotorEstimate
    errors: tuple[tuple[Way, float], ...]


def choose_motor(
    runs: Run | Sequence[Run], motor: int = 0, *, ways: Sequence[Way] = WAYS, score: Score = fit_rmse, **shared: Any
) -> MotorChoice:
    """Fit a motor in the way that best predicts logs left out, one after the other; a single log by parts in time.

    ways: options of `fit_motor`, simplest first: a later one must be better by TIE. score: error of a fit on runs, by
    default of the speed [rad/s]; combined as root mean square. shared: options that all ways have.
    Raises InsufficientDataError where no way could be tried, and what `fit_motor` raises.
    """
    every = as_list(runs)
    errors = tuple((way, _left_out(every, motor, score, {**shared, **way})) for way in ways)
    best: tuple[Way, float] | None = None
    for way, error in errors:
        if np.isfinite(error) and (best is None or error < (1.0 - TIE) * best[1]):
            best = way, error
    if best is None:
        raise InsufficientDataError(
            "no log can be predicted from the others", got=f"{len(every)} logs", expected="more, or longer ones"
        )
    return MotorChoice(best[0], fit_motor(every, motor, **{**shared, **best[0]}), errors)


def is_late(runs: Run | Sequence[Run], motor: int = 0, **shared: Any) -> bool:
    """Whether logs show that speed or angle of a motor were recorded late: an interval of a latency without 0."""
    try:
        fit = fit_motor(runs, motor, dead_band=False, latency=True, **shared)
    except OmnidynError:
        return False
    found = (fit.ci95[name] for name in fit.late if name not in fit.unidentifiable)
    return fit.converged and any(low > 0.0 or high < 0.0 for low, high in found)


def _left_out(runs: Sequence[Run], motor: int, score: Score, how: Mapping[str, Any]) -> float:
    errors = []
    for kept, out in _folds(runs):
        try:
            errors.append(score(fit_motor(kept, motor, **how), [out]))
        except OmnidynError:
            return float("inf")
    return float(np.sqrt(np.mean(np.square(errors))))


def _folds(runs: Sequence[Run]) -> Iterator[tuple[list[Run], Run]]:
    """(logs kept, the one left out)."""
    parts = list(runs)
    if len(runs) == 1:
        edges = np.linspace(0, len(runs[0]), SHARES + 1).astype(int)
        parts = [_rows(runs[0], slice(int(a), int(b))) for a, b in pairwise(edges)]
    for k, out in enumerate(parts):
        yield [*parts[:k], *parts[k + 1 :]], out


def _rows(run: Run, rows: slice) -> Run:
    return run.replace(t=run.t[rows], **{name: values[rows] for name, values in run.channels.items()})
