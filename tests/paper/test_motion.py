"""Claims on (4)-(6), (13), (14) and I_n against the written-out (13) and scipy alone."""

import numpy as np
import pytest
from scipy.optimize import fsolve

from omnidyn.paper.motion import creep, motion_claims, settled_in_turning_frame
from tests.paper import printed


def test_state_space_is_the_printed_13(claims):
    a, b, k = printed.eq_13()
    numbers = claims["state-space"].numbers
    np.testing.assert_allclose(numbers["A"], a, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(numbers["B"], b, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(numbers["K"], k, rtol=1e-12, atol=1e-15)


def test_numbers_that_follow_from_table_3(claims):
    """EVIDENCE.md, section 1."""
    numbers = claims["state-space"].numbers
    assert np.diag(numbers["A"]).round(4).tolist() == [-6.6967, -6.71, -7.684]
    wanted = [[0, 1.0942, -1.0942], [-1.2635, 0.6317, 0.6317], [7.5807, 7.5807, 7.5807]]
    assert np.round(numbers["B"], 4).tolist() == wanted
    assert np.diag(numbers["K"]).round(4).tolist() == [-1.4667, -1.0, -3.96]
    assert np.round(numbers["time_constants"], 4).tolist() == [0.1493, 0.1490, 0.1301]
    assert claims["state-space"].verdict == "reproduced"


def turning(twist, volts):
    """Steady balance in a turning frame, all axes sliding, from the written-out (13)."""
    a, b, k = printed.eq_13()
    x, y, omega = twist
    return a @ twist + b @ volts + k @ np.sign(twist) + [omega * y, -omega * x, 0.0]


def test_turning_frame_example(claims):
    """EVIDENCE.md: (1.088, 0, 3.92) without the terms, (0.875, -0.363, 3.92) with them; 7.5 N."""
    numbers = claims["turning-frame"].numbers
    volts = np.array([1.5, 5.5, -2.5])
    assert np.round(numbers["settled_without"], 3).tolist() == [1.088, 0.0, 3.924]
    assert np.round(numbers["settled_with"], 3).tolist() == [0.875, -0.363, 3.924]
    assert numbers["settled_without"] == pytest.approx(printed.settled(volts), abs=1e-12)
    found = fsolve(turning, [1.0, -0.1, 4.0], args=(volts,), xtol=1e-13)
    assert numbers["settled_with"] == pytest.approx(found, abs=1e-9)
    assert numbers["force"] == pytest.approx(1.5 * 5 * 1)
    assert numbers["coulomb"] == 2.2
    assert claims["turning-frame"].verdict == "reproduced after a correction"


def test_turning_frame_reached_in_time(axebot):
    """The root is where the robot really goes: small steps of the hand-written law end there."""
    volts, twist = np.array([1.5, 5.5, -2.5]), np.array([0.5, -0.1, 1.0])
    for _ in range(4000):
        twist = twist + 5e-4 * turning(twist, volts)
    np.testing.assert_allclose(settled_in_turning_frame(axebot, volts), twist, atol=1e-5)


def test_sign_of_zero_creeps(claims):
    """At 0.5 V: 2 * 1.0942 * 0.5 m/s^2 at rest, in the dead zone. The creep falls with the step: it is not physics."""
    claim = claims["sign-at-rest"]
    assert claim.verdict == "reproduced after a correction"
    assert claim.numbers["acceleration_as_printed"] == pytest.approx(1.0942, abs=5e-5)
    assert claim.numbers["acceleration"] == 0.0
    assert 0.005 < claim.numbers["creep"] < 0.02
    assert claim.numbers["creep"] / claim.numbers["creep_finer_step"] == pytest.approx(10, rel=0.05)


def test_creep_by_numpy(axebot):
    a, b, k = printed.eq_13()
    volts, v, x = np.array([0.0, 0.5, -0.5]), np.zeros(3), 0.0
    for _ in range(1000):
        x += 1e-3 * v[0]
        v = v + 1e-3 * (a @ v + b @ volts + k @ np.sign(v))
    assert creep(axebot, volts, 1.0, 1e-3) == pytest.approx(x, rel=1e-6)


def test_a33_has_one_inertia(claims):
    assert claims["inertia-symbol"].numbers["divided_by"] == pytest.approx(2.0, abs=1e-12)
    assert claims["inertia-symbol"].verdict == "reproduced after a correction"


def test_inertia_of_a_cylinder(claims):
    """EVIDENCE.md: M b^2/2 = 0.0075; 0.025 needs a radius of 0.18 m."""
    numbers = claims["inertia"].numbers
    assert numbers["cylinder"] == pytest.approx(0.0075)
    assert round(numbers["radius_needed"], 2) == 0.18
    assert numbers["settling"][0] == pytest.approx(0.1301, abs=5e-5)
    assert claims["inertia"].verdict == "cannot be reproduced"


def test_inertia_of_the_cylinder_itself_would_be_reproduced(axebot):
    cylinder = axebot.replace(body=axebot.body.replace(inertia=0.0075))
    claim = next(claim for claim in motion_claims(cylinder) if claim.key == "inertia")
    assert claim.verdict == "reproduced"


def test_power_balance(claims):
    a, b, k = printed.eq_13()
    twist, volts = np.array([0.4, 0.7, 2.0]), np.array([1.0, -3.0, 2.5])
    mass = np.array([1.5, 1.5, 0.025])
    gained = mass * twist @ (a @ twist + b @ volts + k @ np.sign(twist))
    assert claims["dynamics"].numbers["power_gained"] == pytest.approx(gained, abs=1e-11)
    assert claims["dynamics"].verdict == "reproduced"


def test_output(claims):
    assert claims["output"].numbers["C"] == np.eye(3).tolist()
