"""Wheels against the printed eqs (3), (7)-(9), mpmath, and the mecanum formula of the textbooks."""

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.errors import InputError
from omnidyn.model.wheels import (
    Wheels,
    rim_speed,
    sin_cos_deg,
    twist_from_wheel_speed,
    wheel_speed,
    wrench_from_traction,
)


def test_wrench_matrix_is_the_printed_one(axebot):
    """Eqs (7)-(9), d = 30 degrees: F_v = (f2 - f3) cos d; F_vn = -f1 + (f2 + f3) sin d; T = b (f1 + f2 + f3)."""
    cos, sin, b = np.sqrt(3) / 2, 0.5, 0.1
    printed = np.array([[0.0, cos, -cos], [-1.0, sin, sin], [b, b, b]])
    np.testing.assert_array_equal(axebot.wheels.wrench_matrix, printed)


def test_wheels_that_should_not_turn_do_not(axebot):
    """Driving forward does not turn wheel 1 of the paper's robot: bitwise, whatever the speed."""
    speeds = wheel_speed(axebot.wheels, [[0.37, 0.0, 0.0], [1e9, 0.0, 0.0]])
    assert (speeds[:, 0] == 0.0).all()
    assert (wrench_from_traction(axebot.wheels, [0.7, 0.7, 0.7])[:2] == 0.0).tolist() == [True, True]


def test_eq_3_with_its_sign_put_right(axebot):
    """Rows of eq (3): v = r sqrt(3)/3 (w2 - w3); v_n = -2r/3 w1 + r/3 (w2 + w3) (printed +2r/3); w = r/(3 b) sum."""
    r, b = 0.035, 0.1
    w = np.array([3.0, -1.0, 7.0])
    expected = [
        r * np.sqrt(3) / 3 * (w[1] - w[2]),
        -2 * r / 3 * w[0] + r / 3 * (w[1] + w[2]),
        r / (3 * b) * w.sum(),
    ]
    np.testing.assert_allclose(twist_from_wheel_speed(axebot.wheels, w), expected, rtol=1e-14, atol=1e-16)


def test_wheel_speed_and_back(four_wheel):
    twist = np.array([[0.3, -0.2, 1.7], [-1.0, 0.5, 0.0]])
    np.testing.assert_allclose(
        twist_from_wheel_speed(four_wheel.wheels, wheel_speed(four_wheel.wheels, twist)), twist, atol=1e-15
    )


def test_unequal_radii_are_each_wheels_own():
    wheels = Wheels(azimuth_deg=[180.0, -60.0, 60.0], robot_radius=[0.1, 0.2, 0.3], wheel_radius=[0.03, 0.04, 0.05])
    np.testing.assert_allclose(wheel_speed(wheels, [0.0, 0.0, 6.0]), [0.6 / 0.03, 1.2 / 0.04, 1.8 / 0.05], rtol=1e-15)


def test_mecanum():
    """Front left, front right, rear left, rear right: rim speed vx -+ vy -+ (half track + half base) w forward.

    Source: any textbook, e.g. Lynch & Park, Modern Robotics, 13.2. A wheel on the left turns backward with a
    positive speed here, as every wheel pushes counter-clockwise: the sign of the two left ones is turned.
    """
    length = 0.25
    wheels = Wheels(
        azimuth_deg=[90.0, -90.0, 90.0, -90.0],
        robot_radius=length,
        wheel_radius=0.05,
        roller_angle_deg=[-45.0, 45.0, 45.0, -45.0],
    )
    x, y, w = 0.4, 0.3, 2.0
    textbook = [-(x - y - length * w), x + y + length * w, -(x + y - length * w), x - y + length * w]
    np.testing.assert_allclose(rim_speed(wheels, [x, y, w]), textbook, rtol=1e-15)


def exact(angle):
    """(sine, cosine) of degrees, 30 digits, rounded once."""
    with mp.workdps(30):
        return float(mp.sinpi(mp.mpf(angle) / 180)), float(mp.cospi(mp.mpf(angle) / 180))


@pytest.mark.parametrize("angle", range(-720, 721, 30))
def test_multiples_of_30_degrees_are_exact(angle):
    """Zeros, halves and ones bitwise; the rest is the double nearest to sqrt(3)/2, the same in every quadrant."""
    sin, cos = map(float, sin_cos_deg(float(angle)))
    assert (sin, cos) == exact(angle)
    assert abs(sin) in {0.0, 0.5, 1.0, float(np.sqrt(3.0) / 2.0)}


@given(st.floats(-360.0, 360.0))
def test_sine_and_cosine_of_degrees_against_mpmath(angle):
    np.testing.assert_allclose(np.array(sin_cos_deg(angle)), exact(angle), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"azimuth_deg": [0.0, 0.0, 0.0]}, "cannot move the robot in every direction"),
        ({"azimuth_deg": [0.0, 180.0, 0.0]}, "cannot move the robot in every direction"),
        ({"azimuth_deg": [0.0, 120.0]}, "at least 3"),
        ({"azimuth_deg": [float(i) for i in range(17)]}, "at most 16"),
        ({"wheel_radius": [0.1, 0.1]}, "wheel_radius has 2 values"),
        ({"wheel_radius": 0.0}, "greater than or equal to 0.001"),
        ({"robot_radius": -0.1}, "greater than or equal to 0.001"),
        ({"roller_angle_deg": 90.0}, "less than or equal to 80"),
    ],
)
def test_wheels_that_cannot_be(axebot, changes, words):
    with pytest.raises(InputError, match=words):
        axebot.wheels.replace(**changes)


@pytest.mark.parametrize("angle", [30.1, 0.99999, 12.3])
def test_mirrored_angles_have_mirrored_sines(angle):
    """Wheels at +phi and -phi must get equal numbers, or a symmetric robot driving straight turns a little."""
    sin, cos = sin_cos_deg([angle, -angle])
    assert sin[1] == -sin[0]
    assert cos[1] == cos[0]
