"""Motors, eqs (10)-(12), against numbers that follow from Table 3 by hand (EVIDENCE.md, section 1)."""

import numpy as np
import pytest

from omnidyn.errors import InputError
from omnidyn.model.actuation import clip_voltage
from omnidyn.model.motor import Motor, back_emf, no_load_speed, settled_current, traction, wheel_torque


def test_stall_current_at_6_volts(axebot):
    """3.55 A: 6 V / 1.69 ohm."""
    current = settled_current(axebot.motor, [6.0, -6.0, 3.0], [0.0, 0.0, 0.0])
    np.testing.assert_allclose(current, [6 / 1.69, -6 / 1.69, 3 / 1.69], rtol=1e-15)
    assert round(float(current[0]), 2) == 3.55


def test_back_emf_is_that_of_the_motor_shaft(axebot):
    """K_v l w: 0.0059 * 19 * 10 V; the printed (11) leaves out l."""
    np.testing.assert_allclose(back_emf(axebot.motor, [10.0, 0.0, -10.0]), [1.121, 0.0, -1.121], rtol=1e-15)


def test_no_load_speed_of_the_robot(axebot):
    """All motors at 1.5, 2, 2.5 V without any friction: 4.68, 6.24, 7.81 rad/s; Table 1 prints faster ones."""
    wheel = no_load_speed(axebot.motor, [1.5, 2.0, 2.5])
    assert (wheel * 0.035 / 0.1).round(2).tolist() == [4.68, 6.24, 7.81]
    np.testing.assert_allclose(settled_current(axebot.motor, [1.5, 2.0, 2.5], wheel), 0.0, atol=1e-15)


def test_torque_and_traction(axebot):
    """T = l K_t i = 19 * 0.0059 * 2 N m, f = T / 0.035 m."""
    np.testing.assert_allclose(wheel_torque(axebot.motor, [2.0, 0.0, 0.0]), [0.2242, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_allclose(
        traction(axebot.motor, axebot.wheels, [2.0, 0.0, 0.0]), [0.2242 / 0.035, 0, 0], rtol=1e-14
    )


def test_a_list_means_one_motor_each(axebot):
    motor = axebot.motor.replace(resistance=(1.0, 2.0, 4.0), gear_ratio=(10.0, 20.0, 30.0))
    np.testing.assert_allclose(settled_current(motor, [4.0, 4.0, 4.0], [0.0, 0.0, 0.0]), [4.0, 2.0, 1.0])
    np.testing.assert_allclose(wheel_torque(motor, [1.0, 1.0, 1.0]), [0.059, 0.118, 0.177], rtol=1e-14)


def test_voltage_is_kept_within_the_limit_on_both_sides(axebot):
    volts = np.array([[7.0, -7.0, 6.0], [5.9, -1e9, 0.0]])
    assert clip_voltage(axebot.motor, volts).tolist() == [[6.0, -6.0, 6.0], [5.9, -6.0, 0.0]]
    each = axebot.motor.replace(voltage_limit=(1.0, 2.0, 3.0))
    assert clip_voltage(each, volts).tolist() == [[1.0, -2.0, 3.0], [1.0, -2.0, 0.0]]


def test_dynamic_electrics_need_an_inductance(axebot):
    with pytest.raises(InputError, match='electrical = "dynamic" needs inductance_H'):
        axebot.motor.replace(electrical="dynamic", inductance=None)
    assert axebot.motor.replace(electrical="dynamic").electrical == "dynamic"


def test_a_motor_needs_its_numbers():
    with pytest.raises(InputError, match=r"a key is missing \(and 3 more\).*resistance_ohm"):
        Motor(voltage_limit=6.0, inductance=1e-4)
