"""Dahl's bristles: a spring before it slips, and one level.

    z' = s |w|^a sgn w,  w = 1 - sigma0 z sgn(s)/C,   F = sigma0 z

a = 1 usual, below 1 brittle, above 1 ductile. It never gives energy back. Source: Dahl 1976. a = 1 is LuGre's rate.
"""

from __future__ import annotations

import math
from typing import Any

from omnidyn.compiled.kernel import part
from omnidyn.model.friction import lugre
from omnidyn.model.friction.law import Kind, Number

ROUNDS = 60  # of Newton's steps for a general exponent; bisection needs no more


def rate_of(psi: Any) -> Any:
    """The rate z' = s psi(w), w = sigma0 z sgn(s)/g, of a law whose psi falls with w.

    psi(own, w) -> (psi, -psi'), a part. r(z') = z' - s psi(w(z* + tau z')) rises with z': Newton within a bracket.
    """

    def rate(own, aimed, speed, tau, level, slope):
        """(z', dz'/ds); see LAWS of bristle.py."""
        stiffness = own.stiffness
        if speed == 0.0:
            return 0.0, psi(own, stiffness * aimed / level)[0]
        side = 1.0 if speed > 0.0 else -1.0
        start = speed * psi(own, stiffness * aimed * side / level)[0]
        low, high, found = min(start, 0.0), max(start, 0.0), 0.5 * start
        bend = tau * abs(speed) * stiffness / level
        for _ in range(ROUNDS):
            value, steep = psi(own, stiffness * (aimed + tau * found) * side / level)
            off = found - speed * value
            if off > 0.0:
                high = found
            else:
                low = found
            new = found - off / (1.0 + bend * steep)
            if not low <= new <= high:
                new = 0.5 * (low + high)
            if abs(new - found) <= 1e-16 * abs(start):
                break
            found = new
        w = stiffness * (aimed + tau * found) * side / level
        value, steep = psi(own, w)
        return found, (value + speed * steep * w * slope / level) / (1.0 + bend * steep)

    return part(rate)


@part
def _psi(own, w):
    left, a = 1.0 - w, own.dahl_exponent
    size = abs(left) ** a
    return math.copysign(size, left), a * size / max(abs(left), 1e-300)


_linear, _by_newton = lugre.rate, rate_of(_psi)


@part
def rate(own, aimed, speed, tau, level, slope):
    """(z', dz'/ds); see LAWS of bristle.py."""
    if own.dahl_exponent == 1.0:
        return _linear(own, aimed, speed, tau, level, slope)
    return _by_newton(own, aimed, speed, tau, level, slope)


def slow(own: Any, left: float, far: float) -> float:
    """What is left of the way to slipping, on a slow way: it decays by a power, for a = 1 by exp."""
    a = float(own.dahl_exponent)
    if a == 1.0:
        return lugre.slow(own, left, far)
    if left <= 0.0:
        return left
    below = left ** (1.0 - a) + (a - 1.0) * far
    return below ** (1.0 / (1.0 - a)) if below > 0.0 else 0.0


def linear(stiffness: Any, mass: Any, viscous: Any) -> float:
    """a where a table has no key for it."""
    return 1.0


TAKES = {"stiffness": lugre.STIFFNESS, "dahl_exponent": Number("dahl_exponent")}
KIND = Kind("dahl", "Dahl", TAKES, falls=False, bends=True, usual={"dahl_exponent": linear})
