"""Blocks of robots by the exact formula of one axis, `exact_step`: a loop along a row, without a branch.

A law is a block of what the formula takes, shape (PER_VOLT + 3 wheels, WIDTH): rows of Coulomb and breakaway level
[m/s^2], rate [1/s] and phi [s] of each axis, then the acceleration per volt [m/s^2/V], axis by axis, wheel by wheel.
"""

from __future__ import annotations

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import inlined
from omnidyn.simulation.batch.parameters import WIDTH, BatchParameters
from omnidyn.simulation.exact.step import exact_step

COULOMB, BREAKAWAY, RATE, PHI, PER_VOLT = 0, 3, 6, 9, 12  # first rows of a law


def exact_law(parameters: BatchParameters, dt: float | FloatArray) -> FloatArray:
    """The laws of robots under steps of dt [s], one for all or (n,): rows for `in_blocks`.

    Shape (PER_VOLT + 3 wheels, n).
    """
    mass, count = parameters.mass, parameters.count
    rate = parameters.damping / mass
    per_volt = parameters.push / mass[:, None]
    return np.concatenate(
        [
            parameters.coulomb / mass,
            parameters.breakaway / mass,
            rate,
            -np.expm1(-rate * dt) / rate,
            per_volt.reshape(-1, count),
        ]
    )


@inlined
def put_drive(drive, law, volts):
    """Fill `drive` (3, WIDTH) [m/s^2] from the volts of each robot (wheels, WIDTH), of three wheels or more."""
    wheels = len(volts)
    u0, u1, u2 = volts[0], volts[1], volts[2]
    for axis in range(3):
        first, row = PER_VOLT + axis * wheels, drive[axis]
        g0, g1, g2 = law[first], law[first + 1], law[first + 2]
        for n in range(WIDTH):
            row[n] = u0[n] * g0[n] + u1[n] * g1[n] + u2[n] * g2[n]
        for wheel in range(3, wheels):
            g, u = law[first + wheel], volts[wheel]
            for n in range(WIDTH):
                row[n] += u[n] * g[n]


@inlined
def put_shared_drive(drive, law, volts):
    """Fill `drive` (3, WIDTH) [m/s^2] from volts that all robots share (wheels,)."""
    wheels = len(volts)
    u0, u1, u2 = volts[0], volts[1], volts[2]
    for axis in range(3):
        first, row = PER_VOLT + axis * wheels, drive[axis]
        g0, g1, g2 = law[first], law[first + 1], law[first + 2]
        for n in range(WIDTH):
            row[n] = u0 * g0[n] + u1 * g1[n] + u2 * g2[n]
        for wheel in range(3, wheels):
            g, u = law[first + wheel], volts[wheel]
            for n in range(WIDTH):
                row[n] += u * g[n]


@inlined
def advance(speed, drive, law, zero):
    """The speeds (3, WIDTH) after a step, in place, under `drive` (3, WIDTH) held; `zero` is 0 in their type."""
    for axis in range(3):
        v, g, c, s = speed[axis], drive[axis], law[COULOMB + axis], law[BREAKAWAY + axis]
        a, phi = law[RATE + axis], law[PHI + axis]
        for n in range(WIDTH):
            v[n] = exact_step(v[n], g[n], c[n], s[n], a[n], phi[n], zero)
