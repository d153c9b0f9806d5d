"""Symmetries of the robots: what is turned or mirrored must move turned or mirrored."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.model.friction import AxesFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.simulation.simulate import simulate
from tests.support.strategies import any_robot, volts

AXEBOT, FOUR = load_robot("axebot"), load_robot("four-wheel")
DT = np.repeat([1e-3, 0.01, 0.05], 5)


def turned(run_twist, angle_deg):
    """Vectors in the plane turned by an angle; the third component stays."""
    cos, sin = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    return run_twist @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def program(data, wheels, rows=15):
    return np.repeat(np.array([data.draw(volts(wheels)) for _ in range(rows // 5)]), 5, axis=0)


@given(st.data())
def test_turning_the_paper_robot_by_120_degrees_permutes_its_motors(data):
    """Motor 1 stands where motor 3 stood, and so on. The paper's box of Coulomb friction has no such symmetry, so
    x and y are viscous only and equal; yaw keeps its Coulomb friction and breakaway."""
    round_ = AxesFriction(viscous=(0.95, 0.95, 0.01), coulomb=(0.0, 0.0, 0.099), breakaway=(0.0, 0.0, 0.13))
    robot = AXEBOT.replace(friction=Friction(axes=round_))
    voltage = program(data, 3)
    run, other = simulate(robot, voltage, DT), simulate(robot, voltage[:, [2, 0, 1]], DT)
    np.testing.assert_allclose(other.twist, turned(run.twist, 120.0), atol=1e-13)
    np.testing.assert_allclose(other.pose, turned(run.pose, 120.0), atol=1e-13)
    np.testing.assert_allclose(other.current, run.current[:, [2, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(other.wheel_speed, run.wheel_speed[:, [2, 0, 1]], atol=1e-11)


@given(st.data(), st.sampled_from([1.0, 1.3]))
def test_turning_four_wheels_by_90_degrees_permutes_them_box_and_all(data, ratio):
    """A box with equal levels along x and y is its own image under a quarter turn: all friction stays on."""
    levels = (1.5, 1.5, 0.099)
    box = AxesFriction(viscous=(0.95, 0.95, 0.01), coulomb=levels, breakaway=tuple(ratio * c for c in levels))
    robot = FOUR.replace(friction=Friction(axes=box))
    voltage = program(data, 4)
    run, other = simulate(robot, voltage, DT), simulate(robot, voltage[:, [3, 0, 1, 2]], DT)
    np.testing.assert_allclose(other.twist, turned(run.twist, 90.0), atol=1e-13)
    np.testing.assert_allclose(other.pose, turned(run.pose, 90.0), atol=1e-13)


MIRROR = np.array([1.0, -1.0, -1.0])


@given(st.data())
def test_the_mirror_image_of_the_paper_robot(data):
    """Left for right: wheels 2 and 3 change places, and every wheel then pushes the other way round.

    Bitwise where the order of a sum cannot matter (one motor without voltage), else to rounding.
    """
    voltage = program(data, 3)
    images = [(voltage, 1e-13)] + [(voltage * (np.arange(3) != idle), 0.0) for idle in range(3)]
    for volts_, tolerance in images:
        run, mirrored = simulate(AXEBOT, volts_, DT), simulate(AXEBOT, -volts_[:, [0, 2, 1]], DT)
        np.testing.assert_allclose(mirrored.twist, run.twist * MIRROR, rtol=0, atol=tolerance)
        np.testing.assert_allclose(mirrored.pose, run.pose * MIRROR, rtol=0, atol=tolerance)


@given(any_robot(), st.data())
def test_opposite_voltages_give_the_opposite_twist_to_the_last_bit(robot, data):
    voltage = program(data, robot.wheels.count)
    run, opposite = simulate(robot, voltage, DT), simulate(robot, -voltage, DT)
    np.testing.assert_array_equal(opposite.twist, -run.twist)
    np.testing.assert_array_equal(opposite.pose[:, 2], -run.pose[:, 2])
    np.testing.assert_array_equal(opposite.current, -run.current)


@given(any_robot(), st.data(), st.floats(-20.0, 20.0), st.floats(-5.0, 5.0))
def test_where_it_starts_and_looks_changes_only_the_view(robot, data, heading, x):
    """The twist is the same to the last bit; the path is turned by the heading and moved."""
    voltage = program(data, robot.wheels.count)
    run, moved = simulate(robot, voltage, DT), simulate(robot, voltage, DT, pose=(x, 2.0, heading))
    np.testing.assert_array_equal(moved.twist, run.twist)
    expected = turned(run.pose, np.degrees(heading)) + np.array([x, 2.0, heading])
    np.testing.assert_allclose(moved.pose, expected, atol=1e-13)


@pytest.mark.parametrize("axis", range(3))
def test_one_axis_alone_leaves_the_others_at_exactly_zero(axis):
    pattern = np.array([[0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]])[axis]
    t = np.arange(2000) * 1e-3
    run = simulate(AXEBOT, np.outer(5.0 * np.sin(8 * t), pattern), 1e-3)
    assert np.abs(run.twist[:, axis]).max() > 0.3
    assert (np.delete(run.twist, axis, axis=1) == 0.0).all()
