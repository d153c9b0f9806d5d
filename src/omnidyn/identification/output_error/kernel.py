"""One march of the exact step through a piece of a log, with its sensitivities: what a fit needs to know of the log.

Along the way grow, for every column c of the outputs, with r = y - f(p), J = df/dp and a weight w of the loss:

    count  n      square  sum w r^2      loss  sum rho(r)      lag  sum w r w' r' of neighbours
    grad  sum w r J                      info  sum w J J'

and, in a final march, for every block of rows: score, the sum of w r J/variance over all columns, and drift, the sum of
w r of each column. Nothing is kept of the samples, so that memory does not grow with the log. Rows of J are padded to a
multiple of 4 with zeros: the loops become the short vectors of the processor.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from omnidyn.compiled import kernel, part
from omnidyn.simulation.exact_sensitivity import acceleration_at_end, hold_slopes, step_slopes, travel_slopes

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

GAIN, DEAD, FADE = 0, 1, 2  # numbers of the driver
SAME = 1e-7  # times 1/a [s]: steps that differ by less share one exponential, to first order, which leaves 1e-15
FINAL, KEEP = 1, 2  # what a march is for, beside the sums


class Physics(NamedTuple):
    """Numbers of the model. Axes 3, wheels W, output columns C; an output is

    M v + Q s + E u_w + offset,   v the twist, s its integral since the start, u_w the voltage at wheel w.
    """

    rate: FloatArray  # (3,) a
    coulomb: FloatArray  # (3,) c
    hold: FloatArray  # (3,) S
    drive: FloatArray  # (3, W) acceleration per volt
    speed_map: FloatArray  # (C, 3) M
    travel_map: FloatArray  # (C, 3) Q
    input_map: FloatArray  # (C,) E
    input_wheel: IntArray  # (C,) w
    late: FloatArray  # (C,) latency [s]
    driver: FloatArray  # (3,) gain, dead band [V], fade over the run


class Slopes(NamedTuple):
    """Derivatives of the numbers above; the last axis is the parameter, in all P. at_...: index of one, or -1."""

    rate: FloatArray  # (3, P)
    coulomb: FloatArray  # (3, P)
    drive: FloatArray  # (3, W, P)
    speed_map: FloatArray  # (C, 3, P)
    travel_map: FloatArray  # (C, 3, P)
    input_map: FloatArray  # (C, P)
    maps_vary: bool
    at_late: IntArray  # (C,)
    at_driver: IntArray  # (3,)
    at_start: IntArray  # (3,)
    at_offset: IntArray  # (C,)


class Loss(NamedTuple):
    """variance: of each column, shape (C,). nu: degrees of freedom of Student's t, 0 for Gauss. block: rows."""

    variance: FloatArray
    nu: float
    block: int
    mode: int


class Sums(NamedTuple):
    """What the march adds up; see above. predicted (rows, C) and slopes (rows, C, P) are filled where KEEP asks."""

    number: FloatArray  # (C,) count
    square: FloatArray  # (C,)
    loss: FloatArray  # (C,)
    lag: FloatArray  # (C,)
    grad: FloatArray  # (C, P)
    info: FloatArray  # (C, P, P)
    score: FloatArray  # (blocks, P)
    drift: FloatArray  # (blocks, C)
    predicted: FloatArray
    slopes: FloatArray


@part
def loss_terms(residual, variance, nu, final):
    """(w, curvature, rho) of one residual: score w r / variance, curvature / variance for the information.

    Gauss: 1, 1, r^2/(2 variance). Student's t with nu degrees: w = (nu + 1)/(nu + z^2), rho = (nu + 1)/2
    log(1 + z^2/nu); its curvature may be negative: the solver takes w for it, only the final march the curvature.
    """
    z2 = residual * residual / variance
    if nu == 0.0:
        return 1.0, 1.0, 0.5 * z2
    weight = (nu + 1.0) / (nu + z2)
    curvature = weight * (nu - z2) / (nu + z2) if final else weight
    return weight, curvature, 0.5 * (nu + 1.0) * math.log1p(z2 / nu)


@part
def driven(u, w, gain, dead):
    """(voltage at the wheel, its derivative by gain, by the dead band): gain (|u| - dead)+ sgn u."""
    size = abs(u[w]) - dead
    if size <= 0.0:
        return 0.0, 0.0, 0.0
    side = 1.0 if u[w] > 0.0 else -1.0
    return gain * size * side, size * side, -gain * side


@part
def held(cache, rates, dt):
    """Refresh `cache` (row 3: dt; rows 0..2: phi, dphi, psi, dpsi of the axes) for a step of dt."""
    off = dt - cache[3, 0]
    for axis in range(3):
        if abs(off) * rates[axis] > SAME or cache[3, 1] == 0.0:
            for k in range(3):
                cache[k, 0], cache[k, 1], cache[k, 2], cache[k, 3] = hold_slopes(rates[k], dt)
            cache[3, 0], cache[3, 1] = dt, 1.0
            return 0.0
    return off


@part
def held_values(cache, axis, rate, off):
    """phi, dphi, psi, dpsi of a step `off` longer than the one in `cache`, to first order."""
    phi, dphi, psi, dpsi = cache[axis, 0], cache[axis, 1], cache[axis, 2], cache[axis, 3]
    if off == 0.0:
        return phi, dphi, psi, dpsi
    decay = 1.0 - rate * phi
    return phi + off * decay, dphi - off * (phi + rate * dphi), psi + off * phi, dpsi + off * dphi


@part
def add_column(c, row, residual, loss, sums, last, block, final):
    """Add one residual and its row of slopes to the sums of column c."""
    weight, curvature, rho = loss_terms(residual, loss.variance[c], loss.nu, final)
    pull = weight * residual
    sums.number[c] += 1.0
    sums.square[c] += pull * residual
    sums.loss[c] += rho
    sums.lag[c] += pull * last[c]
    last[c] = pull
    grad, info, size = sums.grad[c], sums.info[c], len(row)
    for i in range(size):
        grad[i] += pull * row[i]
    for i in range(size):
        lead = curvature * row[i]
        if lead != 0.0:
            for j in range(size):
                info[i, j] += lead * row[j]
    if final:
        score = sums.score[block]
        sums.drift[block, c] += pull
        for i in range(size):
            score[i] += pull / loss.variance[c] * row[i]


@kernel
def march(t, u, y, first, last, origin, span, margin, start, offset, groups, physics, slopes, loss, sums):
    """March from row `first` to row `last`, both of one piece without a gap, and add to `sums`.

    t (rows,), u (rows, W) voltages before the driver, y (rows, C) outputs, NaN where not measured. origin, span: of
    the whole run, for the fade. margin (C,): time after `first` before which outputs are not used. start (3,) twist;
    offset (C,). groups: first column of each group of one latency, and C.
    """
    rate, coulomb, hold = physics.rate, physics.coulomb, physics.hold
    wheels, size, final, keep = u.shape[1], slopes.rate.shape[1], loss.mode & FINAL, loss.mode & KEEP
    gain, dead, fade = physics.driver[0], physics.driver[1], physics.driver[2]
    travels = False
    for c in range(len(offset)):
        for axis in range(3):
            travels |= physics.travel_map[c, axis] != 0.0
    v, s, now, way, g = start.copy(), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    dv, ds, dg = np.zeros((3, size)), np.zeros((3, size)), np.zeros((3, size))
    dnow, dway, row = np.zeros((3, size)), np.zeros((3, size)), np.zeros(size)
    volts, by_gain, by_dead, by_fade = np.zeros(wheels), np.zeros(wheels), np.zeros(wheels), np.zeros(wheels)
    before, pointer = np.zeros(len(offset)), np.full(len(groups) - 1, first)
    steps, parts = np.zeros((4, 4)), np.zeros((len(groups) - 1, 4, 4))
    for axis in range(3):
        if slopes.at_start[axis] >= 0:
            dv[axis, slopes.at_start[axis]] = 1.0
    for k in range(first, last + 1):
        worn = (t[k] - origin) / span
        for w in range(wheels):
            whole, more, less = driven(u[k], w, gain, dead)
            left = 1.0 - fade * worn
            volts[w], by_gain[w], by_dead[w], by_fade[w] = left * whole, left * more, left * less, -worn * whole
        for axis in range(3):
            g[axis] = 0.0
            for w in range(wheels):
                g[axis] += physics.drive[axis, w] * volts[w]
            for i in range(size):
                dg[axis, i] = 0.0
        if slopes.maps_vary:
            for axis in range(3):
                for w in range(wheels):
                    for i in range(size):
                        dg[axis, i] += slopes.drive[axis, w, i] * volts[w]
        for axis in range(3):
            for w in range(wheels):
                if slopes.at_driver[GAIN] >= 0:
                    dg[axis, slopes.at_driver[GAIN]] += physics.drive[axis, w] * by_gain[w]
                if slopes.at_driver[DEAD] >= 0:
                    dg[axis, slopes.at_driver[DEAD]] += physics.drive[axis, w] * by_dead[w]
                if slopes.at_driver[FADE] >= 0:
                    dg[axis, slopes.at_driver[FADE]] += physics.drive[axis, w] * by_fade[w]
        dt = t[k + 1] - t[k] if k < last else math.inf
        for group in range(len(groups) - 1):
            column, end = groups[group], groups[group + 1]
            late = physics.late[column]
            while pointer[group] <= last:
                sample = pointer[group]
                into = t[sample] - late - t[k]
                if not into < dt:
                    break
                pointer[group] += 1
                if into < 0.0 or t[sample] - t[first] < margin[column]:
                    continue
                off = held(parts[group], rate, into) if into > 0.0 else 0.0
                for axis in range(3):
                    if into == 0.0:
                        now[axis], way[axis] = v[axis], s[axis]
                        for i in range(size):
                            dnow[axis, i], dway[axis, i] = dv[axis, i], ds[axis, i]
                        continue
                    phi, dphi, psi, dpsi = held_values(parts[group], axis, rate[axis], off)
                    now[axis], kv, kg, kc, ka = step_slopes(
                        v[axis], g[axis], coulomb[axis], hold[axis], rate[axis], phi, dphi
                    )
                    for i in range(size):
                        dnow[axis, i] = (
                            kv * dv[axis, i]
                            + kg * dg[axis, i]
                            + kc * slopes.coulomb[axis, i]
                            + ka * slopes.rate[axis, i]
                        )
                    if travels:
                        way[axis], kv, kg, kc, ka = travel_slopes(
                            v[axis], g[axis], coulomb[axis], hold[axis], rate[axis], into, phi, dphi, psi, dpsi
                        )
                        way[axis] += s[axis]
                        for i in range(size):
                            dway[axis, i] = ds[axis, i] + (
                                kv * dv[axis, i] + kg * dg[axis, i]
                                + kc * slopes.coulomb[axis, i] + ka * slopes.rate[axis, i]
                            )  # fmt: skip
                for c in range(column, end):
                    wheel = physics.input_wheel[c]
                    value = offset[c]
                    for i in range(size):
                        row[i] = 0.0
                    for axis in range(3):
                        m, q = physics.speed_map[c, axis], physics.travel_map[c, axis]
                        value += m * now[axis] + q * way[axis]
                        if m != 0.0:
                            for i in range(size):
                                row[i] += m * dnow[axis, i]
                        if q != 0.0:
                            for i in range(size):
                                row[i] += q * dway[axis, i]
                        if slopes.maps_vary:
                            for i in range(size):
                                row[i] += slopes.speed_map[c, axis, i] * now[axis]
                                row[i] += slopes.travel_map[c, axis, i] * way[axis]
                        if slopes.at_late[c] >= 0:
                            pace = acceleration_at_end(now[axis], g[axis], coulomb[axis], hold[axis], rate[axis])
                            row[slopes.at_late[c]] -= m * pace + q * now[axis]
                    if wheel >= 0:
                        e = physics.input_map[c]
                        value += e * volts[wheel]
                        for i in range(size):
                            row[i] += slopes.input_map[c, i] * volts[wheel]
                        if slopes.at_driver[GAIN] >= 0:
                            row[slopes.at_driver[GAIN]] += e * by_gain[wheel]
                        if slopes.at_driver[DEAD] >= 0:
                            row[slopes.at_driver[DEAD]] += e * by_dead[wheel]
                        if slopes.at_driver[FADE] >= 0:
                            row[slopes.at_driver[FADE]] += e * by_fade[wheel]
                    if slopes.at_offset[c] >= 0:
                        row[slopes.at_offset[c]] += 1.0
                    if keep:
                        sums.predicted[sample, c] = value
                        for i in range(sums.slopes.shape[2]):
                            sums.slopes[sample, c, i] = row[i]
                    residual = y[sample, c] - value
                    if residual == residual:
                        add_column(c, row, residual, loss, sums, before, (k - first) // loss.block, final)
                    else:
                        before[c] = 0.0
        if k == last:
            break
        off = held(steps, rate, dt)
        for axis in range(3):
            phi, dphi, psi, dpsi = held_values(steps, axis, rate[axis], off)
            if travels:
                path, kv, kg, kc, ka = travel_slopes(
                    v[axis], g[axis], coulomb[axis], hold[axis], rate[axis], dt, phi, dphi, psi, dpsi
                )
                s[axis] += path
                for i in range(size):
                    ds[axis, i] += (
                        kv * dv[axis, i] + kg * dg[axis, i] + kc * slopes.coulomb[axis, i] + ka * slopes.rate[axis, i]
                    )
            v[axis], kv, kg, kc, ka = step_slopes(v[axis], g[axis], coulomb[axis], hold[axis], rate[axis], phi, dphi)
            for i in range(size):
                dv[axis, i] = (
                    kv * dv[axis, i] + kg * dg[axis, i] + kc * slopes.coulomb[axis, i] + ka * slopes.rate[axis, i]
                )
