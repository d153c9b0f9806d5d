"""The band of a run: its width by hand where the run is smooth, none where all is known, and the dead zone in it."""

import numpy as np
import pytest
from scipy.stats import norm

import omnidyn
from omnidyn.errors import InsufficientDataError
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.keys import Key
from omnidyn.model.known.told import with_correlation
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.band import confidence_band, first_order_band
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
    low, high, draws = confidence_band(known(robot, key, 0.022), FORWARD, 2e-3)
    step = 0.01
    up, down = (simulate(Key.parse(key).set(robot, 2.2 + sign * step), FORWARD, 2e-3) for sign in (1.0, -1.0))
    slope = (up.twist[:, 0] - down.twist[:, 0]) / (2.0 * step)
    np.testing.assert_allclose(high.twist[:, 0] - low.twist[:, 0], -2.0 * Z * 0.022 * slope, rtol=0.02, atol=1e-9)
    np.testing.assert_allclose(
        high.pose[-1, 0] - low.pose[-1, 0], Z * 0.022 * abs(up.pose[-1, 0] - down.pose[-1, 0]) / step, rtol=0.02
    )
    assert draws == 100


def test_what_all_is_known_of_has_no_width():
    run = simulate(AXEBOT, FORWARD, 2e-3)
    low, high, _ = confidence_band(known(AXEBOT, "friction.axes.coulomb[1]", 0.1), FORWARD, 2e-3)
    for name in ("voltage", "current", "wheel_speed", "twist", "pose"):
        np.testing.assert_array_equal(getattr(low, name), getattr(run, name))
        np.testing.assert_array_equal(getattr(high, name), getattr(run, name))


def test_a_robot_that_may_or_may_not_move():
    """0.66 V for a dead zone of 0.67 +- 0.03 V: no slope at all, and yet it may move."""
    volts = np.tile([0.0, 0.66, -0.66], (300, 1))
    assert not simulate(AXEBOT, volts, 2e-3).twist.any()
    low, high, _ = confidence_band(known(AXEBOT, C_X["axes"], 0.1), volts, 2e-3)
    assert not low.twist.any()
    assert high.twist[-1, 0] > 0.01


def test_the_same_seed_is_the_same_band_whatever_the_threads(monkeypatch):
    robot = AXEBOT.replace(priors={"motor.resistance_ohm": Prior(std=0.1), C_X["axes"]: Prior(std=0.1)})
    one = confidence_band(robot, FORWARD, 2e-3, draws=20)
    assert one == confidence_band(robot, FORWARD, 2e-3, draws=20)
    monkeypatch.setattr("os.cpu_count", lambda: 1)
    assert one == confidence_band(robot, FORWARD, 2e-3, draws=20)
    assert one.high != confidence_band(robot, FORWARD, 2e-3, draws=20, rng=1).high


def test_it_takes_what_simulate_takes():
    robot = known(load_robot("robotino"), "drive.kp_V_s_rad", 1.0)
    commands = np.tile([0.5, 0.0, -0.5], (20, 1))
    low, high, _ = omnidyn.confidence_band(
        robot, wheel_speed_command=commands, dt=0.01, draws=20, twist=(0.1, 0.0, 0.0)
    )
    assert (high.voltage[1] > low.voltage[1]).any()
    np.testing.assert_array_equal(low.twist[0], high.twist[0])


def test_a_robot_without_std_has_no_band():
    with pytest.raises(InsufficientDataError, match="nothing says how far the numbers of this robot may be off"):
        confidence_band(AXEBOT, FORWARD, 2e-3)


# ---- to first order ---------------------------------------------------------------------------------------


def first_order(robot, dt=2e-3):
    return first_order_band(robot, simulate(robot, FORWARD, dt), lambda each: simulate(each, FORWARD, dt, tol=None))


@pytest.mark.parametrize("robot, key", [(AXEBOT, C_X["axes"]), (ELLIPSE, C_X["direction"])], ids=["exact", "implicit"])
def test_the_first_order_is_the_closed_form(robot, key):
    """M dv/dt = F - C - (k G G' + B) v: from rest v = (F - C)/b (1 - exp(-b t/M)), and so is dv/dC."""
    low, high, _ = first_order(known(robot, key, 0.022))
    pull = (robot.motor.gear_ratio * robot.motor.torque_constant / robot.wheels.wheel_radius) ** 2
    damping = 1.5 * pull / robot.motor.resistance + (0.94 if robot is AXEBOT else 0.0)
    slope = -np.expm1(-damping * low.t / robot.body.mass) / damping
    np.testing.assert_allclose(high.twist[:, 0] - low.twist[:, 0], 2.0 * Z * 0.022 * slope, rtol=2e-3, atol=1e-9)
    np.testing.assert_allclose(high.twist[:, 0] + low.twist[:, 0], 2.0 * simulate(robot, FORWARD, 2e-3).twist[:, 0])


def test_what_is_known_together_is_known_however_little_each_is():
    """A log sees the sum of the inertias of body and rotors: either is hardly known, and the run is."""
    ratio = 3.0 * AXEBOT.motor.gear_ratio**2 * (AXEBOT.wheels.robot_radius / AXEBOT.wheels.wheel_radius) ** 2
    rotor = 1e-3 * AXEBOT.body.inertia / ratio
    keys, std = ("body.inertia_kg_m2", "motor.rotor_inertia_kg_m2"), 0.02 * AXEBOT.body.inertia
    robot = AXEBOT.replace(
        body=AXEBOT.body.replace(inertia=AXEBOT.body.inertia - ratio * rotor),
        motor=AXEBOT.motor.replace(rotor_inertia=rotor),
        priors={keys[0]: Prior(std=std), keys[1]: Prior(std=std / ratio)},
    )
    together = with_correlation(robot, keys, [[1.0, -1.0], [-1.0, 1.0]])
    turning = np.full((100, 3), 3.0)

    def width(robot, band_of_it):
        return np.ptp([end.twist[:, 2] for end in band_of_it(robot)[:2]], axis=0).max()

    def sloped(robot):
        run = simulate(robot, turning, 5e-3)
        return first_order_band(robot, run, lambda each: simulate(each, turning, 5e-3, tol=None))

    assert width(together, sloped) < 1e-6 < 1e-2 < width(robot, sloped)
    assert width(together, lambda each: confidence_band(each, turning, 5e-3)) > 100.0 * width(together, sloped)


def test_a_number_at_the_end_of_its_range_has_one_side():
    lossless = known(AXEBOT, "motor.gear_efficiency", 0.1)
    low, high, _ = first_order(lossless)
    down = simulate(Key.parse("motor.gear_efficiency").set(AXEBOT, 0.999), FORWARD, 2e-3)
    slope = (simulate(AXEBOT, FORWARD, 2e-3).twist[-1, 0] - down.twist[-1, 0]) / 0.001
    np.testing.assert_allclose(high.twist[-1, 0] - low.twist[-1, 0], 2.0 * Z * 0.1 * slope, rtol=0.01)
