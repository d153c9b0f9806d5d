"""One march of the exact step through a piece of a log, with its sensitivities: what a fit needs to know of the log.

Along the way grow, for every column c of the outputs, with r = y - f(p), J = df/dp and a weight w of the loss:

    count  n      square  sum w r^2      loss  sum rho(r)      lag  sum w r w' r' of neighbours
    grad  sum w r J                      info  sum w J J'

(w r is E x s and w r^2 is E x^2 s^2 for columns that are counts: counts.py)

and, in a final march, for every block of rows: score, the sum of w r J/variance over all columns, and drift, the sum of
w r of each column. For columns of counts, on request: waves, the sums of cos and sin(2 pi m f/tick) J, m = 1, 2, ...
Nothing is kept of the samples, so that memory does not grow with the log. Rows of J are padded to a
multiple of 4 with zeros: the loops become the short vectors of the processor.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.compiled.kernel import kernel, part
from omnidyn.identification.output_error.kernel.counts import count_terms
from omnidyn.identification.output_error.kernel.pull import add_pull
from omnidyn.model.actuation import Driver, at_motor
from omnidyn.simulation.exact.exact_march import rotated
from omnidyn.simulation.exact.position import move_on, put_displacement
from omnidyn.simulation.exact.slopes import acceleration_at_end, hold_slopes, step_slopes, travel_slopes

PATH = 5  # integrals of the twist, then x and y of the displacement
STEP_TOLERANCE = (
    1e-7  # times 1/a [s]: steps that differ by less share one exponential, to first order, which leaves 1e-15
)
FINAL, KEEP, WAVES = 1, 2, 4  # what a march is for, beside the sums


class Physics(NamedTuple):
    """Numbers of the model. Axes 3, wheels W, output columns C; an output is

    M v + Q s + E u_w + offset,   v the twist, s the path since the start, u_w the voltage at wheel w.

    The path (5,) is the integral of the twist, then the displacement in the body frame at the start.
    """

    law: FloatArray  # (3, 3) rows a, c, S of the axes
    drive: FloatArray  # (3, W) acceleration per volt
    push: FloatArray  # (3,) acceleration by a constant force
    speed_map: FloatArray  # (C, 3) M
    travel_map: FloatArray  # (C, 5) Q
    input_map: FloatArray  # (C,) E
    input_wheel: IntArray  # (C,) w
    latencies: FloatArray  # (C,) latency [s]
    driver: Driver
    travels: bool  # whether Q has an entry


class PhysicsSlopes(NamedTuple):
    """Derivatives of the numbers above; the last axis is the parameter, in all P. at_...: index of one, or -1."""

    law: FloatArray  # (2, 3, P) of a and c
    drive: FloatArray  # (3, W, P)
    push: FloatArray  # (3, P)
    speed_map: FloatArray  # (C, 3, P)
    travel_map: FloatArray  # (C, 5, P)
    input_map: FloatArray  # (C, P)
    maps_vary: bool
    travel_varies: BoolArray  # (C,)
    at_late: IntArray  # (C,)
    driver_indices: IntArray  # (3,)
    at_start: IntArray  # (3,)
    at_offset: IntArray  # (C,)


class Loss(NamedTuple):
    """variance: of each column, shape (C,). nu: degrees of freedom of Student's t, 0 for Gauss. block: rows.

    share (C,): Fisher's information of a row of counts, in 1/variance.
    """

    variance: FloatArray
    nu: float
    block: int
    mode: int
    share: FloatArray


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
    waves: FloatArray  # (C, M, 2, P), M = 0 but where WAVES asks


@part
def loss_terms(residual, variance, nu, final):
    """(w r, w r^2, curvature, rho) of one residual: score w r/variance, curvature/variance for the information.

    Gauss: 1, 1, r^2/(2 variance). Student's t with nu degrees: w = (nu + 1)/(nu + z^2), rho = (nu + 1)/2
    log(1 + z^2/nu); its curvature may be negative: the solver takes w (nu + 1)/(nu + 3), which has the right mean where
    the noise is of that kind, and only the final march the curvature itself.
    """
    z2 = residual * residual / variance
    if nu == 0.0:
        return residual, residual * residual, 1.0, 0.5 * z2
    weight = (nu + 1.0) / (nu + z2)
    curvature = weight * (nu - z2) / (nu + z2) if final else weight * (nu + 1.0) / (nu + 3.0)
    pull = weight * residual
    return pull, pull * residual, curvature, 0.5 * (nu + 1.0) * math.log1p(z2 / nu)


@part
def counted_terms(residual, variance, tick, share, final):
    """The same of one count; its curvature jumps from row to row: the solver takes its mean, `share`, at least."""
    deviation = math.sqrt(variance)
    mean, square, spread, rho = count_terms(residual / deviation, 0.5 * tick / deviation)
    curvature = 1.0 - spread
    return deviation * mean, variance * square, (curvature if final else max(curvature, share)), rho


@part
def terms_of(residual, variance, nu, c, tick, share, final):
    """The same of column c, whatever it is."""
    if tick is not None:  # noqa: SIM102 alone, it is decided at compile time
        if tick[c] > 0.0:
            return counted_terms(residual, variance[c], tick[c], share[c], final)
    return loss_terms(residual, variance[c], nu, final)


@part
def held(cache, rates, dt):
    """Refresh `cache` (row 3: dt; rows 0..2: phi, dphi, psi, dpsi of the axes) for a step of dt."""
    dt_error = dt - cache[3, 0]
    for axis in range(3):
        if abs(dt_error) * rates[axis] > STEP_TOLERANCE or cache[3, 1] == 0.0:
            for k in range(3):
                cache[k, 0], cache[k, 1], cache[k, 2], cache[k, 3] = hold_slopes(rates[k], dt)
            cache[3, 0], cache[3, 1] = dt, 1.0
            return 0.0
    return dt_error


@part
def held_values(cache, axis, rate, dt_error):
    """phi, dphi, psi, dpsi of a step `dt_error` longer than the one in `cache`, to first order."""
    phi, dphi, psi, dpsi = cache[axis, 0], cache[axis, 1], cache[axis, 2], cache[axis, 3]
    if dt_error == 0.0:
        return phi, dphi, psi, dpsi
    decay = 1.0 - rate * phi
    return phi + dt_error * decay, dphi - dt_error * (phi + rate * dphi), psi + dt_error * phi, dpsi + dt_error * dphi


@part
def add_information(info, grad, row, pull, curvature):
    """grad += pull row, info += curvature row row'."""
    size = len(row)
    for i in range(size):
        grad[i] += pull * row[i]
    for i in range(size):
        lead = curvature * row[i]
        if lead != 0.0:
            for j in range(size):
                info[i, j] += lead * row[j]


@part
def add_waves(waves, row, turns):
    """waves (M, 2, P) += (cos, sin)(2 pi m turns) row for m = 1 to M."""
    if waves.shape[0] == 0:
        return
    east, north = math.cos(2.0 * math.pi * turns), math.sin(2.0 * math.pi * turns)
    cosine, sine = east, north
    for m in range(waves.shape[0]):
        for i in range(len(row)):
            waves[m, 0, i] += cosine * row[i]
            waves[m, 1, i] += sine * row[i]
        cosine, sine = cosine * east - sine * north, sine * east + cosine * north


@part
def put_volts(volts, u, k, share, driver):
    """Row 0 of `volts`: at the wheels; rows 1 to 3: its derivatives by the numbers of the driver."""
    for w in range(volts.shape[1]):
        volts[0, w], volts[1, w], volts[2, w], volts[3, w] = at_motor(u[k, w], share, driver)


@part
def put_drive(g, dg, volts, drive, push, d_drive, d_push, driver_indices, vary):
    """Drive of the axes and its slopes."""
    for axis in range(3):
        for i in range(dg.shape[1]):
            dg[axis, i] = d_push[axis, i]
        g[axis] = push[axis]
        for w in range(volts.shape[1]):
            g[axis] += drive[axis, w] * volts[0, w]
            if vary:
                for i in range(dg.shape[1]):
                    dg[axis, i] += d_drive[axis, w, i] * volts[0, w]
            for k in range(3):
                if driver_indices[k] >= 0:
                    dg[axis, driver_indices[k]] += drive[axis, w] * volts[1 + k, w]


@part
def advance(v, s, g, dv, ds, dg, law, dlaw, dt, cache, travels, place, pieces):
    """Move twist v and path s on by dt, and their slopes. law (3, 3): a, c, S; dlaw (2, 3, P)."""
    if place is not None:
        put_displacement(place, pieces, v, g, law, dt)
        move_on(s, ds, place, dv, dg, dlaw[1], dlaw[0])
    dt_error = held(cache, law[0], dt)
    for axis in range(3):
        a, c, hold = law[0, axis], law[1, axis], law[2, axis]
        phi, dphi, psi, dpsi = held_values(cache, axis, a, dt_error)
        if travels:
            path, kv, kg, kc, ka = travel_slopes(v[axis], g[axis], c, hold, a, dt, phi, dphi, psi, dpsi)
            s[axis] += path
            for i in range(dv.shape[1]):
                ds[axis, i] += kv * dv[axis, i] + kg * dg[axis, i] + kc * dlaw[1, axis, i] + ka * dlaw[0, axis, i]
        v[axis], kv, kg, kc, ka = step_slopes(v[axis], g[axis], c, hold, a, phi, dphi)
        for i in range(dv.shape[1]):
            dv[axis, i] = kv * dv[axis, i] + kg * dg[axis, i] + kc * dlaw[1, axis, i] + ka * dlaw[0, axis, i]


@part
def copy_motion(v, s, dv, ds, v_now, s_now, dv_now, ds_now, travels, place):
    """The motion at the start of a step, to go on from."""
    if place is not None:
        for path in range(3, PATH):
            s_now[path] = s[path]
            for i in range(dv.shape[1]):
                ds_now[path, i] = ds[path, i]
    for axis in range(3):
        v_now[axis], s_now[axis] = v[axis], s[axis]
        for i in range(dv.shape[1]):
            dv_now[axis, i] = dv[axis, i]
        if travels:
            for i in range(dv.shape[1]):
                ds_now[axis, i] = ds[axis, i]


@part
def put_row(row, c, v, s, dv, ds, speed_map, travel_map, d_speed, d_travel, vary, travels, travel_varies):
    """What column c takes from the motion, and its slopes in `row`."""
    value, size = 0.0, len(row)
    for i in range(size):
        row[i] = 0.0
    for axis in range(3):
        m = speed_map[c, axis]
        value += m * v[axis]
        if m != 0.0:
            for i in range(size):
                row[i] += m * dv[axis, i]
        if vary:
            for i in range(size):
                row[i] += d_speed[c, axis, i] * v[axis]
    if not travels:
        return value
    for path in range(PATH):
        q = travel_map[c, path]
        value += q * s[path]
        if q != 0.0:
            for i in range(size):
                row[i] += q * ds[path, i]
        if travel_varies[c]:
            for i in range(size):
                row[i] += d_travel[c, path, i] * s[path]
    return value


@part
def add_latency(row, c, latency_index, v, s, g, law, speed_map, travel_map, place):
    """The slope of column c by its latency: what was earlier. In a last row without inputs no acceleration is known."""
    for axis in range(3):
        pace = acceleration_at_end(v[axis], g[axis], law[1, axis], law[2, axis], law[0, axis])
        pace = pace if g[axis] == g[axis] else 0.0
        row[latency_index] -= speed_map[c, axis] * pace + travel_map[c, axis] * v[axis]
    if place is not None:
        east, north = rotated(s[2], v[0], v[1])
        row[latency_index] -= travel_map[c, 3] * east + travel_map[c, 4] * north


@part
def add_input(row, volts, wheel, e, d_input, c, driver_indices):
    """What a current takes directly from the voltage of its wheel."""
    for i in range(len(row)):
        row[i] += d_input[c, i] * volts[0, wheel]
    for k in range(3):
        if driver_indices[k] >= 0:
            row[driver_indices[k]] += e * volts[1 + k, wheel]
    return e * volts[0, wheel]


@kernel
def march(
    t,
    u,
    y,
    first,
    last,
    origin,
    span,
    margin,
    start,
    offset,
    groups,
    physics,
    slopes,
    loss,
    sums,
    tick,
    place,
    pieces,
    room,
):
    """March from row `first` to row `last`, both of one piece without a gap, and add to `sums`.

    t (rows,), u (rows, W) voltages before the driver, y (rows, C) outputs, NaN where not measured. origin, span: of
    the whole run, for the fade. margin (C,): time after `first` before which outputs are not used. start (3,) twist;
    offset (C,). groups: first column of each group of one latency, and C.

    tick (C,): of columns that are counts [rad], 0 for the others; place, pieces: space for `put_displacement`; room: a
    force there, where physics.travels. None where there is no need: such a kernel is another one, and faster.
    """
    law, dlaw, size = physics.law, slopes.law, slopes.law.shape[2]
    speed_map, travel_map, d_speed, vary = physics.speed_map, physics.travel_map, slopes.speed_map, slopes.maps_vary
    final, keeps_rows, travels = (loss.mode & FINAL) != 0, (loss.mode & KEEP) != 0, physics.travels
    v, s, g, v_now, s_now = start.copy(), np.zeros(PATH), np.zeros(3), np.zeros(3), np.zeros(PATH)
    dv, ds, dg, dv_now, ds_now = (
        np.zeros((3, size)),
        np.zeros((PATH, size)),
        np.zeros((3, size)),
        np.zeros((3, size)),
        np.zeros((PATH, size)),
    )
    for axis in range(3):
        if slopes.at_start[axis] >= 0:
            dv[axis, slopes.at_start[axis]] = 1.0
    volts, row, value_before = np.zeros((4, u.shape[1])), np.zeros(size), np.zeros(len(offset))
    pointer, steps, parts = np.full(len(groups) - 1, first), np.zeros((4, 4)), np.zeros((len(groups) - 1, 4, 4))
    drive, d_drive, driver, driver_indices = physics.drive, slopes.drive, physics.driver, slopes.driver_indices
    lates, wheels, input_map, d_input = physics.latencies, physics.input_wheel, physics.input_map, slopes.input_map
    at_late, at_offset, variance, nu, block = slopes.at_late, slopes.at_offset, loss.variance, loss.nu, loss.block
    d_travel, travel_varies, share = slopes.travel_map, slopes.travel_varies, loss.share
    number, square, total, lag, grad, info = sums.number, sums.square, sums.loss, sums.lag, sums.grad, sums.info
    score, drift, predicted, kept_slopes, waves = sums.score, sums.drift, sums.predicted, sums.slopes, sums.waves
    begins_at_rest = not start.any() and slopes.at_start[0] < 0 and slopes.at_start[1] < 0 and slopes.at_start[2] < 0
    for k in range(first, last + 1):
        put_volts(volts, u, k, (t[k] - origin) / span, driver)
        put_drive(g, dg, volts, drive, physics.push, d_drive, slopes.push, driver_indices, vary)
        dt = t[k + 1] - t[k] if k < last else math.inf
        if room is not None:
            add_pull(g, dg, room, v, s, dv, ds, dt if k < last else 0.0)
        for group in range(len(groups) - 1):
            latency = lates[groups[group]]
            while pointer[group] <= last and t[pointer[group]] - latency - t[k] < dt:
                sample = pointer[group]
                pointer[group] += 1
                time_in_row = t[sample] - latency - t[k]
                early = (
                    time_in_row < 0.0
                )  # what was before the first row is known of a robot at rest only: it has no margin
                if t[sample] - t[first] < margin[groups[group]] or (early and not begins_at_rest):
                    continue
                time_in_row = max(time_in_row, 0.0)
                if time_in_row > 0.0 and g[0] + g[1] + g[2] != g[0] + g[1] + g[2]:
                    continue  # what follows a last row without inputs
                copy_motion(v, s, dv, ds, v_now, s_now, dv_now, ds_now, travels, place)
                if time_in_row > 0.0:
                    advance(
                        v_now,
                        s_now,
                        g,
                        dv_now,
                        ds_now,
                        dg,
                        law,
                        dlaw,
                        time_in_row,
                        parts[group],
                        travels,
                        place,
                        pieces,
                    )
                for c in range(groups[group], groups[group + 1]):
                    value = offset[c] + put_row(
                        row,
                        c,
                        v_now,
                        s_now,
                        dv_now,
                        ds_now,
                        speed_map,
                        travel_map,
                        d_speed,
                        d_travel,
                        vary,
                        travels,
                        travel_varies,
                    )
                    if wheels[c] >= 0:
                        if early:
                            continue
                        value += add_input(row, volts, wheels[c], input_map[c], d_input, c, driver_indices)
                    if at_late[c] >= 0 and not early:
                        add_latency(row, c, at_late[c], v_now, s_now, g, law, speed_map, travel_map, place)
                    if at_offset[c] >= 0:
                        row[at_offset[c]] += 1.0
                    if keeps_rows:
                        predicted[sample, c] = value
                        for i in range(kept_slopes.shape[2]):  # a slice compiles the words of its error too: 1.5 s
                            kept_slopes[sample, c, i] = row[i]
                    residual = y[sample, c] - value
                    if residual != residual:
                        value_before[c] = 0.0
                        continue
                    pull, pull_change, curvature, rho = terms_of(residual, variance, nu, c, tick, share, final)
                    number[c] += 1.0
                    square[c] += pull_change
                    total[c] += rho
                    lag[c] += pull * value_before[c]
                    value_before[c] = pull
                    add_information(info[c], grad[c], row, pull, curvature)
                    if tick is not None:  # noqa: SIM102 alone, it is decided at compile time
                        if tick[c] > 0.0:
                            add_waves(waves[c], row, value / tick[c])
                    if final:
                        drift[(k - first) // block, c] += pull
                        for i in range(size):
                            score[(k - first) // block, i] += pull / variance[c] * row[i]
        if k < last:
            advance(v, s, g, dv, ds, dg, law, dlaw, dt, steps, travels, place, pieces)
