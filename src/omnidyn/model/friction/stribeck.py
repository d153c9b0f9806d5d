"""Stribeck's fall: dry friction that is largest at rest and falls to the Coulomb level as the speed grows.

    F = [C + (S - C) f(p)] sgn v,   p = (|v|/v_s)^d;   at rest any force up to S

C the Coulomb level, S >= C breakaway, v_s the Stribeck speed (1e-3 to 5e-2 m/s), d the exponent: 2 (the usual one), 1
(Tustin 1947), 0.5 to 2 measured. Meaningful where surfaces are lubricated, and at low speed on most floors: what makes
a robot stick and slip. S = C is Coulomb's law, to the last bit. Source: Bo & Pavelescu 1982; Armstrong-Helouvry et al.
1994. Below a speed of v_s/65536 an exponent under 1 falls along a chord: its slope at rest would be infinite.

f is one of SHAPES, each a file: `left(p)` gives (f, df/dp), f(0) = 1, from there down to 0, in NumPy's functions, so
that it takes numbers in a kernel and arrays outside; `steepest(d)`, for d >= 1, the one p at which f falls most steeply
with |v|. All else is derived from these two, here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import FloatArray
from omnidyn.compiled.kernel import kernel, one_of, part, plain
from omnidyn.model.friction import exponential, lorentzian

SHAPES = {"exponential": exponential, "lorentzian": lorentzian}
"""The shapes by their words in a robot file. A record has the number of its shape, in this order."""

USUAL_EXPONENT = 2.0
LEAST_EXPONENT, LARGEST_EXPONENT = 0.3, 10.0  # of the exponent
CHORD = 2.0**-16
BRISTLE_STEEPNESS = 1.5  # a bristle follows what falls late: so much steeper at the most

_left = one_of([shape.left for shape in SHAPES.values()])
_steepest = one_of([shape.steepest for shape in SHAPES.values()])


@part
def fall(u, shape, exponent):
    """(f, f') at u = |v|/v_s >= 0."""
    if exponent == 2.0:
        value, slope = _left(shape, u * u)
        return value, 2.0 * u * slope
    if exponent < 1.0 and u < CHORD:
        slope = (_left(shape, CHORD**exponent)[0] - 1.0) / CHORD
        return 1.0 + slope * u, slope
    if u == 0.0:
        return 1.0, (_left(shape, 0.0)[1] if exponent == 1.0 else 0.0)
    power = u**exponent
    value, slope = _left(shape, power)
    return value, exponent * power / u * slope


@part
def steepest(u, shape, exponent):
    """The largest -f' at u and beyond; u = 0: of all."""
    worst = 0.0 if exponent < 1.0 else _steepest(shape, exponent) ** (1.0 / exponent)
    return -fall(max(u, worst), shape, exponent)[1]


@kernel
def steepest_of_all(shape, exponent):
    """The largest -f' of all, for callers outside kernels."""
    return steepest(0.0, shape, exponent)


@part
def steepness_left(u, shape, exponent):
    """The steepest fall at u Stribeck speeds and beyond, over the steepest of all."""
    return 1.0 if u <= 0.0 else steepest(u, shape, exponent) / steepest(0.0, shape, exponent)


@part
def excess(record, at, speed):
    """(force, slope) by which an element that slides resists more than its Coulomb level, against its sign.

    record, at: the records ELEMENT and EACH of it, see layout.py.
    """
    sign, side = at.sign, 0 if at.sign > 0.0 else 1
    f, slope = fall(max(sign * speed, 0.0) * record.fall, record.form, record.exponent)
    extra = at.hold[side] - record.coulomb[side]
    return -sign * extra * f, -extra * slope * record.fall


def steepest_of(record: Any) -> float:
    """A bound of how steeply an element falls [N s/m], what it sticks with and its bristle; record: its record."""
    if record.fall == 0.0:
        return 0.0
    extra = max((record.breakaway - record.coulomb).max(), 0.0)
    bends = max((record.bristle_breakaway - record.bristle_coulomb).max(), 0.0)
    return (extra + BRISTLE_STEEPNESS * bends) * record.fall * steepest_of_all(record.form, record.exponent)


def fallen(speed: ArrayLike, inverse: ArrayLike, exponent: ArrayLike, shape: ArrayLike = 0.0) -> FloatArray:
    """f at a speed [m/s or rad/s] of any sign; inverse: 1/v_s, 0 for a level that nobody looks at. Any shape."""
    u, d = np.abs(np.asarray(speed, dtype=float)) * inverse, np.asarray(exponent, dtype=float)
    with np.errstate(under="ignore"):
        value = _fallen(shape, u**d)
        chord = 1.0 - (1.0 - _fallen(shape, CHORD**d)) * u / CHORD
    return np.where((d < 1.0) & (u < CHORD), chord, value)


def _fallen(shape: ArrayLike, p: Any) -> FloatArray:
    """f(p), each of its own shape."""
    first, *rest_shapes = (plain(form.left) for form in SHAPES.values())
    values = first(p)[0]
    for number, function in enumerate(rest_shapes, start=1):
        if np.any(np.equal(shape, number)):
            values = np.where(np.equal(shape, number), function(p)[0], values)
    return values
