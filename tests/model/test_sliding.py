"""What friction does while it slides: the wrench that the equations of motion have, whatever the shape."""

import numpy as np
import pytest

from omnidyn.model.dynamics import acceleration
from omnidyn.model.motor import back_emf
from omnidyn.model.robot_file import load_robot
from omnidyn.model.sliding import sliding_wrench, top_speeds
from omnidyn.model.wheels import wheel_speed

TWISTS = np.array([[0.4, 0.7, 2.0], [-0.3, 0.1, 0.6], [0.2, -0.9, -3.0]])


def with_wheels(robot):
    wheels = robot.friction.wheels.replace(coulomb=1.3, coulomb_backward=2.1, viscous=0.4)
    return robot.replace(friction=robot.friction.replace(wheels=wheels))


@pytest.mark.parametrize("name", ["axebot", "robotino"])
@pytest.mark.parametrize("change", [lambda robot: robot, with_wheels])
def test_it_is_what_slows_a_robot_whose_motors_carry_no_current(name, change):
    """At the voltage of the back-EMF no current flows: what is left is friction."""
    robot = change(load_robot(name))
    robot = robot.replace(body=robot.body.replace(rotating_frame=False))
    volts = back_emf(robot.motor, wheel_speed(robot.wheels, TWISTS))
    mass = np.array([robot.body.mass, robot.body.mass, robot.body.inertia])
    np.testing.assert_allclose(sliding_wrench(robot, TWISTS), mass * acceleration(robot, TWISTS, volts), rtol=1e-9)


def test_on_the_body_axes_it_is_the_paper_s():
    robot = load_robot("axebot")
    axes = robot.friction.axes
    np.testing.assert_allclose(sliding_wrench(robot, TWISTS), axes.sliding_wrench(TWISTS), rtol=1e-15)


def test_a_wheel_that_does_not_turn_takes_nothing():
    """Driving along x, wheel 1 of the paper's robot stands still; one at 45 degrees by rounding only."""
    robot = with_wheels(load_robot("axebot"))
    still = robot.replace(friction=robot.friction.replace(axes=load_robot("robotino").friction.axes))
    wrench = sliding_wrench(still, [1.0, 0.0, 0.0])
    level = np.sqrt(0.75) * (1.3 + 2.1) + 2 * 0.75 * 0.4
    np.testing.assert_allclose(wrench[0], -level, rtol=1e-12)


def test_nothing_slides_faster_than_the_motors_turn():
    robot = load_robot("axebot")
    rim = 6.0 / (0.0059 * 19.0) * 0.035
    np.testing.assert_allclose(top_speeds(robot), [rim / np.sqrt(0.75), rim, rim / 0.1], rtol=1e-12)
