"""How near a model comes to what was measured: one set of numbers per component of a channel.

Error e = model - measured; y measured, m model; sums over all samples that both have:

    rmse = sqrt(mean e^2)    max = max |e|    bias = mean e
    fit_percent = 100 (1 - |y - m| / |y - mean y|)        (Ljung, System Identification; MATLAB's compare)
    vaf = 100 (1 - var(y - m) / var y)                    forgives a constant offset, fit_percent does not
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import chdtrc

from omnidyn.arrays import FloatArray
from omnidyn.comparison.traces import Trace
from omnidyn.compiled.parallel import small_matrices
from omnidyn.statistics import block_length, bootstrap_error, t_quantile

CONSTANT = 1e-9  # a measured signal that changes by less than this share of its size is constant
SMALLEST_SQUARED = 1e-150  # what is smaller has no square


@dataclass(frozen=True)
class Metrics:
    """samples: compared. rmse, max, bias: in the SI unit of the component. fit_percent, vaf [%]: None where the
    measured signal never changes. whiteness: p-value of white errors, None where it cannot be tested.
    lag: how late the measured signal is behind the model [s], a hint; None where nothing can be said.
    """

    samples: int
    rmse: float
    max: float
    bias: float
    fit_percent: float | None
    vaf: float | None
    whiteness: float | None
    lag: float | None


METRICS = tuple(Metrics.__dataclass_fields__)


def metrics(
    traces: Sequence[Trace],
    errors: Sequence[FloatArray] | None = None,
    with_lag: bool = True,
    start_known: bool = False,
) -> Metrics | None:
    """The metrics over some traces together; None where measured and model share no sample.

    Means are over all samples of all traces. errors: those to test for whiteness, an array per trace; by default all.
    The lag takes longer than the rest and may be left out. start_known: the level of each trace was given to the model
    (a pose): fit and VAF count changes about the mean of each trace, not how far apart the traces are.
    """
    measured, model = both_known(traces)
    if not len(measured):
        return None
    error = model - measured
    levelled = both_known([_levelled(trace) for trace in traces]) if start_known else (measured, model)
    tested = whiteness([trace.error for trace in traces] if errors is None else errors)
    return Metrics(
        samples=len(error),
        rmse=float(np.sqrt(np.mean(error**2))),
        max=float(np.abs(error).max()),
        bias=float(error.mean()),
        fit_percent=fit_percent(*levelled),
        vaf=variance_accounted_for(*levelled),
        whiteness=None if tested is None else tested.p_value,
        lag=lag_of(traces) if with_lag else None,
    )


def both_known(traces: Sequence[Trace]) -> tuple[FloatArray, FloatArray]:
    """Measured and model of all samples that both have, one after the other. Shapes (n,)."""
    if not traces:
        return np.zeros(0), np.zeros(0)
    measured, model = (
        np.concatenate(parts) for parts in zip(*[(trace.measured, trace.model) for trace in traces], strict=True)
    )
    finite = np.isfinite(measured) & np.isfinite(model)
    return measured[finite], model[finite]


def _levelled(trace: Trace) -> Trace:
    """The trace about the mean of its measured values."""
    finite = np.isfinite(trace.error)
    mean = float(trace.measured[finite].mean()) if finite.any() else 0.0
    return Trace(trace.t, trace.measured - mean, trace.model - mean)


def fit_percent(measured: FloatArray, model: FloatArray) -> float | None:
    """100 (1 - |y - m| / |y - mean y|): 100 is perfect, 0 no better than the mean; None for a constant y."""
    if is_constant(measured):
        return None
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100.0 * (1.0 - float(np.linalg.norm(measured - model)) / spread)


def variance_accounted_for(measured: FloatArray, model: FloatArray) -> float | None:
    """100 (1 - var(y - m) / var y); None for a constant y."""
    return None if is_constant(measured) else 100.0 * (1.0 - float(np.var(measured - model) / np.var(measured)))


def is_constant(measured: FloatArray) -> bool:
    """Whether a measured signal never changes, but for rounding."""
    return float(np.ptp(measured)) <= max(CONSTANT * float(np.abs(measured).max()), SMALLEST_SQUARED)


# How late a measured signal is behind the model: a hint at delays that neither the log nor the model knows of

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


# Are the errors of a model white, that is noise without memory? If not, the model misses something that lasts

LAGS = 10
FEWEST_SAMPLES = 30  # samples


class Whiteness(NamedTuple):
    """p_value: chance that white errors look at least so unlike noise. correlation: at lags 1, 2, .. rows, shape
    (lags,). bound: what 95 % of white errors keep within at one lag, shape (lags,). statistic: chi-squared with as
    many degrees of freedom as lags.
    """

    p_value: float
    statistic: float
    correlation: FloatArray
    bound: FloatArray


def whiteness(errors: Sequence[FloatArray], lags: int = LAGS) -> Whiteness | None:
    """Test a model's errors for memory between rows; one array per piece, shape (n,), NaN where missing.

        Q = sum over lags k of (sum_i e_i e_(i+k))^2 / sum_i (e_i e_(i+k))^2  ~  chi-squared(lags)

    This is the statistic of Ljung & Box (1978) with each lag scaled by its own products instead of by the variance of
    all errors (Lobato, Nankervis & Savin 2001), so that noise that is louder in motion than at rest is not taken for
    memory. Pairs never reach across a gap and leave missing rows out. Lags are counted in rows: errors without memory
    are white at any spacing of the rows, so uneven sampling does not hurt; it only blurs what a lag means in seconds.
    The mean is taken off: a bias is reported as such. None for fewer than 30 samples, or errors that never change.
    """
    samples = np.concatenate([error[np.isfinite(error)] for error in errors] or [np.zeros(0)])
    lags = min(lags, len(samples) // 5)
    if len(samples) < FEWEST_SAMPLES or float(np.ptp(samples)) <= 1e-12 * float(np.abs(samples).max()):
        return None
    mean, power = samples.mean(), float(np.mean((samples - samples.mean()) ** 2))
    centred = [error - mean for error in errors]
    sums = [_products(centred, lag) for lag in range(1, lags + 1)]
    pairs, total, squares = (np.array(column) for column in zip(*sums, strict=True))
    if not (squares > 0.0).all():
        return None
    statistic = float(np.sum(total**2 / squares))
    return Whiteness(
        float(chdtrc(lags, statistic)), statistic, total / (pairs * power), 1.96 * np.sqrt(squares) / (pairs * power)
    )


def _products(errors: list[FloatArray], lag: int) -> tuple[int, float, float]:
    """Number, sum and sum of squares of e_i e_(i+lag) over all pairs that are there."""
    count, total, squares = 0, 0.0, 0.0
    for error in errors:
        products = error[lag:] * error[: max(0, len(error) - lag)]
        products = products[np.isfinite(products)]
        count, total, squares = count + len(products), total + products.sum(), squares + (products**2).sum()
    return count, float(total), float(squares)


# Which of two models is nearer to the robot, component by component, and whether that is more than chance
#
# The errors of a free run are not independent from row to row: standard errors come from a moving block bootstrap
# (Kunsch 1989), whose blocks are longer than the memory of the errors. No block reaches across a gap.

BOOTSTRAP_DRAWS = 400  # of the bootstrap
ALPHA = 0.05  # chance of calling any component better by noise, all components together
FEWEST_BLOCKS = 8  # blocks below which nothing can be told


@dataclass(frozen=True)
class ModelDifference:
    """rmse_difference: rmse of the first model minus that of the second, in the unit of the component; std_error: of
    that, None where there are too few independent stretches. better: 0 or 1 for the model that is surely better, None
    where chance could have done it. blocks: how many independent stretches the samples are worth.
    """

    rmse_difference: float
    std_error: float | None
    better: int | None
    blocks: int


def difference(
    first: Sequence[Trace], second: Sequence[Trace], tests: int = 1, seed: int = 0, whole: bool = False
) -> ModelDifference | None:
    """Compare two models a, b on the same measured traces y.

    With the midpoint m = (a + b)/2 and the gap g = a - b, the difference of the squared errors is 2 g (m - y): what
    decides is on which side of the midpoint y lies. The part of y - m along g is signal; what is left, n, is noise and
    what both models miss, and the standard error is that of mean(2 g n)/(rmse a + rmse b). The inputs of the logs are
    taken as given. tests: how many components are judged together; the level of each is ALPHA / tests (Bonferroni),
    with Student's t for the number of blocks. whole: every piece is one block, for a pose: what its start was off by
    stays in all of the piece and is one draw of chance. None where they share no sample.
    """
    parts = [rows for a, b in zip(first, second, strict=True) if len(rows := _midpoint_and_gap(a, b))]
    if not parts:
        return None
    error, apart = np.concatenate(parts).T
    rmse_a, rmse_b = (float(np.sqrt(np.mean((error + half * apart) ** 2))) for half in (0.5, -0.5))
    power = float(apart @ apart)
    if power == 0.0 or rmse_a + rmse_b == 0.0:
        return ModelDifference(0.0, 0.0, None, len(error))
    share = float(error @ apart) / power
    terms = [2.0 * part[:, 1] * (part[:, 0] - share * part[:, 1]) for part in parts]
    length = max(map(len, terms)) if whole else block_length(terms)
    blocks = sum(max(1, len(errors) // length) for errors in terms)
    gap = rmse_a - rmse_b
    if blocks < FEWEST_BLOCKS:
        return ModelDifference(gap, None, None, blocks)
    # the mean and the share were fitted to the blocks: two degrees of freedom
    loss = np.sqrt(blocks / (blocks - 2.0))
    spread = (
        loss * bootstrap_error(terms, length, blocks, BOOTSTRAP_DRAWS, np.random.default_rng(seed)) / (rmse_a + rmse_b)
    )
    margin = t_quantile(blocks - 2, 1.0 - 0.5 * ALPHA / tests) * spread
    return ModelDifference(gap, spread, (0 if gap < 0.0 else 1) if abs(gap) > margin else None, blocks)


def _midpoint_and_gap(first: Trace, second: Trace) -> FloatArray:
    """Error of the mean of two models, and first minus second, where all is known. Shape (n, 2)."""
    pairs = np.stack([0.5 * (first.error + second.error), first.error - second.error], axis=1)
    return pairs[np.isfinite(pairs).all(axis=1)]
