"""Shapes of friction against the model: the force a shape predicts is what keeps such a robot at constant speed."""

import numpy as np
import pytest

from omnidyn.identification.steady.operating_points import ForcePoints
from omnidyn.identification.steady.shapes import SHAPES, friction_of
from omnidyn.model.dynamics import drive_wrench
from omnidyn.model.friction import DirectionFriction, Friction, WheelFriction
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from tests.support.steady_logs import FRICTIONS, TRUTH, robot_with, steady_voltage


def points_at(robot, twists):
    twists, n = np.asarray(twists, dtype=float), len(twists)
    zero = np.zeros((n, 3))
    return ForcePoints(
        twist=twists,
        traction=np.zeros((n, robot.wheels.count)),
        wrench=zero,
        wrench_std=zero,
        still=np.full(n, 1e-9),
        travels=np.hypot(twists[:, 0], twists[:, 1]) > 1e-9,
        turns=np.abs(twists[:, 2]) > 1e-9,
        direction=np.degrees(np.arctan2(twists[:, 1], twists[:, 0])),
        group=("all",) * n,
        run=np.arange(n),
        rows=np.ones(n, dtype=np.int64),
        span=np.zeros((n, 2)),
        speed_from="set",
        force_from="current",
    )


def some_twists():
    """Directions in which no axis and no wheel is at rest."""
    angle = np.radians(np.arange(7, 360, 23))
    return np.stack([0.3 * np.cos(angle), 0.3 * np.sin(angle), np.full(len(angle), 0.7)], axis=1)


@pytest.mark.parametrize("shape", [*FRICTIONS])
def test_a_shape_is_what_the_model_s_friction_asks_for(shape):
    """Independent of the shapes: voltages at which the model does not accelerate, then its driving wrench."""
    robot, twists = robot_with(shape), some_twists()
    needed = np.array([drive_wrench(robot, twist, steady_voltage(robot, twist)) for twist in twists])
    keys = SHAPES[shape].keys(robot, True)
    yaw = {"friction.axes.coulomb[2]": 0.099, "friction.direction.yaw_coulomb": 0.099}
    level = np.array([(TRUTH[shape] | yaw)[key] for key in keys])
    assert SHAPES[shape].force(robot, points_at(robot, twists), True, level) == pytest.approx(needed, abs=1e-9)


@pytest.mark.parametrize("name", [name for name, shape in SHAPES.items() if shape.in_model])
@pytest.mark.some(8)
def test_every_shape_of_a_robot_file_is_what_its_robot_feels(name):
    """Levels into a robot file and back through the model: sums and viscous parts included."""
    robot, shape, twists = load_robot("axebot"), SHAPES[name], some_twists()
    keys = shape.keys(robot, True)
    level = {key: 0.3 + 0.1 * k for k, key in enumerate(keys)}
    fitted = robot.replace(friction=friction_of(shape, robot, level))
    fitted = parse_robot(robot_to_toml(fitted))
    needed = np.array([drive_wrench(fitted, twist, steady_voltage(fitted, twist)) for twist in twists])
    ours = shape.force(robot, points_at(robot, twists), True, np.array([*level.values()]))
    assert ours == pytest.approx(needed, abs=1e-9)


def test_the_derivative_of_the_ellipse_is_that_of_its_force():
    robot, points = load_robot("axebot"), points_at(load_robot("axebot"), some_twists())
    level, shape = np.array([2.4, 1.6, 0.1]), SHAPES["ellipse"]
    slope = shape.table(robot, points, True, level)[1]
    for k in range(3):
        h = np.eye(3)[k] * 1e-6
        numeric = (shape.force(robot, points, True, level + h) - shape.force(robot, points, True, level - h)) / 2e-6
        assert slope[:, :, k] == pytest.approx(numeric, abs=1e-8)


def test_what_is_not_known_to_move_has_no_sign():
    robot = load_robot("axebot")
    force = SHAPES["box"].force(robot, points_at(robot, [[0.3, 4e-10, 0.0]]), False, np.array([2.0, 1.0]))
    assert force.tolist() == [[2.0, 0.0, 0.0]]


def test_levels_of_each_wheel_go_to_each_wheel():
    robot = load_robot("axebot")
    level = {f"friction.wheels.coulomb[{k}]": 0.1 * (k + 1) for k in range(3)} | {"friction.direction.coulomb": 2.0}
    assert friction_of(SHAPES["disc+wheels"], robot, level) == Friction(
        direction=DirectionFriction(coulomb=(2.0, 2.0)), wheels=WheelFriction(coulomb=(0.1, 0.2, 0.30000000000000004))
    )
