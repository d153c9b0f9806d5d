"""Claims on (10)-(12) against the printed equations with the numbers of Table 3."""

import numpy as np
import pytest

from omnidyn.paper.motors import motor_claims, power_of_gear
from tests.paper import printed


def test_traction(claims):
    numbers = claims["traction"].numbers
    assert numbers["torque_per_ampere"] == pytest.approx([19 * 0.0059] * 3)
    assert numbers["force_per_ampere"] == pytest.approx([19 * 0.0059 / 0.035] * 3)


def test_gear_in_the_back_emf(claims):
    """(13) has l^2 in A only with the gear ratio in (11): both versions written out."""
    claim = claims["back-emf"]
    assert claim.numbers["a_with_gear"] == pytest.approx(np.diag(printed.eq_13(1)[0]))
    assert claim.numbers["a_as_printed"] == pytest.approx(np.diag(printed.eq_13(0)[0]))
    assert claim.numbers["power_with_gear"] == pytest.approx([2, 1], abs=1e-12)
    assert claim.numbers["power_as_printed"] == pytest.approx([1, 1], abs=1e-12)
    assert claim.verdict == "reproduced after a correction"


def test_power_of_gear_does_not_depend_on_friction(axebot):
    assert power_of_gear(axebot, False) == pytest.approx((2, 1), abs=1e-12)


def test_inductance(claims):
    """EVIDENCE.md: L/R = 65 us."""
    numbers = claims["inductance"].numbers
    assert round(1e6 * numbers["electrical_time_constant"]) == 65
    assert numbers["ratios"] == pytest.approx(np.array([0.1493, 0.1490, 0.1301]) / (0.00011 / 1.69), rel=5e-4)
    assert claims["inductance"].verdict == "reproduced"


def test_currents_of_table_4(claims):
    """By hand: i = (u - l K_t w)/R at the settled speeds. One wheel in nine runs of three is negative in x and y."""
    currents = []
    for axis in printed.AXES:
        for level in (2.0, 3.0, 4.0):
            volts = level * np.array(printed.PATTERN[axis])
            wheel = printed.eqs_7_to_9().T @ printed.settled(volts) / printed.R_WHEEL
            currents.append((volts - printed.GEAR * printed.K_T * wheel) / printed.R_A)
    numbers = claims["current-sign"].numbers
    np.testing.assert_allclose(numbers["currents"], currents, atol=1e-12)
    assert (numbers["negative"], numbers["zero"], numbers["count"]) == (6, 3, 27)
    assert claims["current-sign"].verdict == "reproduced after a correction"


def test_current_limit(claims):
    """EVIDENCE.md: stall at 6 V is 3.55 A; i_max has no printed value. Table 4 starts with 4 V / 1.69 ohm."""
    claim = claims["current-limit"]
    assert round(claim.numbers["stall_current"], 2) == 3.55
    assert claim.numbers["largest_starting_current"] == pytest.approx(4 / 1.69)
    assert claim.verdict == "not in the text we have"


def test_claims_follow_the_robot(axebot):
    """The numbers are computed: another resistance gives another stall current."""
    other = axebot.replace(motor=axebot.motor.replace(resistance=2.0))
    stall = next(claim for claim in motor_claims(other) if claim.key == "current-limit")
    assert stall.numbers["stall_current"] == 3.0
    assert "3.00 A" in stall.why
