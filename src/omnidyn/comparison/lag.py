"""How late a measured signal is behind the model: a hint at delays that neither the log nor the model knows of."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.comparison.traces import Trace
from omnidyn.compiled.parallel import small_matrices

LONGEST_LAG = 0.5  # [s] lags looked for, both signs
GRID, ROUNDS = 21, 4  # lags tried at a time; each round looks closer
WORTHWHILE_SHARE = 0.9  # a lag counts where it takes what the model leaves unexplained below this share


@small_matrices()
def lag_of(traces: Sequence[Trace]) -> float | None:
    """The delay d [s] at which measured(t) and model(t - d) correlate best, over all traces together.

    Positive: the robot (or its sensor) is later than the model. The correlation does not see gain and offset. 0 where
    no lag explains clearly more than none; None where a signal is constant, too short, or the best lag is out of reach.
    """
    usable = [trimmed for trace in traces if len((trimmed := _known(trace)).t) > 1]
    if not usable:
        return None
    reach = min(LONGEST_LAG, max(float(trace.t[-1] - trace.t[0]) for trace in usable) / 4.0)
    usual = float(np.median(np.concatenate([np.diff(trace.t) for trace in usable])))
    unshifted = unexplained(usable, 0.0)
    if unshifted is None:
        return None
    centre, width = 0.0, reach
    best = unshifted
    for _ in range(ROUNDS):
        lags = np.clip(np.linspace(centre - width, centre + width, GRID), -reach, reach)
        costs = [unexplained(usable, float(lag)) for lag in lags]
        scores = np.array([np.inf if score is None else score for score in costs])
        k = int(np.argmin(scores))
        centre, best, width = float(lags[k]), float(scores[k]), 2.0 * width / (GRID - 1)
    if best > WORTHWHILE_SHARE * unshifted or abs(centre) < 0.25 * usual:
        return 0.0
    return None if abs(centre) > 0.98 * reach else centre


def unexplained(traces: Sequence[Trace], lag: float) -> float | None:
    """1 - r^2 between measured(t) and model(t - lag); beyond its ends the model stays as it was there.

    None where one of the two never changes.
    """
    y = np.concatenate([trace.measured for trace in traces])
    m = np.concatenate([np.interp(trace.t - lag, trace.t, trace.model) for trace in traces])
    y, m = y - y.mean(), m - m.mean()
    power = float(y @ y) * float(m @ m)
    return None if power <= 0.0 else max(0.0, 1.0 - float(y @ m) ** 2 / power)


def _known(trace: Trace) -> Trace:
    """The rows that both have."""
    finite = np.isfinite(trace.measured) & np.isfinite(trace.model)
    return Trace(trace.t[finite], trace.measured[finite], trace.model[finite])
