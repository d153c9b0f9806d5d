"""Where a log has gaps: no one may integrate, difference or average across one."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import samples, usual_step
from omnidyn.run import SENSORS, Run
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


# A run in the rows of one of its sensors: for what compares channels row by row, or holds inputs over a row


def on_clock_of(run: Run, channel: str) -> Run:
    """The run in the rows in which a channel was sampled; as it is where its sensors share their stamps.

    Inputs are what held longest in a row, means where they change more often; what other sensors gave is on the line
    between two of their samples.
    """
    values = getattr(run, channel)
    if values is None or not run.staggered:
        return run
    clock = max((samples(run.t, column)[0] for column in values.reshape(len(run), -1).T), key=len)
    if len(clock) < 2:
        return run
    channels = {
        name: _on_line(run.t, values, clock) if name in SENSORS else _held(run.t, values, clock)
        for name, values in run.channels.items()
    }
    return run.replace(t=clock, **channels)


def on_clock_of_wheels(run: Run) -> Run:
    """The same in the rows in which the wheels were sampled: their speed, else their angle."""
    return on_clock_of(run, "wheel_speed" if run.wheel_speed is not None else "wheel_angle")


def _on_line(t: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """What a sensor gave at some times, on the line between its samples; NaN outside of them and in their gaps."""
    result = np.full((len(at), values.shape[1]), np.nan)
    for k, column in enumerate(values.T):
        times, measured = samples(t, column)
        if len(times) < 2:
            continue
        after = np.clip(np.searchsorted(times, at), 1, len(times) - 1)
        covered = (at >= times[0]) & (at <= times[-1]) & (times[after] - times[after - 1] <= GAP * usual_step(times))
        result[covered, k] = np.interp(at[covered], times, measured)
    return result


def _held(t: FloatArray, values: FloatArray, at: FloatArray) -> FloatArray:
    """An input from each of some times to the next: what holds longer, and its mean where it changes more than once."""
    columns = values.reshape(len(t), -1)
    ends = np.append(at[1:], at[-1] + usual_step(at))
    first, middle, last = (
        np.maximum(np.searchsorted(t, moment, side="right") - 1, 0)
        for moment in (at, 0.5 * (at + ends), np.nextafter(ends, 0.0))
    )
    way = np.vstack([np.zeros(columns.shape[1]), np.cumsum(columns[:-1] * np.diff(t)[:, None], axis=0)])
    result = np.empty((len(at), columns.shape[1]))
    for k, column in enumerate(columns.T):
        changes = np.append(0, np.cumsum((column[1:] != column[:-1]) & np.isfinite(column[:-1])))
        means = (np.interp(ends, t, way[:, k]) - np.interp(at, t, way[:, k])) / (ends - at)
        plain = (changes[last] - changes[first] < 2) | ~np.isfinite(means)
        result[:, k] = np.where(plain, column[middle], means)
    return result if values.ndim == 2 else result[:, 0]
