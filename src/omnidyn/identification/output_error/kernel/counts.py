"""The likelihood of a counted angle: an encoder tells only between which two ticks the angle was.

    P(y) = Phi((r + q/2)/s) - Phi((r - q/2)/s),    r = y - f,  q the tick, s the noise before the encoder rounds

f is the model's angle with a free start, so that it does not matter whether the encoder rounds down or to the nearest.
In units of s, with x the noise that the row allows, a normal number cut to [z - h, z + h], z = r/s, h = q/(2 s):

    -d log P/dr = E x/s        -d2 log P/dr2 = (1 - var x)/s^2        d log P/d log s = E x^2 - 1

All positive curvatures: the loss is convex in f. For h -> 0 it is Gauss's; rho leaves out log(2 h) for that reason.
"""

from __future__ import annotations

import math

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, part

LEAST_SHARE = 0.1  # of a tick that the noise has at least: below it only rows beside an edge of a tick would count
_CONSTANT = 0.5 * math.log(2.0 * math.pi)
_DENSITY = 1.0 / math.sqrt(2.0 * math.pi)
_NARROW = 1.0  # h max(|z|, 1) up to which the interval is integrated by nodes; beyond, tails do not cancel
_FAR = 5.0  # standard deviations from which the tail is a continued fraction
_TERMS = 40
_NODES = tuple((node, weight / 2.0) for node, weight in zip(*np.polynomial.legendre.leggauss(10), strict=True))
_REACH, _STEPS = 9.0, 600  # of the integral over all phases
HARMONICS = 64  # of the pull of a row without noise: less than 4 % of its square is in those beyond


@part
def tail(u):
    """exp(u^2/2) P(x > u) of a normal number; at least 1e-16 relative for u > -_FAR."""
    if u < _FAR:
        return 0.5 * math.erfc(u / math.sqrt(2.0)) * math.exp(0.5 * u * u)
    fraction = u
    for k in range(_TERMS, 0, -1):
        fraction = u + k / fraction
    return _DENSITY / fraction


@part
def count_terms(z, h):
    """(E x, E x^2, var x, rho) of a normal number x cut to [z - h, z + h]: rho = -log P + log(2 h) - const. h > 0.

    P is the probability of the interval; the constant makes rho = z^2/2 for h -> 0. Source: truncated normal numbers.
    """
    size = abs(z)
    if h * max(size, 1.0) <= _NARROW:
        total = first = second = 0.0
        for node, weight in _NODES:
            t = h * node
            share = weight * math.exp(-size * t - 0.5 * t * t)
            total += share
            first += share * t
            second += share * t * t
        first, second = first / total, second / total
        mean, spread = size + first, second - first * first
        rho = 0.5 * size * size - math.log(total)
    elif size - h > 0.0:
        low, high = size - h, size + h
        fall = math.exp(-2.0 * size * h)
        total = tail(low) - fall * tail(high)
        mean = _DENSITY * (1.0 - fall) / total
        spread = 1.0 + _DENSITY * (low - fall * high) / total - mean * mean
        rho = 0.5 * low * low - math.log(total / (2.0 * h)) - _CONSTANT
    else:
        low, high = size - h, size + h
        total = 0.5 * (math.erf(high / math.sqrt(2.0)) - math.erf(low / math.sqrt(2.0)))
        left_density, right = _DENSITY * math.exp(-0.5 * low * low), _DENSITY * math.exp(-0.5 * high * high)
        mean = (left_density - right) / total
        spread = 1.0 + (low * left_density - high * right) / total - mean * mean
        rho = -math.log(total / (2.0 * h)) - _CONSTANT
    spread = min(max(spread, 0.0), 1.0)
    return (-mean if z < 0.0 else mean), mean * mean + spread, spread, rho


@kernel
def phase_means(h, reach, steps):
    """(E (E x)^2, E (E x^2 - 1)^2) over all rows: Fisher's information of a row, of f in 1/s^2, of log s; h = q/(2 s).

    The phase of the angle among the ticks is even, the noise normal. 1 and 2 for h -> 0.
    """
    angle = scale = 0.0
    step = 2.0 * (reach + h) / steps
    for k in range(steps):
        z = -(reach + h) + (k + 0.5) * step
        mean, square, _, rho = count_terms(z, h)
        weight = step * math.exp(-rho) * _DENSITY
        angle += weight * mean * mean
        scale += weight * (square - 1.0) ** 2
    return angle, scale


@kernel
def rounding(h, count, steps):
    """(b (count,), E (E x)^2, E (1 - var x)) of rows without noise, their phases even among the ticks; h = q/(2 s).

    b: of the series E x = sum b_m sin(2 pi m r/q) of a row's pull, which is odd in r and has the period q. s: what the
    fit takes for the noise.
    """
    series, square, curvature = np.zeros(count), 0.0, 0.0
    for k in range(steps):
        turn = (k + 0.5) / steps - 0.5
        mean, _, spread, _ = count_terms(2.0 * h * turn, h)
        square += mean * mean / steps
        curvature += (1.0 - spread) / steps
        for m in range(count):
            series[m] += 2.0 * mean * math.sin(2.0 * math.pi * (m + 1) * turn) / steps
    return series, square, curvature


def information(variance: FloatArray, tick: FloatArray) -> FloatArray:
    """Fisher's information of one row: of f in units of 1/variance, and of log s; (1, 2) where tick is 0.

    variance [rad^2], tick [rad], shape (C,). Result: shape (2, C).
    """
    values = np.tile([[1.0], [2.0]], (1, len(tick)))
    for c in np.flatnonzero(tick > 0.0):
        values[:, c] = phase_means(0.5 * tick[c] / math.sqrt(variance[c]), _REACH, _STEPS)
    return values
