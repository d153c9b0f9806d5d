"""A run in the rows of one of its sensors: for what compares channels row by row, or holds inputs over a row."""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.clocks import samples, usual_step
from omnidyn.logs.segments import GAP
from omnidyn.run import Run
from omnidyn.sensors import OF_WHEELS, SENSORS


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
    return on_clock_of(run, next((name for name in OF_WHEELS if getattr(run, name) is not None), OF_WHEELS[0]))


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
    integral = np.vstack([np.zeros(columns.shape[1]), np.cumsum(columns[:-1] * np.diff(t)[:, None], axis=0)])
    result = np.empty((len(at), columns.shape[1]))
    for k, column in enumerate(columns.T):
        changes = np.append(0, np.cumsum((column[1:] != column[:-1]) & np.isfinite(column[:-1])))
        means = (np.interp(ends, t, integral[:, k]) - np.interp(at, t, integral[:, k])) / (ends - at)
        plain = (changes[last] - changes[first] < 2) | ~np.isfinite(means)
        result[:, k] = np.where(plain, column[middle], means)
    return result if values.ndim == 2 else result[:, 0]
