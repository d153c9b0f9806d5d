"""When a motor leaves rest, or comes to rest: the instants t0 that its speed, noise and lag allow.

A start, at rest until t0, driven by what the input u is above the friction c from there on, u0 = u(t0) >= c:

    lag w' + w = g (u - c),   w(t0) = 0:   w = g F(u - u0) + q F(1),   g >= 0, q = g (u0 - c) >= 0

with F the first-order lag from t0 on, of an input that is held from row to row. A stop is the same law before t0, from
any speed w1 at the first row, with w(t0) = 0, at rest from there on:

    w = g F(u) + h F(1) + w1 exp(-(t - t_first)/lag)

For every t0 the numbers g, q or g, h, w1 and the lag are those of least squares. The interval holds all t0 whose sum of
squares is not above the least by more than t^2 s^2 (the profile of the likelihood). No threshold on the speed comes
in, so a motor that creeps off out of the noise is not said to start late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.statistics import t_quantile

NUMBERS = 3  # fitted beside t0, the lag among them


def edge_interval(
    t: FloatArray, put_in: FloatArray, speed: FloatArray, tries: FloatArray, *, lags: Sequence[float], stop: bool,
    least_std: float, risk: float,
) -> tuple[float, float]:  # fmt: skip
    """(first, last) instant [s] at which the motor may have started, or stopped, but for a share `risk`.

    t [s], put_in, speed [rad/s]: the rows around it, signed so that the motion is forward. Shape (rows,).
    tries [s]: instants that are tried, shape (n,). lags [s]: tried. least_std [rad/s]: of the speed, as a sensor that
    reads in steps has it at least.
    """
    left = np.array([min(_left(t, put_in, speed, at, lag, stop) for lag in lags) for at in tries])
    freedom = max(len(t) - NUMBERS - 1, 1)
    variance = max(float(left.min()) / freedom, least_std**2)
    allowed = tries[left <= left.min() + t_quantile(freedom, 1.0 - 0.5 * risk) ** 2 * variance]
    return float(allowed[0]), float(allowed[-1])


def _left(t: FloatArray, put_in: FloatArray, speed: FloatArray, at: float, lag: float, stop: bool) -> float:
    """Least sum of squares with the edge at one instant."""
    moving = t < at if stop else t > at
    resting = float(speed[~moving] @ speed[~moving])
    if not moving.any():
        return resting
    return resting + (_stop_left if stop else _start_left)(t, put_in, speed, at, lag, moving)


def _start_left(
    t: FloatArray, put_in: FloatArray, speed: FloatArray, at: float, lag: float, moving: BoolArray
) -> float:
    """Least sum of squares of the rows after a start."""
    above = put_in - put_in[max(int(np.searchsorted(t, at, "right")) - 1, 0)]
    weight = _lagged(t[moving], t, at, lag)
    return _not_negative(np.stack([weight @ above[:-1], weight.sum(axis=1)], axis=1), speed[moving])


def _stop_left(t: FloatArray, put_in: FloatArray, speed: FloatArray, at: float, lag: float, moving: BoolArray) -> float:
    """Least sum of squares of the rows before a stop."""
    weight = _lagged(np.append(t[moving], at), t, float(t[0]), lag)
    decay = np.exp(-(np.append(t[moving], at) - t[0]) / lag)
    table = np.stack([weight @ put_in[:-1], weight.sum(axis=1), decay], axis=1)
    size = np.sqrt((table**2).sum(axis=0)) + 1e-300
    table = table / size
    # two directions in which the speed at the stop stays 0
    free = np.linalg.svd(table[-1:])[2][1:].T
    design, own = table[:-1] @ free, speed[moving]
    rest = own - design @ np.linalg.lstsq(design, own, rcond=1e-9)[0]
    return float(rest @ rest)


def _lagged(at: FloatArray, t: FloatArray, begin: float, lag: float) -> FloatArray:
    """What each row of a held input adds to a first-order lag from `begin` on. Shape (len(at), len(t) - 1)."""
    first = np.minimum(np.maximum(t[:-1], begin), at[:, None])
    last = np.minimum(np.maximum(t[1:], begin), at[:, None])
    return np.exp(-(at[:, None] - last) / lag) - np.exp(-(at[:, None] - first) / lag)


def _not_negative(design: FloatArray, speed: FloatArray) -> float:
    """Least sum of squares with two numbers, neither below 0."""
    inner, right = design.T @ design, design.T @ speed
    total = float(speed @ speed)
    best = min(total - max(right[k], 0.0) ** 2 / inner[k, k] if inner[k, k] > 0.0 else total for k in (0, 1))
    determinant = inner[0, 0] * inner[1, 1] - inner[0, 1] ** 2
    if determinant > 1e-12 * inner[0, 0] * inner[1, 1]:
        one = (inner[1, 1] * right[0] - inner[0, 1] * right[1]) / determinant
        other = (inner[0, 0] * right[1] - inner[0, 1] * right[0]) / determinant
        if one >= 0.0 and other >= 0.0:
            best = total - one * right[0] - other * right[1]
    return max(float(best), 0.0)
