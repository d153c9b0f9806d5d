"""The geometry of a robot from its logs: known robots, their own kinematics as a log, eq (3)."""

import numpy as np
import pytest

from omnidyn import load_robot
from omnidyn.errors import InputError, InsufficientDataError
from omnidyn.logs.geometry import as_mecanum, wheel_geometry
from omnidyn.model.wheels import wheel_speed
from omnidyn.run import Run


def log_of(robot, twist, scale=1.0, noise=0.0, names=("twist_command", "wheel_speed_command")):
    """Wheel speeds by hand: rim speed of wheel i is -sin(phi) vx + cos(phi) vy + b omega."""
    phi = np.radians(robot.wheels.azimuth_deg)
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi))
    rim += np.outer(twist[:, 2], np.ones(len(phi))) * robot.wheels.robot_radius
    speed = scale * rim / robot.wheels.wheel_radius
    speed += noise * np.random.default_rng(1).normal(size=speed.shape)
    return Run(t=np.arange(len(twist)) * 0.01, **dict(zip(names, (twist, speed), strict=True)))


def wander(turn=1.0, rows=400):
    rng = np.random.default_rng(2)
    return rng.normal(size=(rows, 3)) * [0.3, 0.2, turn]


@pytest.mark.parametrize("name", ["axebot", "robotino", "four-wheel"])
def test_it_finds_the_wheels_of_a_preset(name):
    robot = load_robot(name)
    found = wheel_geometry([log_of(robot, wander())])
    np.testing.assert_allclose(np.array(found.azimuth_deg), np.array(robot.wheels.azimuth_deg) % 360.0, atol=1e-9)
    assert found.per_metre == pytest.approx(1.0 / robot.wheels.wheel_radius)
    assert found.robot_radius == pytest.approx(robot.wheels.robot_radius)
    assert found.residual < 1e-12


def test_speeds_of_the_motor_show_the_gear():
    robot = load_robot("robotino")
    found = wheel_geometry([log_of(robot, wander(turn=0.0), scale=16.0)])
    assert found.per_metre * robot.wheels.wheel_radius == pytest.approx(16.0)
    assert found.robot_radius is None


def test_runs_in_one_direction_each_add_up():
    robot = load_robot("robotino")
    runs = [log_of(robot, np.tile([np.cos(a), np.sin(a), 0.0], (9, 1))) for a in (0.0, 0.5, 1.0)]
    np.testing.assert_allclose(wheel_geometry(runs).azimuth_deg, robot.wheels.azimuth_deg, atol=1e-9)
    with pytest.raises(InsufficientDataError, match="do not show where the wheels stand"):
        wheel_geometry(runs[:1])


def test_noise_stays_within_its_standard_error():
    robot = load_robot("robotino")
    found = wheel_geometry([log_of(robot, wander(), noise=0.5, names=("twist", "wheel_speed"))])
    error = np.abs(np.array(found.azimuth_deg) - robot.wheels.azimuth_deg)
    assert (error < 4.0 * np.array(found.azimuth_std)).all()
    assert (np.array(found.azimuth_std) < 1.0).all()


def test_what_is_no_omni_robot_is_refused():
    rng = np.random.default_rng(5)
    run = Run(t=np.arange(99.0), twist=rng.normal(size=(99, 3)), wheel_speed=rng.normal(size=(99, 3)))
    with pytest.raises(InputError, match="do not follow the body as omni wheels do"):
        wheel_geometry([run])
    with pytest.raises(InputError, match="cannot tell where the wheels stand; got wheel_speed"):
        wheel_geometry([Run(t=run.t, wheel_speed=run.wheel_speed)])


def test_mecanum_wheels_are_no_omni_wheels():
    """By hand, rollers in an X, forward: (vx - vy - b om, vx + vy + b om, vx + vy - b om, vx - vy + b om)/r."""
    twist = np.random.default_rng(3).normal(size=(60, 3))
    vx, vy, turn = twist[:, 0], twist[:, 1], 0.35 * twist[:, 2]
    speed = np.column_stack([vx - vy - turn, vx + vy + turn, vx + vy - turn, vx - vy + turn]) / 0.05
    speed *= [-1.0, 1.0, -1.0, 1.0]  # counter-clockwise about the robot: on the left that is backward
    run = Run(t=np.arange(60.0), twist=twist, wheel_speed=speed)
    seen = as_mecanum(wheel_geometry([run]))
    assert seen.robot_radius == pytest.approx(0.35)
    assert seen.per_metre == pytest.approx(20.0)
    preset = load_robot("mecanum").wheels
    other = wheel_geometry([run.replace(wheel_speed=wheel_speed(preset, twist))])
    assert as_mecanum(other).robot_radius == pytest.approx(preset.robot_radius)
    other = run.replace(wheel_speed=speed * [-1.0, 1.0, 1.0, 1.0])
    with pytest.raises(InputError, match="front left, front right, rear left, rear right"):
        as_mecanum(wheel_geometry([other]))


def test_what_mecanum_logs_do_not_show_is_the_radius_and_not_where_they_stand():
    t = np.arange(100) * 0.01
    twist, speed = np.tile([0.3, 0.0, 0.0], (100, 1)), np.full((100, 4), 5.0)
    run = Run(t=t, twist=twist, wheel_speed=speed, source="straight.csv")
    with pytest.raises(InsufficientDataError, match="leave the logs out and give `azimuth`"):
        wheel_geometry([run])
    with pytest.raises(InsufficientDataError, match="leave the logs out and give --robot-radius"):
        wheel_geometry([run], "--robot-radius")
    with pytest.raises(InputError, match="give --robot-radius"):
        wheel_geometry([run.replace(twist=None)], "--robot-radius")
