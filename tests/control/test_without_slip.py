"""Wheels that may slip: controllers keep currents to what the floor takes, so that their wheels roll."""

import numpy as np
import pytest

import omnidyn
from omnidyn.control.without_slip import without_slip
from omnidyn.errors import UnsupportedError
from tests.support.codes import codes

AXEBOT = omnidyn.load_robot("axebot")


def gripping(mu, **motor):
    wheels = AXEBOT.wheels.replace(traction_mu=mu, wheel_inertia=2e-6)
    return AXEBOT.replace(wheels=wheels, motor=AXEBOT.motor.replace(**motor))


def test_a_motor_pushes_no_harder_than_its_wheel_can_hold():
    """By hand: mu m g/3 at the rim, times its radius, over gear ratio and torque constant."""
    motor, wheels = AXEBOT.motor, AXEBOT.wheels
    amperes = 0.5 * AXEBOT.body.mass * 9.81 / 3.0 * wheels.wheel_radius / (motor.gear_ratio * motor.torque_constant)
    believed = without_slip(gripping(0.5))
    assert believed.wheels.traction_mu is None
    np.testing.assert_allclose(believed.motor.current_limit, amperes, rtol=1e-12)
    np.testing.assert_allclose(without_slip(gripping(0.5, current_limit=0.1)).motor.current_limit, 0.1)


def test_a_robot_that_never_slips_stays_as_it_is():
    assert without_slip(AXEBOT) is AXEBOT


def test_the_mpc_that_knows_the_floor_corners_better():
    """On the same slippery floor, beside the MPC that believes that wheels always roll."""
    floor = gripping(0.6)
    knows = omnidyn.track(floor, "square", "mpc", plant=floor).rmse_position
    believes = omnidyn.track(gripping(None), "square", "mpc", plant=floor).rmse_position
    assert knows < 0.4 * believes


@pytest.mark.parametrize("controller", ["pid", "speed", "feedforward"])
@pytest.mark.some(2)
def test_the_others_drive_it_too(controller):
    floor = gripping(0.8)
    known = omnidyn.track(floor, "circle", controller, plant=floor)
    assert np.isfinite(known.rmse_position)


def test_a_run_says_which_wheels_slipped():
    """As `simulate` does of the same voltages; a grip that is enough is nothing to speak of."""
    floor = gripping(0.2)
    found = omnidyn.track(gripping(None), "square:speed_m_s=0.5", "pid", plant=floor)
    again = omnidyn.simulate(floor, found.run.voltage[:-1], found.dt, pose=found.run.pose[0])
    assert "wheels_slip" in codes(found.run.warnings)
    assert found.run.warnings == again.warnings
    assert str(found.run.warnings[-1]) in found.summary()
    held = omnidyn.track(AXEBOT, "circle", "pid", plant=gripping(9.0))
    assert "wheels_slip" not in codes(held.run.warnings)


def test_a_path_asks_no_more_than_the_floor_takes():
    """The current at which a wheel slips is a limit, as that of a motor is: a floor that takes half as much."""
    asked = omnidyn.path_demand(AXEBOT, "eight:period_s=4")
    assert asked.follows
    assert not asked.grip
    amperes = (
        0.1
        * AXEBOT.body.mass
        * 9.81
        / 3.0
        * AXEBOT.wheels.wheel_radius
        / (AXEBOT.motor.gear_ratio * AXEBOT.motor.torque_constant)
    )
    found = omnidyn.path_demand(gripping(0.1), "eight:period_s=4")
    assert found.current == pytest.approx(asked.current, rel=0.05)  # a wheel has some inertia here
    assert found.current_limit == pytest.approx(amperes, rel=1e-9)
    assert found.grip
    assert found.follows == (found.current <= amperes)
    assert "at which a wheel slips" in str(found.verdict)


def test_a_slope_is_still_refused():
    slope = gripping(0.5).replace(floor=AXEBOT.floor.replace(tilt=3.0))
    with pytest.raises(UnsupportedError, match="not level"):
        omnidyn.track(slope, "circle", "pid")
