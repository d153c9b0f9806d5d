"""The iteration that solves what bends and what slips: to the last digits, in few rounds, and then it stops."""

import math

import numpy as np
import pytest

from omnidyn.compiled.kernel import plain
from omnidyn.model.friction.newton import ROOT_TOLERANCE, newton

RISING = {
    "cube": (lambda x: x**3 - 2.0, lambda x: 3.0 * x**2, 2.0 ** (1.0 / 3.0)),
    "exp": (lambda x: math.exp(x) - 3.0, math.exp, math.log(3.0)),
    "atan": (lambda x: math.atan(20.0 * (x - 0.3)), lambda x: 20.0 / (1.0 + 400.0 * (x - 0.3) ** 2), 0.3),
    "at an end": (lambda x: x - 4.0, lambda x: 1.0, 4.0),
}


@pytest.mark.parametrize("name", RISING)
def test_it_settles_on_the_root_and_stays(name):
    """From anywhere in the bracket: no more than twenty rounds until a step is rounding."""
    value, slope, root = RISING[name]
    for start in np.linspace(0.0, 4.0, 41):
        found, low, high, rounds = float(start), 0.0, 4.0, 0
        while True:
            before, rounds = found, rounds + 1
            found, low, high = plain(newton)(found, value(found), max(slope(found), 1e-300), low, high)
            if abs(found - before) <= ROOT_TOLERANCE * abs(found):
                break
            assert rounds < 20
        assert found == pytest.approx(root, rel=4e-16)
