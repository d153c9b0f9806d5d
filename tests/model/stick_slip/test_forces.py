"""The current of a motor at the end of a stage, by hand: i = (L i* + tau (u - E s) -+ tau V_d)/(L + tau R), clipped."""

import numpy as np
import pytest

from omnidyn.model.stick_slip.forces import NO_CURRENT, winding, winding_answer, winding_branch

EMF, RESISTANCE, TAU = 2.0, 4.0, 0.5


@pytest.mark.parametrize("inductance", [0.0, 0.3])
@pytest.mark.parametrize("now, voltage, speed", [(0.0, 0.0, 0.0), (0.0, 3.0, 1.5), (0.7, 1.0, -2.0)])
def test_without_a_drop_the_slope_never_vanishes(inductance, now, voltage, speed):
    """Also where no current flows, as in a wheel that nothing drives: it brakes as soon as it turns."""
    i, slope = winding(speed, voltage, now, TAU, EMF, RESISTANCE, inductance, 0.0, np.inf)
    below = inductance + TAU * RESISTANCE
    assert i == pytest.approx((inductance * now + TAU * (voltage - EMF * speed)) / below, rel=1e-15)
    assert slope == pytest.approx(-TAU * EMF / below, rel=1e-15)


@pytest.mark.parametrize("voltage, expected", [(0.0, 0.0), (0.5, 0.0), (-0.5, 0.0), (0.7, 0.05), (-0.7, -0.05)])
def test_within_its_drop_no_current_flows(voltage, expected):
    i, slope = winding(0.0, voltage, 0.0, TAU, EMF, RESISTANCE, 0.0, 0.5, np.inf)
    assert i == pytest.approx(expected, rel=1e-12)
    assert slope == (0.0 if expected == 0.0 else -EMF / RESISTANCE)


@pytest.mark.parametrize("voltage, expected", [(3.9, 0.975), (4.1, 1.0), (-100.0, -1.0)])
def test_at_its_limit_the_current_stays(voltage, expected):
    i, slope = winding(0.0, voltage, 0.0, TAU, EMF, RESISTANCE, 0.0, 0.0, 1.0)
    assert i == pytest.approx(expected, rel=1e-15)
    assert slope == (0.0 if abs(expected) == 1.0 else -EMF / RESISTANCE)


@pytest.mark.parametrize(
    "voltage, branch", [(0.4, NO_CURRENT), (0.7, 1.0), (-0.7, -1.0), (4.4, 1.0), (4.6, 2.0), (-4.6, -2.0)]
)
def test_a_branch_goes_on_beyond_its_ends(voltage, branch):
    """With a drop of 0.5 V and a limit of 1 A, the branch of one voltage asked about another."""
    rest = (0.0, TAU, EMF, RESISTANCE, 0.0, 0.5, 1.0)
    assert winding_branch(0.0, voltage, *rest) == branch
    for other in (-5.0, -0.1, 0.1, 5.0):
        side = np.sign(branch)
        expected = {NO_CURRENT: 0.0, 1.0: (other - side * 0.5) / RESISTANCE, 2.0: side}[abs(branch)]
        i, slope = winding_answer(branch, 0.0, other, *rest)
        assert i == pytest.approx(expected, abs=1e-15)
        assert slope == (-EMF / RESISTANCE if abs(branch) == 1.0 else 0.0)


def test_a_motor_that_coasts_feels_no_speed():
    """A limit of 0, even where the voltage alone drives no current."""
    assert winding(0.0, 0.0, 0.0, TAU, EMF, RESISTANCE, 0.0, 0.0, 0.0) == (0.0, 0.0)
