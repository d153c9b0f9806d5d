"""When a motor leaves rest, or comes to rest: the instants t0 that its speed, noise and lag allow.

A start, at rest until t0, driven by what the input u is above the friction c from there on, u0 = u(t0) >= c:

    lag w' + w = g (u - c),   w(t0) = 0:   w = g F(u - u0) + q F(1),   g >= 0, q = g (u0 - c) >= 0

with F the first-order lag from t0 on, of an input that is held from row to row. A stop is the same law before t0,
from any speed w1 at the first row, with w(t0) = 0, at rest from there on:

    w = g F(u) + h F(1) + w1 exp(-(t - t_first)/lag)

For every t0 the numbers g, q or g, h, w1 and the lag are those of least squares. The interval holds all t0 whose
sum of squares is not above the least by more than t^2 s^2 (the profile of the likelihood). No threshold on the
speed comes in, so a motor that creeps off out of the noise is not said to start late.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray
from omnidyn.statistics import t_quantile

NUMBERS = 3  # fitted beside t0, the lag among them


def edge_interval(
    t: FloatArray,
    input_values: FloatArray,
    speed: FloatArray,
    tries: FloatArray,
    *,
    lags: Sequence[float],
    stop: bool,
    least_std: float,
    risk: float,
) -> tuple[float, float]:
    """(first, last) instant [s] at which the motor may have started, or stopped, but for a share `risk`.

    t [s], input_values, speed [rad/s]: the rows around it, signed so that the motion is forward. Shape (rows,).
    tries [s]: instants that are tried, shape (n,). lags [s]: tried. least_std [rad/s]: of the speed, as a sensor that
    reads in steps has it at least.
    """
    squares_left = np.array(
        [min(_left(t, input_values, speed, instant, lag, stop) for lag in lags) for instant in tries]
    )
    freedom = max(len(t) - NUMBERS - 1, 1)
    variance = max(float(squares_left.min()) / freedom, least_std**2)
    allowed_instants = tries[squares_left <= squares_left.min() + t_quantile(freedom, 1.0 - 0.5 * risk) ** 2 * variance]
    return float(allowed_instants[0]), float(allowed_instants[-1])


def _left(t: FloatArray, input_values: FloatArray, speed: FloatArray, instant: float, lag: float, stop: bool) -> float:
    """Least sum of squares with the edge at one instant."""
    moving = t < instant if stop else t > instant
    resting = float(speed[~moving] @ speed[~moving])
    if not moving.any():
        return resting
    return resting + (_stop_left if stop else _start_left)(t, input_values, speed, instant, lag, moving)


def _start_left(
    t: FloatArray, input_values: FloatArray, speed: FloatArray, instant: float, lag: float, moving: BoolArray
) -> float:
    """Least sum of squares of the rows after a start."""
    input_change = input_values - input_values[max(int(np.searchsorted(t, instant, "right")) - 1, 0)]
    weight = _lagged(t[moving], t, instant, lag)
    return _not_negative(np.stack([weight @ input_change[:-1], weight.sum(axis=1)], axis=1), speed[moving])


def _stop_left(
    t: FloatArray, input_values: FloatArray, speed: FloatArray, instant: float, lag: float, moving: BoolArray
) -> float:
    """Least sum of squares of the rows before a stop."""
    weight = _lagged(np.append(t[moving], instant), t, float(t[0]), lag)
    decay = np.exp(-(np.append(t[moving], instant) - t[0]) / lag)
    table = np.stack([weight @ input_values[:-1], weight.sum(axis=1), decay], axis=1)
    size = np.sqrt((table**2).sum(axis=0)) + 1e-300
    table = table / size
    # two directions in which the speed at the stop stays 0
    free = np.linalg.svd(table[-1:])[2][1:].T
    design, measured = table[:-1] @ free, speed[moving]
    remaining = measured - design @ np.linalg.lstsq(design, measured, rcond=1e-9)[0]
    return float(remaining @ remaining)


def _lagged(instants: FloatArray, t: FloatArray, start_time: float, lag: float) -> FloatArray:
    """What each row of a held input adds to a first-order lag from `start_time` on. Shape (len(instants), len(t) -
    1)."""
    first = np.minimum(np.maximum(t[:-1], start_time), instants[:, None])
    last = np.minimum(np.maximum(t[1:], start_time), instants[:, None])
    return np.exp(-(instants[:, None] - last) / lag) - np.exp(-(instants[:, None] - first) / lag)


def _not_negative(design: FloatArray, speed: FloatArray) -> float:
    """Least sum of squares with two numbers, neither below 0."""
    products, right = design.T @ design, design.T @ speed
    total = float(speed @ speed)
    best = min(total - max(right[k], 0.0) ** 2 / products[k, k] if products[k, k] > 0.0 else total for k in (0, 1))
    determinant = products[0, 0] * products[1, 1] - products[0, 1] ** 2
    if determinant > 1e-12 * products[0, 0] * products[1, 1]:
        first_number = (products[1, 1] * right[0] - products[0, 1] * right[1]) / determinant
        second_number = (products[0, 0] * right[1] - products[0, 1] * right[0]) / determinant
        if first_number >= 0.0 and second_number >= 0.0:
            best = total - first_number * right[0] - second_number * right[1]
    return max(float(best), 0.0)
