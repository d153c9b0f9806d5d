"""The equations of motion backward: what they give, put in forward, is the motion asked for."""

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.model.actuation import asked_for, reaching
from omnidyn.model.dynamics import acceleration
from omnidyn.model.inverse import inverse
from omnidyn.model.motor import settled_current, voltage_of_current
from omnidyn.model.robot_file import load_robot
from omnidyn.model.sliding import sliding_wrench
from tests.support.friction_shapes import SHAPES, shaped
from tests.support.mixed_robots import eager, random_robot, with_centre, with_spin

DRAWS = 30


def motions(seed):
    """Twists and accelerations: in motion, along one axis only, and from rest."""
    random = np.random.default_rng(seed)
    twist = random.normal(size=(DRAWS, 3)) * [0.5, 0.5, 2.0]
    twist[:5] = 0.0
    twist[5:10, 1] = 0.0
    return twist, random.normal(size=(DRAWS, 3)) * [2.0, 2.0, 8.0]


def round_trip(robot, seed):
    twist, wanted = motions(seed)
    robot = robot.replace(motor=robot.motor.replace(current_limit=None))
    volts = omnidyn.voltage_for(robot, twist, wanted)
    return twist, wanted, acceleration(robot, twist, reaching(robot, volts))


@pytest.mark.parametrize("name", [name for name in SHAPES if "breakaway" not in name and name != "all"])
def test_every_friction_backward_is_itself_forward(name):
    _, wanted, got = round_trip(shaped(name), 0)
    np.testing.assert_allclose(got, wanted, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("seed", range(12))
def test_so_it_is_with_drops_gears_rotors_and_any_wheels(seed):
    robot = with_spin(random_robot(seed), seed)
    robot = robot.replace(drive=robot.drive.replace(dead_band=0.1))
    twist, wanted, got = round_trip(robot, seed)
    moving = twist.all(axis=1) if eager(seed) else slice(None)
    np.testing.assert_allclose(got[moving], wanted[moving], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_so_it_is_with_a_centre_of_mass_beside_the_wheels(seed):
    robot = with_centre(with_spin(random_robot(seed), seed), seed)
    twist, wanted, got = round_trip(robot, seed)
    moving = twist.all(axis=1) if eager(seed) else slice(None)
    np.testing.assert_allclose(got[moving], wanted[moving], rtol=1e-11, atol=1e-11)


def test_from_rest_it_breaks_loose():
    """With breakaway above Coulomb no voltage gives less than what is let go: what is asked for, and that."""
    robot = shaped("axes, breakaway")
    volts = omnidyn.voltage_for(robot, np.zeros(3), [0.5, 0.0, 0.0])
    levels = robot.friction.axes
    gained = (levels.breakaway[0] - levels.coulomb[0]) / robot.body.mass
    assert acceleration(robot, np.zeros(3), volts)[0] == pytest.approx(0.5 + gained, rel=1e-12)


def test_nothing_wanted_takes_nothing():
    assert not omnidyn.voltage_for(load_robot("axebot"), np.zeros((4, 3)), np.zeros(3)).any()


def test_many_wheels_share_by_least_heat():
    """The currents are the least: any others with the same wrench differ by what drives nothing, and cost more."""
    robot = next(r for r in (random_robot(seed) for seed in range(50)) if r.wheels.count > 4)
    robot = robot.replace(motor=robot.motor.replace(gear_efficiency=1.0, current_limit=None))
    model = inverse(robot)
    current = model.effort(np.zeros(3), np.array([3.0, -2.0, 0.1])).current
    push = robot.wheels.wrench_matrix * model.per_ampere
    np.testing.assert_allclose(push @ current, [3.0, -2.0, 0.1], rtol=1e-10)
    nothing = np.linalg.svd(push)[2][3:]
    np.testing.assert_allclose(
        nothing @ (np.broadcast_to(robot.motor.resistance, len(current)) * current), 0, atol=1e-10
    )


def test_a_current_backward_is_itself_forward():
    motor = random_robot(3).motor.replace(current_limit=None)
    count = random_robot(3).wheels.count
    current = np.random.default_rng(0).normal(size=(20, count))
    speed = np.random.default_rng(1).normal(size=(20, count)) * 20.0
    np.testing.assert_allclose(
        settled_current(motor, voltage_of_current(motor, current, speed), speed), current, rtol=1e-11
    )


def test_a_dead_band_backward_is_itself_forward():
    robot = load_robot("axebot")
    robot = robot.replace(drive=robot.drive.replace(dead_band=0.3))
    volts = np.array([0.0, 1.5, -0.2])
    np.testing.assert_allclose(reaching(robot, asked_for(robot, volts)), volts, atol=1e-15)


@pytest.mark.parametrize("name", list(SHAPES))
def test_soft_friction_is_friction_where_it_is_fast(name):
    robot, twist = shaped(name), np.array([[0.4, 0.7, 2.0], [-0.3, 0.1, 0.6], [0.2, -0.9, -3.0]])
    fade = np.array([1e-6, 1e-6, 1e-6])
    np.testing.assert_allclose(inverse(robot).soft_friction(twist, fade), sliding_wrench(robot, twist), rtol=1e-12)
    assert not inverse(robot).soft_friction(np.zeros(3), fade).any()


@pytest.mark.parametrize("twist, change", [([1.0, 2.0], [0, 0, 0]), (0.0, [0, 0, 0]), ([0, 0, 0], np.zeros((3, 2)))])
def test_other_shapes_are_refused(twist, change):
    with pytest.raises(InputError, match="wrong shape"):
        omnidyn.voltage_for(load_robot("axebot"), twist, change)
