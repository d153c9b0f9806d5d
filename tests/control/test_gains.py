"""The poles of the closed loop stand where they were asked for: eigenvalues of the step, from the exact matrices."""

import numpy as np
import pytest

import omnidyn
from omnidyn.control.pid import Pid
from omnidyn.control.pole_placement import SWIFT, check_faster, check_integral, pole_rate, pose_gains, speed_gains
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
    with pytest.raises(InputError, match="faster: not a speed for a loop; got nan"):
        check_faster(float("nan"))
    with pytest.raises(InputError, match="integral: not a share for the slow pole; got 2"):
        check_integral(2)


@pytest.mark.parametrize("faster", [0.3, 3.0, 20.0])
@pytest.mark.parametrize("latency", [0.0, 0.01, 0.02, 0.03, 0.04])
@pytest.mark.parametrize("name", ["axebot", "mecanum"])
def test_friction_is_compensated_towards_the_path(name, latency, faster):
    """Off a path that stands still, the direction of friction is the way back, no faster than steps allow."""
    robot = omnidyn.load_robot(name)
    loop = Pid(robot.replace(drive=robot.drive.replace(latency=latency)), faster=faster)
    off = np.array([2e-3, -1e-3, 3e-3])
    way = loop.aim(off, np.array(0.0), np.zeros(3), np.zeros((3, 3))).friction_twist
    assert np.all(way * off > 0.0)
    assert np.all(np.abs(way) <= np.abs(off) / loop.dt)


@pytest.mark.parametrize("latency", [0.02, 0.03])
def test_a_turning_path_is_followed_where_an_axis_is_faster_than_the_loop_may_be(latency):
    robot = omnidyn.load_robot("mecanum")
    robot = robot.replace(drive=robot.drive.replace(latency=latency))
    assert Pid(robot).gains.speed[2] < 0.0  # of that axis friction was once compensated away from the path
    turning = omnidyn.path("eight:period_s=12,heading=turning,turn_rad_s=0.5")
    assert omnidyn.track(robot, turning, "pid").rmse_heading <= 5e-4
