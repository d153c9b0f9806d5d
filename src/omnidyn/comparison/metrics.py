"""How near a model comes to what was measured: one set of numbers per component of a channel.

Error e = model - measured; y measured, m model; sums over all samples that both have:

    rmse = sqrt(mean e^2)    max = max |e|    bias = mean e
    fit_percent = 100 (1 - |y - m| / |y - mean y|)        (Ljung, System Identification; MATLAB's compare)
    vaf = 100 (1 - var(y - m) / var y)                    forgives a constant offset, fit_percent does not
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.comparison.lag import lag_of
from omnidyn.comparison.traces import Trace
from omnidyn.comparison.whiteness import whiteness

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
