"""ros2-control: what the controller makes of our files is our kinematics; covariances hold on other logs."""

import ast
import re
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from types import ModuleType

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.ros.odometry_covariance import odometry_error
from omnidyn.export.ros.ros2_control import limits, ros2_control
from omnidyn.export.spelling import yaml_number
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.robot import Prior
from omnidyn.model.wheels import wheel_speed
from tests.support.exported import exact_robot
from tests.support.ros_parameters import check_parameters

yaml = pytest.importorskip("yaml")
ROBOT, MECANUM = omnidyn.load_robot("axebot"), omnidyn.load_robot("mecanum")
SUM = "sum_of_robot_center_projection_on_X_Y_axis"
LAUNCH = ("launch", "launch_ros", "launch_ros.actions", "launch_ros.parameter_descriptions")


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
    axes = axes_of(made)
    speeds = wheel_speed(robot.wheels, twist)
    joints = {f"wheel{k + 1}_joint": -axes[f"wheel{k + 1}_joint"] * w for k, w in enumerate(speeds)}
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
            error = odometry_error(ROBOT, noisy_log(other))[1]
            inside += (np.abs(error) < 1.96 * std).sum(axis=0)
            count += len(error)
    assert ((inside / count > 0.93) & (inside / count < 0.97)).all()


def test_the_variance_of_the_twist_is_that_of_the_noise():
    """Independent noise sigma of the wheels gives r sqrt(2/3) sigma on v and v_n, r sigma/(sqrt 3 b) on omega."""
    twist = parameters(ros2_control(ROBOT, [noisy_log(seed) for seed in range(20)]))["diagonal_covariance"]["twist"]
    expected = 0.035 * 0.5 * np.array([np.sqrt(2 / 3), np.sqrt(2 / 3), 1 / (np.sqrt(3) * 0.1)])
    np.testing.assert_allclose(np.sqrt(np.array(twist)[[0, 1, 5]]), expected, rtol=0.03)


def test_sensors_with_clocks_of_their_own_are_brought_to_one_time():
    """A wheel that is 1 % larger than the robot file has it: the error of a twist is 1 % of it, at any stamps."""
    t = np.arange(0.0, 4.0, 0.005)
    twist = np.stack([0.3 + 0.1 * np.sin(t), 0.2 * np.cos(t), np.ones_like(t)], axis=1)
    speeds = 1.01 * wheel_speed(ROBOT.wheels, twist)
    speeds[1::2], twist[::2] = np.nan, np.nan
    at, error = odometry_error(ROBOT, omnidyn.Run(t=t, wheel_speed=speeds, twist=twist))
    np.testing.assert_array_equal(at, t[1::2])
    np.testing.assert_allclose(error[1:-1], 0.01 * twist[1::2][1:-1], atol=1e-5)
    long = ros2_control(ROBOT, omnidyn.Run(t=t, wheel_speed=speeds, twist=twist), horizon=1.0)
    variance = parameters(long)["diagonal_covariance"]["pose"]
    np.testing.assert_allclose(variance[5], 1e-4, rtol=0.05)


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
    plain = omnidyn.load_robot("mecanum")
    for wheels in (
        plain.wheels.replace(roller_angle_deg=(-40.0, 40.0, 40.0, -40.0)),
        plain.wheels.replace(wheel_radius=(0.03, 0.03, 0.03, 0.031)),
        ROBOT.wheels.replace(azimuth_deg=(0.0, 90.0, 200.0)),
    ):
        with pytest.raises(UnsupportedError, match=r"evenly spaced.*nor four mecanum wheels in an X"):
            ros2_control(plain.replace(wheels=wheels, drive=plain.drive, friction=plain.friction))
    log = noisy_log(1)
    with pytest.raises(InputError, match="cannot compare odometry with this run"):
        ros2_control(ROBOT, log.replace(twist=None))
    short = log.replace(**{name: value[:5] for name, value in log.channels.items()}, t=log.t[:5])
    with pytest.raises(InputError, match="too few samples for a covariance; got 5"):
        ros2_control(ROBOT, short)
    with pytest.raises(InputError, match="not a horizon"):
        ros2_control(ROBOT, horizon=0.0)


@pytest.mark.parametrize("name", ['"x": [', "速度", "a\\", "# --", "*/ -->"])
def test_whatever_the_robot_is_called(name):
    made = ros2_control(ROBOT.replace(name=name))
    ET.fromstring(made.files["robot.urdf"])
    ast.parse(made.files["bringup.launch.py"])
    assert parameters(made)["wheel_radius"] == 0.035


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
    [ROBOT, MECANUM, round_robot(1.0), round_robot(0.001), *(exact_robot(seed) for seed in range(6))],
    ids=lambda robot: robot.name,
)
def test_every_parameter_is_one_that_its_controller_declares(robot):
    made = ros2_control(robot)
    controllers = yaml.safe_load(made.files["controllers.yaml"])
    manager = controllers.pop("controller_manager")["ros__parameters"]
    assert type(manager.pop("update_rate")) is int
    for name, tree in (controllers | yaml.safe_load(made.files["velocity_smoother.yaml"])).items():
        check_parameters(name, tree)
    (name,) = controllers
    assert manager.pop("joint_state_broadcaster") == {"type": "joint_state_broadcaster/JointStateBroadcaster"}
    assert set(manager) == {name}
    assert manager[name]["type"].startswith(f"{name}/")  # a plugin's library is its package's


def axes_of(made):
    """Joint -> 1 where its axis points outwards, -1 inwards."""
    joints = ET.fromstring(made.files["robot.urdf"]).findall("joint")
    return {joint.get("name"): float(joint.find("axis").get("xyz").split()[0]) for joint in joints}


@pytest.mark.parametrize("wheel_order", [(0, 1, 2, 3), (2, 0, 3, 1)])
def test_mecanum_drive_controller_finds_the_twist_of_the_model(wheel_order):
    """Its odometry.cpp on the joints of the URDF, for wheels in any order; all of them forward drive forward."""
    wheels, order = MECANUM.wheels, list(wheel_order)
    turned = wheels.replace(
        azimuth_deg=tuple(np.array(wheels.azimuth_deg)[order]),
        roller_angle_deg=tuple(np.array(wheels.roller_angle_deg)[order]),
    )
    robot = MECANUM.replace(wheels=turned)
    names = ["a/fl", "b_1", "C-c", "d.d"]
    made, twist = ros2_control(robot, joints=names), np.array([0.4, -0.7, 2.0])
    given = yaml.safe_load(made.files["controllers.yaml"])["mecanum_drive_controller"]["ros__parameters"]
    axes = axes_of(made)
    assert list(axes) == names

    def found(twist):
        speeds = dict(zip(names, wheel_speed(robot.wheels, twist), strict=True))
        places = ("front_left", "rear_left", "rear_right", "front_right")
        joints = [given[f"{place}_wheel_command_joint_name"] for place in places]
        fl, rl, rr, fr = (-axes[joint] * speeds[joint] for joint in joints)
        r, k = given["kinematics"]["wheels_radius"], given["kinematics"][SUM]
        odometry = [
            0.25 * r * (fl + rl + rr + fr),
            0.25 * r * (-fl + rl - rr + fr),
            0.25 * r / k * (-fl - rl + rr + fr),
        ]
        return odometry, (fl, rl, rr, fr)

    np.testing.assert_allclose(found(twist)[0], twist, rtol=1e-12)
    assert all(speed > 0.0 for speed in found(np.array([1.0, 0.0, 0.0]))[1])


@pytest.mark.parametrize(
    "names", [["a", "b"], ["a", "b", "a"], ["a", "b", 'c"'], ["a", "b", "base_link"], ["", "a", "b"]]
)
def test_names_that_are_none_are_refused(names):
    with pytest.raises(InputError, match="name"):
        ros2_control(ROBOT, joints=names)


def started(text, folder):
    """What a launch file starts, by stubs of launch: the keyword arguments of its nodes."""
    nodes, stubs = [], {name: ModuleType(name) for name in LAUNCH}
    stubs["launch"].LaunchDescription = list
    stubs["launch_ros.actions"].Node = lambda **options: nodes.append(options)
    stubs["launch_ros.parameter_descriptions"].ParameterValue = lambda value, value_type: value
    path = folder / "started.launch.py"
    path.write_text(text)
    scope = {"__file__": str(path), "__name__": "launched"}
    with pytest.MonkeyPatch.context() as patch:
        for name, module in stubs.items():
            patch.setitem(sys.modules, name, module)
        exec(compile(text, str(path), "exec"), scope)
        scope["generate_launch_description"]()
    return nodes


def checked_package(made, folder):
    """The name of the package and what it needs, where package.xml has what REP 149 asks for."""
    made.write(folder)
    root = ET.parse(folder / "package.xml").getroot()
    assert (root.tag, root.get("format")) == ("package", "3")
    for tag in ("name", "version", "description", "maintainer", "license", "buildtool_depend"):
        assert root.findtext(tag), tag
    assert re.fullmatch(r"\d+\.\d+\.\d+", root.findtext("version"))
    assert re.fullmatch(r"[a-z][a-z0-9_]*[a-z0-9]", root.findtext("name"))
    assert "@" in root.find("maintainer").get("email")
    assert root.findtext("export/build_type") == "ament_cmake"
    return root.findtext("name"), {need.text for need in root.findall("exec_depend")}


def installed(folder, build):
    """What cmake installs of a package, with an ament_cmake that does nothing."""
    stub = build / "ament"
    stub.mkdir(parents=True)
    (stub / "ament_cmakeConfig.cmake").write_text("macro(ament_package)\nendmacro()\n")
    quiet = {"check": True, "capture_output": True}
    prefix = f"-DCMAKE_INSTALL_PREFIX={build / 'install'}"
    subprocess.run(["cmake", "-S", folder, "-B", build / "b", f"-Dament_cmake_DIR={stub}", prefix], **quiet)
    subprocess.run(["cmake", "--build", build / "b", "--target", "install"], **quiet)
    return {path.relative_to(build / "install").as_posix() for path in (build / "install").rglob("*") if path.is_file()}


@pytest.mark.parametrize("robot", [ROBOT, MECANUM], ids=lambda robot: robot.name)
def test_the_package_starts_what_it_names(robot, tmp_path):
    made = ros2_control(robot)
    name, needs = checked_package(made, tmp_path / "bot")
    nodes = started(made.files["bringup.launch.py"], tmp_path / "bot")
    assert {node["package"] for node in nodes} <= needs
    manager = yaml.safe_load(made.files["controllers.yaml"])["controller_manager"]["ros__parameters"]
    spawned = [node["arguments"] for node in nodes if node["executable"] == "spawner"]
    assert {arguments[0] for arguments in spawned} == set(manager) - {"update_rate"}
    controller = spawned[1][0]
    assert controller in needs  # the plugin is in the package of its name
    assert all(arguments[1:3] == ["--param-file", str(tmp_path / "bot" / "controllers.yaml")] for arguments in spawned)
    (smoother,) = (node for node in nodes if node["executable"] == "velocity_smoother")
    topic = {"omni_wheel_drive_controller": "cmd_vel", "mecanum_drive_controller": "reference"}[controller]
    assert smoother["remappings"] == [("cmd_vel_smoothed", f"/{controller}/{topic}")]
    assert f"/{controller}/{topic}" in made.files["README.md"]
    for joint in axes_of(made):
        assert f"`{joint}`" in made.files["README.md"]
    if shutil.which("cmake"):
        here = ("controllers.yaml", "velocity_smoother.yaml", "robot.urdf", "bringup.launch.py")
        assert installed(tmp_path / "bot", tmp_path / "build") == {f"share/{name}/{file}" for file in here}


def test_what_is_left_to_do_by_hand_stands_in_the_readme():
    """Licence, maintainer and hardware: nobody else can put them in."""
    text = ros2_control(omnidyn.load_robot("axebot")).files["README.md"]
    by_hand = text[text.index("Left to do by hand") :]
    for words in ("hardware plugin", "maintainer", "licence", "package.xml"):
        assert words in by_hand
