"""f = 1/(1 + p), p = (|v|/v_s)^d: a fall with a long tail, C + (S - C)/(1 + (v/v_s)^2) for d = 2. Hess & Soom 1990.

As Armstrong-Helouvry, Dupont & Canudas de Wit 1994 have it. Half of what is more than C is left at v_s, a hundredth at
ten times as much, where the exponential fall has long come to C: it shows in logs as less viscous friction.
"""

from __future__ import annotations

from omnidyn.compiled.kernel import part


@part
def left(p):
    """(f, df/dp); see SHAPES of stribeck.py."""
    value = 1.0 / (1.0 + p)
    return value, -value * value


@part
def steepest(d):
    """p at which it falls most steeply with |v|, for d >= 1."""
    return (d - 1.0) / (d + 1.0)
