"""f = exp(-p), p = (|v|/v_s)^d: Stribeck's fall as Bo & Pavelescu (1982) have it; d = 2 Gauss, d = 1 Tustin (1947)."""

from __future__ import annotations

import numpy as np

from omnidyn.compiled.kernel import part


@part
def left(p):
    """(f, df/dp); see SHAPES of stribeck.py."""
    value = np.exp(-p)
    return value, -value


@part
def steepest(d):
    """p at which it falls most steeply with |v|, for d >= 1."""
    return (d - 1.0) / d
