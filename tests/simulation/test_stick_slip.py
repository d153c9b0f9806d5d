"""The stick-slip cycle of a mass on a spring that a moving belt drags along: its period to 25 digits.

A winding that has next to no resistance is that spring: L i' = u - R i - E s, so that the drive on the body is
F' = k (V - v) - (R/L) F, with k = 1.5 kappa^2/L, V = 2 u/(sqrt(3) kappa), kappa = l K_t/r, for the voltages (0, u, -u).
Seen from the belt the body hangs on a spring whose other end moves at V: it sticks until F = S, slips until v = 0.
"""

import math

import mpmath
import numpy as np
import pytest

from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate

AXEBOT = load_robot("axebot")
SLIDE, HOLD, VISCOUS, MASS = 2.2, 2.8, 0.94, AXEBOT.body.mass
INDUCTANCE, RESISTANCE, BELT = 0.05, 1e-6, 0.02  # H, the least ohms of a robot file, m/s
KAPPA = 19.0 * 0.0059 / 0.035
SPRING = 1.5 * KAPPA**2 / INDUCTANCE
LEAK = RESISTANCE / INDUCTANCE  # 1/s
FALL = {"stribeck_speed": (0.05, 0.05, 0.5)}
LAWS = {"Coulomb and breakaway": {}, "Stribeck": FALL}
DIGITS = 30
DT, ROWS = 5e-3, 620


def dragged(**law):
    axes = AxesFriction(viscous=(VISCOUS, 0.96, 0.01), coulomb=(SLIDE, 1.5, 0.099), breakaway=(HOLD, 1.9, 0.13), **law)
    motor = AXEBOT.motor.replace(resistance=RESISTANCE, inductance=INDUCTANCE, electrical="dynamic")
    return AXEBOT.replace(motor=motor, friction=Friction(axes=axes))


def until_it_slips(force):
    """Seconds, from F, of a body that sticks: F' = k V - (R/L) F."""
    end = SPRING * BELT / LEAK
    return mpmath.log((end - force) / (end - mpmath.mpf(HOLD))) / LEAK


def cycle(falls):
    """The period [s] by Taylor's series: no step of ours, and no event of ours."""
    level = mpmath.mpf(SLIDE)

    def rates(_, state):
        v, force = state
        above = mpmath.mpf(HOLD) - level if falls else mpmath.mpf(0)
        slide = level + above * mpmath.exp(-((v / mpmath.mpf(0.05)) ** 2))
        return [(force - mpmath.mpf(VISCOUS) * v - slide) / MASS, SPRING * (BELT - v) - LEAK * force]

    path = mpmath.odefun(rates, 0, [mpmath.mpf(0), mpmath.mpf(HOLD)])
    at = step = mpmath.mpf("0.01")
    while path(at + step)[0] > 0:
        at += step
    while abs(step) > mpmath.mpf(10) ** (5 - DIGITS):  # Newton: v' is known
        step = -path(at)[0] / rates(at, path(at))[0]
        at += step
        assert abs(step) < 0.02
    return at + until_it_slips(path(at)[1])


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.some(1)
def test_a_mass_on_a_spring_sticks_and_slips_as_often_as_its_series_does(name):
    """Each of five cycles, between two rows at which the simulated body is about to break loose. 5e-10 s measured."""
    with mpmath.workdps(DIGITS):
        period, first = float(cycle(name == "Stribeck")), float(until_it_slips(mpmath.mpf(0)))
    volt = 0.5 * math.sqrt(3.0) * KAPPA * BELT
    run = simulate(dragged(**LAWS[name]), np.tile([0.0, volt, -volt], (ROWS, 1)), DT, tol=1e-8)
    stuck, force = run.twist[:, 0] == 0.0, math.sqrt(3.0) * KAPPA * run.current[:, 1]
    last = np.flatnonzero(stuck[:-1] & ~stuck[1:])  # rows before it breaks loose
    loose = run.t[last] + [float(until_it_slips(mpmath.mpf(each))) for each in force[last]]
    assert len(loose) == 6
    assert loose[0] == pytest.approx(first, abs=1e-9)
    np.testing.assert_allclose(np.diff(loose), period, rtol=0.0, atol=1e-9)
    assert not run.warnings
