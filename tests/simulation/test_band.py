"""The band of a run: its width by hand where the run is smooth, none where all is known, and the dead zone in it."""

import numpy as np
import pytest
from scipy.stats import norm

import omnidyn
from omnidyn.errors import InsufficientDataError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.band import band
from omnidyn.simulation.simulate import simulate

AXEBOT = load_robot("axebot")
ELLIPSE = AXEBOT.replace(friction=Friction(direction=DirectionFriction(coulomb=(2.2, 1.5), yaw_coulomb=0.099)))
Z = norm.ppf(0.975)
C_X = {"axes": "friction.axes.coulomb[0]", "direction": "friction.direction.coulomb[0]"}
FORWARD = np.tile([0.0, 3.0, -3.0], (300, 1))


def known(robot, key, std):
    return robot.replace(priors={key: Prior(std=std)})


@pytest.mark.parametrize("robot, key", [(AXEBOT, C_X["axes"]), (ELLIPSE, C_X["direction"])], ids=["exact", "implicit"])
def test_the_width_is_that_of_the_slope(robot, key):
    """Sliding forward: v is linear in C_x."""
    low, high, draws = band(known(robot, key, 0.022), FORWARD, 2e-3)
    step = 0.01
    up, down = (simulate(Key.parse(key).set(robot, 2.2 + sign * step), FORWARD, 2e-3) for sign in (1.0, -1.0))
    slope = (up.twist[:, 0] - down.twist[:, 0]) / (2.0 * step)
    np.testing.assert_allclose(high.twist[:, 0] - low.twist[:, 0], -2.0 * Z * 0.022 * slope, rtol=0.02, atol=1e-9)
    np.testing.assert_allclose(high.pose[-1, 0] - low.pose[-1, 0],
                               Z * 0.022 * abs(up.pose[-1, 0] - down.pose[-1, 0]) / step, rtol=0.02)  # fmt: skip
    assert draws == 100


def test_what_all_is_known_of_has_no_width():
    run = simulate(AXEBOT, FORWARD, 2e-3)
    low, high, _ = band(known(AXEBOT, "friction.axes.coulomb[1]", 0.1), FORWARD, 2e-3)
    for name in ("voltage", "current", "wheel_speed", "twist", "pose"):
        np.testing.assert_array_equal(getattr(low, name), getattr(run, name))
        np.testing.assert_array_equal(getattr(high, name), getattr(run, name))


def test_a_robot_that_may_or_may_not_move():
    """0.66 V for a dead zone of 0.67 +- 0.03 V: no slope at all, and yet it may move."""
    volts = np.tile([0.0, 0.66, -0.66], (300, 1))
    assert not simulate(AXEBOT, volts, 2e-3).twist.any()
    low, high, _ = band(known(AXEBOT, C_X["axes"], 0.1), volts, 2e-3)
    assert not low.twist.any()
    assert high.twist[-1, 0] > 0.01


def test_the_same_seed_is_the_same_band_whatever_the_threads(monkeypatch):
    robot = AXEBOT.replace(priors={"motor.resistance_ohm": Prior(std=0.1), C_X["axes"]: Prior(std=0.1)})
    one = band(robot, FORWARD, 2e-3, draws=20)
    assert one == band(robot, FORWARD, 2e-3, draws=20)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    assert one == band(robot, FORWARD, 2e-3, draws=20)
    assert one.high != band(robot, FORWARD, 2e-3, draws=20, seed=1).high


def test_it_takes_what_simulate_takes():
    robot = known(load_robot("robotino"), "drive.kp_V_s_rad", 1.0)
    commands = np.tile([0.5, 0.0, -0.5], (20, 1))
    low, high, _ = omnidyn.band(robot, wheel_speed_command=commands, dt=0.01, draws=20, twist=(0.1, 0.0, 0.0))
    assert (high.voltage[1] > low.voltage[1]).any()
    np.testing.assert_array_equal(low.twist[0], high.twist[0])


def test_a_robot_without_std_has_no_band():
    with pytest.raises(InsufficientDataError, match="nothing says how far the numbers of this robot may be off"):
        band(AXEBOT, FORWARD, 2e-3)
