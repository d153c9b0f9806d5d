"""The poles of the closed loop stand where they were asked for: eigenvalues of the step, from the exact matrices."""

import numpy as np
import pytest

from omnidyn.control.speed_loop import SWIFT, check_faster, check_integral, pole_rate, pose_gains, speed_gains
from omnidyn.errors import InputError

RATES = np.array([6.7, 2.0, 11.0])


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.02])
@pytest.mark.parametrize("integral", [0.0, 0.1, 0.7])
def test_poles_of_the_pose_loop(dt, integral):
    gains, rate = pose_gains(RATES, 2.0, integral, dt), pole_rate(RATES, 2.0, dt)
    for k, a in enumerate(RATES):
        d, phi = np.exp(-a * dt), (1.0 - np.exp(-a * dt)) / a
        move = np.array([[1.0, phi, 0.0], [0.0, d, 0.0], [dt, 0.0, 1.0]])
        push = np.array([-(dt - phi) / a, -phi, 0.0])
        row = np.array([gains.place[k] + dt * gains.sum[k], gains.speed[k], gains.sum[k]])
        poles = np.linalg.eigvals(move + np.outer(push, row))
        wanted = np.exp(-dt * rate[k] * np.array([1.0, 1.0, integral]))
        np.testing.assert_allclose(np.poly(poles), np.poly(wanted), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("dt", [0.001, 0.02])
def test_poles_of_the_speed_loop(dt):
    gains, rate = speed_gains(RATES, 3.0, dt), pole_rate(RATES, 3.0, dt)
    for k, a in enumerate(RATES):
        d, phi = np.exp(-a * dt), (1.0 - np.exp(-a * dt)) / a
        # e+ = d e - phi (k e + k_i sum+), sum+ = sum + dt e
        step = np.array([[d - phi * (gains.speed[k] + gains.sum[k] * dt), -phi * gains.sum[k]], [dt, 1.0]])
        np.testing.assert_allclose(np.poly(step), np.poly(np.full(2, np.exp(-rate[k] * dt))), rtol=1e-9)


def test_no_loop_is_faster_than_its_steps_allow():
    np.testing.assert_allclose(pole_rate(RATES, 1000.0, 0.02), SWIFT / 0.02)


def test_gains_out_of_range_are_refused():
    with pytest.raises(InputError, match="faster: no speed for a loop; got nan"):
        check_faster(float("nan"))
    with pytest.raises(InputError, match="integral: no share for the slow pole; got 2"):
        check_integral(2)
