"""The march of march_sums.py for the most common fit, ten times as fast: friction of the axes from measured twists.

Nothing but the rate a, the level c and the start of an axis changes there, and each axis moves for itself: three
slopes in registers instead of rows.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel
from omnidyn.identification.output_error.kernel.march_sums import FINAL, STEP_TOLERANCE, loss_terms
from omnidyn.simulation.exact.slopes import hold_slopes, step_slopes

SLOPE_COUNT = 3  # slopes: by a, by c, by the speed at the start
# Where the sums stand in the row that a march fills; the pairs of `info` are aa, ac, av, cc, cv, vv.
NUMBER, SQUARE, LOSS, LAG, GRAD, INFO, SIZE = 0, 1, 2, 3, 4, 7, 13


@kernel
def march_axis(t, u, y, axis, first, last, drive, rate, coulomb, hold, start, variance, nu, block, mode, sums, scores):
    """Add to `sums` (SIZE,) what column `axis` of y says, over rows first..last. Arguments as in march_sums.py.

    scores (blocks, SLOPE_COUNT + 1), filled in a final march: by a, by c, by the start, and
    the drift. drive (W,): acceleration per volt of this axis; rate, coulomb, hold, start: of this axis.
    """
    final, wheels = (mode & FINAL) != 0, u.shape[1]
    v, va, vc, vs = start, 0.0, 0.0, 1.0
    phi = dphi = length = value_before = 0.0
    count = square = total = lag = ga = gc = gs = 0.0
    aa = ac = as_ = cc = cs = ss = 0.0
    for k in range(first, last + 1):
        residual = y[k, axis] - v
        if residual == residual:
            pull, pull_change, curvature, rho = loss_terms(residual, variance, nu, final)
            count += 1.0
            square += pull_change
            total += rho
            lag += pull * value_before
            value_before = pull
            ga += pull * va
            gc += pull * vc
            gs += pull * vs
            ha, hc = curvature * va, curvature * vc
            aa += ha * va
            ac += ha * vc
            as_ += ha * vs
            cc += hc * vc
            cs += hc * vs
            ss += curvature * vs * vs
            if final:
                score = scores[(k - first) // block]
                score[0] += pull / variance * va
                score[1] += pull / variance * vc
                score[2] += pull / variance * vs
                score[3] += pull
        else:
            value_before = 0.0
        if k == last:
            break
        g = 0.0
        for w in range(wheels):
            g += drive[w] * u[k, w]
        dt = t[k + 1] - t[k]
        dt_error = dt - length
        if abs(dt_error) * rate > STEP_TOLERANCE or length == 0.0:
            phi, dphi, _, _ = hold_slopes(rate, dt)
            length, dt_error = dt, 0.0
        decay = 1.0 - rate * phi
        v, kv, _, kc, ka = step_slopes(
            v, g, coulomb, hold, rate, phi + dt_error * decay, dphi - dt_error * (phi + rate * dphi)
        )
        va = kv * va + ka
        vc = kv * vc + kc
        vs = kv * vs
    sums[NUMBER] += count
    sums[SQUARE] += square
    sums[LOSS] += total
    sums[LAG] += lag
    sums[GRAD] += ga
    sums[GRAD + 1] += gc
    sums[GRAD + 2] += gs
    sums[INFO] += aa
    sums[INFO + 1] += ac
    sums[INFO + 2] += as_
    sums[INFO + 3] += cc
    sums[INFO + 4] += cs
    sums[INFO + 5] += ss


def spread(row: FloatArray, slopes: FloatArray) -> FloatArray:
    """`info` of a row of sums in the parameters that `slopes` (SLOPE_COUNT, P) leads to. Shape (P, P)."""
    aa, ac, av, cc, cv, vv = row[INFO:]
    return slopes.T @ np.array([[aa, ac, av], [ac, cc, cv], [av, cv, vv]]) @ slopes
