"""Where a log has gaps: no one may integrate, difference or average across one."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.statistics import median

GAP = 3.5  # a step so many times the usual one is a gap: three samples or more are lost


def segments(t: FloatArray, gap: float = GAP, usual: float | None = None) -> list[slice]:
    """The segments of a log, which lie between its gaps, in order. t [s], shape (n,), increasing.

    A gap is a step longer than `gap` times the usual step, and than twice the step that 95 % of all stay below:
    a log on change has long steps without a gap. usual: the median step by default; `Run.step` of a run, whose rows
    may be those of many sensors.
    """
    if len(t) < 3:
        return [slice(0, len(t))]
    steps = np.diff(t)
    long = gap * (median(steps) if usual is None else usual)
    if not (steps > long).any():
        return [slice(0, len(t))]
    limit = max(long, 2.0 * float(np.quantile(steps, 0.95)))
    cuts = np.flatnonzero(steps > limit) + 1
    return [slice(int(a), int(b)) for a, b in zip([0, *cuts], [*cuts, len(t)], strict=True)]


def filled(t: FloatArray, values: FloatArray) -> FloatArray:
    """Each blank between two values on the line between them; outside, and in a gap between values, there is none."""
    result, sample_rows = values.copy(), np.flatnonzero(np.isfinite(values))
    for segment in segments(t[sample_rows]):
        rows = sample_rows[segment]
        if rows.size:
            result[rows[0] : rows[-1] + 1] = np.interp(t[rows[0] : rows[-1] + 1], t[rows], values[rows])
    return result
