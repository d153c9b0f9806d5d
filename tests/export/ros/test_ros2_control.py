"""ros2-control: what the controller makes of our files is our kinematics; covariances hold on other logs."""

import ast
import xml.etree.ElementTree as ET

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.ros.ros2_control import limits, odometry_error, ros2_control
from omnidyn.export.spelling import yaml_number
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.robot import Prior
from omnidyn.model.wheels import wheel_speed
from tests.support.exported import exact_robot

yaml = pytest.importorskip("yaml")
ROBOT = omnidyn.load_robot("axebot")


def parameters(made):
    return yaml.safe_load(made.files["controllers.yaml"])["omni_wheel_drive_controller"]["ros__parameters"]


def odometry(given, joints):
    """What omni_wheel_drive_controller makes of joint speeds by name: the equations of its odometry.cpp."""
    names = given["wheel_names"]
    theta = given["wheel_offset"] + 2.0 * np.pi * np.arange(len(names)) / len(names)
    matrix = np.stack([np.sin(theta), -np.cos(theta), np.full(len(names), -given["robot_radius"])], axis=1)
    speeds = np.array([joints[name] for name in names])
    return np.linalg.lstsq(matrix, speeds * given["wheel_radius"], rcond=None)[0]


@pytest.mark.parametrize("robot", [ROBOT, *(exact_robot(seed) for seed in range(8))], ids=lambda r: r.name)
def test_the_controller_finds_the_twist_of_the_model(robot):
    """Joints of the URDF turn about their axes; by w about ours is by -w about an outward one."""
    made, twist = ros2_control(robot), np.array([0.4, -0.7, 2.0])
    axes = {}
    for joint in ET.fromstring(made.files["robot.urdf"]).findall("joint"):
        axes[joint.get("name")] = float(joint.find("axis").get("xyz").split()[0])
    own = wheel_speed(robot.wheels, twist)
    joints = {f"wheel{k + 1}_joint": -axes[f"wheel{k + 1}_joint"] * w for k, w in enumerate(own)}
    np.testing.assert_allclose(odometry(parameters(made), joints), twist, rtol=1e-9)


def test_order_and_offset_of_the_paper():
    given = parameters(ros2_control(ROBOT))
    assert given["wheel_names"] == ["wheel3_joint", "wheel1_joint", "wheel2_joint"]
    assert given["wheel_offset"] == pytest.approx(np.pi / 3, rel=1e-15)


def test_the_limits_are_what_the_motors_keep():
    speed, acceleration = limits(ROBOT)
    for axis in range(3):
        volts = np.tile(6.0 * axis_patterns(ROBOT)[axis], (300, 1))
        run = omnidyn.simulate(ROBOT, volts, 0.01)
        assert run.twist is not None
        assert run.twist[-1, axis] == pytest.approx(speed[axis] / 0.8, rel=1e-6)
        first = omnidyn.simulate(ROBOT, volts[:1], 1e-6).twist
        assert first is not None
        assert first[-1, axis] / 1e-6 == pytest.approx(acceleration[axis] / 0.8, rel=1e-4)
    smoother = yaml.safe_load(ros2_control(ROBOT).files["velocity_smoother.yaml"])["velocity_smoother"][
        "ros__parameters"
    ]
    np.testing.assert_allclose(smoother["max_velocity"], speed, rtol=1e-3)
    np.testing.assert_allclose(smoother["max_decel"], -acceleration, rtol=1e-3)


def noisy_log(seed):
    """A log of 4 s whose wheel speeds have white noise, and whose twist is the truth."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-6.0, 6.0, (20, 3)), 20, axis=0)
    run = omnidyn.simulate(ROBOT, volts, 0.01)
    return run.replace(wheel_speed=run.wheel_speed + rng.normal(0.0, 0.5, run.wheel_speed.shape))


def test_covariances_hold_on_two_hundred_logs():
    """Normalised errors of the twist within their 95 % intervals in 93 to 97 %, on logs that made no covariance."""
    inside, count = np.zeros(3), 0
    for seed in range(0, 200, 10):
        std = np.sqrt(
            np.array(parameters(ros2_control(ROBOT, noisy_log(1000 + seed)))["diagonal_covariance"]["twist"])[[0, 1, 5]]
        )
        for other in range(seed, seed + 10):
            error = odometry_error(ROBOT, noisy_log(other))
            inside += (np.abs(error) < 1.96 * std).sum(axis=0)
            count += len(error)
    assert ((inside / count > 0.93) & (inside / count < 0.97)).all()


def test_the_variance_of_the_twist_is_that_of_the_noise():
    """Independent noise sigma of the wheels gives r sqrt(2/3) sigma on v and v_n, r sigma/(sqrt 3 b) on omega."""
    twist = parameters(ros2_control(ROBOT, [noisy_log(seed) for seed in range(20)]))["diagonal_covariance"]["twist"]
    expected = 0.035 * 0.5 * np.array([np.sqrt(2 / 3), np.sqrt(2 / 3), 1 / (np.sqrt(3) * 0.1)])
    np.testing.assert_allclose(np.sqrt(np.array(twist)[[0, 1, 5]]), expected, rtol=0.03)


def test_the_pose_after_the_horizon_is_as_uncertain_as_sums_of_the_errors():
    logs = [noisy_log(seed) for seed in range(40)]
    pose = parameters(ros2_control(ROBOT, logs, horizon=2.0))["diagonal_covariance"]["pose"]
    white = (0.035 * 0.5) ** 2 * (2 / 3) * 0.01 * 2.0
    assert pose[0] == pytest.approx(white, rel=0.5)
    long = ros2_control(ROBOT, logs[:2], horizon=100.0)
    assert any("no log lasts 100 s" in note for note in long.notes)


def test_what_is_known_of_the_radii_counts_where_there_are_no_logs():
    robot = ROBOT.replace(priors={"wheels.wheel_radius_m": Prior(std=0.00035, origin="measured")})
    known, guess = ros2_control(robot), ros2_control(ROBOT)
    assert parameters(known)["diagonal_covariance"]["twist"] == parameters(guess)["diagonal_covariance"]["twist"]
    assert any("from the std of the radii" in note for note in known.notes)
    assert any("a guess" in note for note in guess.notes)


def test_what_cannot_be_said_is_refused():
    with pytest.raises(UnsupportedError, match=r"evenly spaced.*mecanum rollers"):
        ros2_control(omnidyn.load_robot("mecanum"))
    log = noisy_log(1)
    with pytest.raises(InputError, match="cannot compare odometry with this run"):
        ros2_control(ROBOT, log.replace(twist=None))
    short = log.replace(**{name: value[:5] for name, value in log.channels.items()}, t=log.t[:5])
    with pytest.raises(InputError, match="too few samples for a covariance; got 5"):
        ros2_control(ROBOT, short)
    with pytest.raises(InputError, match="no horizon"):
        ros2_control(ROBOT, horizon=0.0)


@pytest.mark.parametrize("name", ['"x": [', "速度", "a\\", "# --", "*/ -->"])
def test_whatever_the_robot_is_called(name):
    made = ros2_control(ROBOT.replace(name=name))
    ET.fromstring(made.files["robot.urdf"])
    ast.parse(made.files["bringup.launch.py"])
    assert parameters(made)["wheel_radius"] == 0.035


# Types of the parameters, as the controllers declare them (generate_parameter_library of omni_wheel_drive_controller,
# declare_parameter of nav2's velocity_smoother): ROS 2 takes no integer for a double, and no array of both.
DOUBLES = {"wheel_offset", "robot_radius", "wheel_radius", "cmd_vel_timeout", "smoothing_frequency", "velocity_timeout"}
ARRAYS = {"pose", "twist", "max_velocity", "min_velocity", "max_accel", "max_decel", "deadband_velocity"}
WORDS = {"odom_frame_id", "base_frame_id", "feedback", "type"}
TRUTHS = {"position_feedback", "scale_velocities"}


def typed(tree):
    """Every parameter of a file has the type that its controller declares; all of them are known."""
    for name, value in tree.items():
        if isinstance(value, dict):
            typed(value)
        elif name in ARRAYS:
            assert all(type(each) is float for each in value), (name, value)
            assert len(value) in (3, 6)
        elif name == "wheel_names":
            assert all(type(each) is str for each in value)
        else:
            kinds = {**dict.fromkeys(DOUBLES, float), **dict.fromkeys(WORDS, str), **dict.fromkeys(TRUTHS, bool)}
            assert type(value) is {**kinds, "update_rate": int}[name], (name, value)


def round_robot(radius):
    """Numbers without a fraction, which an integer would spell as well; or tiny ones, with an exponent."""
    return ROBOT.replace(
        name=f"radius {radius:g}", wheels=ROBOT.wheels.replace(wheel_radius=radius, robot_radius=2 * radius)
    )


@pytest.mark.parametrize("value", [1e-5, 1.5e-5, 1e16, 2.0, 0.0, -1e-300, 0.1, 123456789.0])
def test_a_number_is_a_float_to_yaml(value):
    """PyYAML and libyaml take 1e-05 for a word: they ask for a point before the exponent."""
    found = yaml.safe_load(yaml_number(value))
    assert type(found) is float
    assert found == value


@pytest.mark.parametrize(
    "robot",
    [ROBOT, round_robot(1.0), round_robot(0.001), *(exact_robot(seed) for seed in range(30))],
    ids=lambda robot: robot.name,
)
def test_every_parameter_has_the_type_that_its_controller_declares(robot):
    made = ros2_control(robot)
    for name in ("controllers.yaml", "velocity_smoother.yaml"):
        tree = yaml.safe_load(made.files[name])
        typed(tree)
        assert all("ros__parameters" in each for each in tree.values())
