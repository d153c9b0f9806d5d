"""Clocks: commands that take time to reach the motors, and channels that show what was. Times of a simulation,
refined.

A command of row k that is `latency` late acts over [t_k + latency, t_k+1 + latency), and a channel that is `late`
shows at t_k what was at t_k - late. Both are exact: the simulation takes steps that end at these times too. Before
the start nothing is known: a channel shows the start, and what acted before the first command is what `before` says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.arrays import FloatArray

SAME_TIME = 1e-9  # of a row: times that are nearer are one


@dataclass(frozen=True, eq=False)
class StepGrid:
    """dt [s]: steps of the simulation, shape (steps,). row: which command acts over each, -1 before the first.

    at: for every lateness asked for, the samples of the simulation that a channel shows at each row, shape (rows + 1,).
    """

    dt: FloatArray
    row: NDArray[np.intp]
    at: tuple[NDArray[np.intp], ...]


def clock(dt: FloatArray, latency: float = 0.0, late: Sequence[float] = (0.0,)) -> StepGrid:
    """The steps of a simulation of rows `dt` [s], shape (rows,), where commands are `latency` [s] late.

    late [s]: of the channels. One that is early, below 0, is shown beyond the last row, where the last command still
    holds.
    """
    rows = len(dt)
    if latency == 0.0 and not any(late):
        return StepGrid(dt, np.arange(rows), (np.arange(rows + 1),) * len(late))
    edges = np.concatenate([[0.0], np.cumsum(dt)])
    end = edges[-1] + max(0.0, -min(late))
    acts = edges[:-1] + latency
    sample_times = [np.clip(edges - delay, 0.0, end) for delay in late]
    times = np.unique(np.concatenate([edges, acts[acts < end], *sample_times]))
    resolution = SAME_TIME * float(np.min(dt))
    times = times[np.concatenate([[True], np.diff(times) > resolution])]
    row = np.searchsorted(acts, 0.5 * (times[1:] + times[:-1]), side="right") - 1
    return StepGrid(np.diff(times), row, tuple(_nearest(times, moments) for moments in sample_times))


def _nearest(times: FloatArray, targets: FloatArray) -> NDArray[np.intp]:
    """Where the time nearest to each of `targets` stands."""
    after = np.clip(np.searchsorted(times, targets), 1, len(times) - 1)
    return np.where(targets - times[after - 1] <= times[after] - targets, after - 1, after)
