"""ros2-control: a package for ros2_control: parameters of the drive controller, URDF, velocity smoother, launch file.

Evenly spaced omni wheels are driven by omni_wheel_drive_controller, four mecanum wheels by mecanum_drive_controller:
see drive_controller.py. Joints of the URDF turn the way that the controller has it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.export.bodies.links import height_of, joint_names, links
from omnidyn.export.bodies.urdf import description
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import axis_gains
from omnidyn.export.ros.drive_controller import DriveController, drive_controller
from omnidyn.export.ros.package import package, package_name, read_me
from omnidyn.export.spelling import filled, hash_comment, python_comment, yaml_number
from omnidyn.model.known.told import numbers_told
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run, as_list

HEADROOM = 0.8  # of what the motors can keep: the rest is for friction that is worse today, and for steering
HORIZON = 10.0  # [s]
RATE = 100  # [Hz]
NOTES = (
    "the controller knows kinematics only: no friction, no motor, no slip; its covariance is constant, however fast or "
    "far the robot has gone",
    "limits of velocity and acceleration are those of one axis alone: on a diagonal, or turning, motors have less left",
    "made and checked without ROS: parameters by those that the controllers declare, files by their parsers",
)
DEPENDS = (
    "controller_manager",
    "joint_state_broadcaster",
    "nav2_lifecycle_manager",
    "nav2_velocity_smoother",
    "robot_state_publisher",
)


def ros2_control(
    robot: Robot,
    runs: Run | Sequence[Run] = (),
    horizon: float = HORIZON,
    height: float | None = None,
    joints: Sequence[str] = (),
) -> Export:
    """The package of a robot with evenly spaced omni wheels, or four mecanum wheels in an X, for ros2_control.

    Args:
        robot: The robot.
        runs: Logs with wheel speeds and a measured twist, for the covariances.
        horizon: Of the covariance of the pose [s].
        height: Of the base [m].
        joints: Names of the joints, in the order of the wheels; wheel1_joint, ... by default.

    Raises UnsupportedError for other wheels, InputError for runs that cannot tell, or names that are none.
    """
    refuse("ros2-control", robot)
    covariances, names = covariance(robot, as_list(runs), horizon), joint_names(robot, joints)
    controller = drive_controller(robot, names, covariances.twist, covariances.pose)
    parts = links(robot, height_of(robot, height), names)
    omissions, notes = (*left_out("ros2-control", robot), *parts.notes), (*NOTES, controller.words)
    name = package_name(robot.name, "bringup")
    head = [f"{robot.name}, by omnidyn.", *(f"Not in it: {words}" for words in omissions), *notes]
    files = {
        "controllers.yaml": hash_comment(head) + _controllers(controller, covariances, horizon),
        "velocity_smoother.yaml": hash_comment(head[:1]) + _smoother(robot),
        "robot.urdf": description(robot.name, parts, omissions, controller.outward, f"{controller.words}."),
        "bringup.launch.py": python_comment(head[:1]) + _launch(controller),
    }
    words = f"{robot.name} with {controller.name}, by omnidyn"
    files |= package(name, words, (*DEPENDS, controller.name), list(files))
    files["README.md"] = read_me(robot.name, head[1:], _sections(robot, name, controller, names))
    notes = (f"covariances: {covariances.words}", *notes)
    return Export("ros2-control", robot.name, files, omissions, notes, folder=True)


def limits(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """(speed, acceleration from rest) that the motors can keep along each axis alone, friction taken off. (3,) each.

    [m/s, m/s, rad/s] and [m/s^2, m/s^2, rad/s^2], with some headroom; 0 on an axis that its friction holds.
    """
    volts = float(np.min(robot.motor.voltage_limit))
    volts_left = np.maximum(volts - axis_gains(robot)[:, 0], 0.0)
    return HEADROOM * volts_left / axis_gains(robot)[:, 1], HEADROOM * volts_left / axis_gains(robot)[:, 2]


def _controllers(controller: DriveController, covariances: Covariance, horizon: float) -> str:
    return f"""\
# Covariances: {covariances.words}. That of the pose is the one after {horizon:g} s.
controller_manager:
  ros__parameters:
    update_rate: {RATE}
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    {controller.name}:
      type: {controller.type}

{controller.name}:
  ros__parameters:
{controller.parameters}"""


def _smoother(robot: Robot) -> str:
    speed, acceleration = limits(robot)

    def row(values: FloatArray) -> str:
        return f"[{', '.join(yaml_number(float(f'{value:.4g}')) for value in values)}]"

    return f"""\
# {HEADROOM:g} of what the motors can keep along each axis alone (x, y, yaw), with the friction of the model taken off.
velocity_smoother:
  ros__parameters:
    smoothing_frequency: {RATE / 2}
    scale_velocities: true
    feedback: OPEN_LOOP
    max_velocity: {row(speed)}
    min_velocity: {row(-speed)}
    max_accel: {row(acceleration)}
    max_decel: {row(-acceleration)}
    deadband_velocity: [0.0, 0.0, 0.0]
    velocity_timeout: 0.5
    enable_stamped_cmd_vel: true
"""


# Since Jazzy a controller reads its parameters from the file that the spawner names, and the manager reads the robot
# from the topic of robot_state_publisher.
_LAUNCH = '''\
"""Start the robot: its joints, its controller, and the velocity smoother on /cmd_vel before it."""

from pathlib import Path

from launch import LaunchDescription
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

HERE = Path(__file__).resolve().parent
CONTROLLER = "@CONTROLLER@"


def generate_launch_description():
    text = (HERE / "robot.urdf").read_text("utf-8")
    description = {"robot_description": ParameterValue(text, value_type=str)}
    controllers, smoother = str(HERE / "controllers.yaml"), str(HERE / "velocity_smoother.yaml")
    return LaunchDescription([
        Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[description]),
        Node(package="controller_manager", executable="ros2_control_node", parameters=[controllers]),
        Node(package="controller_manager", executable="spawner",
             arguments=["joint_state_broadcaster", "--param-file", controllers]),
        Node(package="controller_manager", executable="spawner",
             arguments=[CONTROLLER, "--param-file", controllers@REMAPPED@]),
        Node(package="nav2_velocity_smoother", executable="velocity_smoother", name="velocity_smoother",
             parameters=[smoother], remappings=[("cmd_vel_smoothed", "@COMMAND@")]),
        Node(package="nav2_lifecycle_manager", executable="lifecycle_manager", name="lifecycle_manager_smoother",
             parameters=[{"autostart": True, "node_names": ["velocity_smoother"]}]),
    ])
'''


def _launch(controller: DriveController) -> str:
    moved = f', "--controller-ros-args", "-r {controller.transform}:=/tf"' if controller.transform else ""
    return filled(_LAUNCH, CONTROLLER=controller.name, REMAPPED=moved, COMMAND=controller.command)


def _sections(robot: Robot, name: str, controller: DriveController, joints: Sequence[str]) -> list[str]:
    """The paragraphs of README.md."""
    rows = "\n".join(
        f"| {k + 1} | `{joint}` | {float(robot.wheels.azimuth_deg[k]):g} | "
        f"{'outwards' if k in controller.outward else 'inwards'} |"
        for k, joint in enumerate(joints)
    )
    return [
        f"Put the folder into the `src` of a workspace of ROS 2 Jazzy or newer, as `{name}`, then:",
        f"    rosdep install --from-paths src --ignore-src\n    colcon build --packages-select {name}\n"
        f"    . install/setup.bash\n    ros2 launch {name} bringup.launch.py",
        "Drive it by stamped twists on `/cmd_vel`:",
        "    ros2 topic pub -r 20 /cmd_vel geometry_msgs/msg/TwistStamped '{twist: {linear: {x: 0.2}}}'",
        f"The smoother sends them on to `{controller.command}`; odometry comes on `{controller.odometry}`.",
        "The plugin in `robot.urdf` is `mock_components/GenericSystem`: joints do what they are told. Put in that of "
        "your hardware. It takes and gives speeds of the joints [rad/s], positive about these axes:",
        f"| wheel | joint | azimuth [degree] | axis of the joint points |\n| --- | --- | --- | --- |\n{rows}",
    ]


# How far the odometry of wheels is off: the constant diagonal covariance that a ROS controller publishes
#
# From logs that also measure the twist: the mean square of odometry minus measurement, G^T pseudo-inverse times r w
# minus (v_x, v_y, omega). For the pose the same error is summed over windows of the horizon. Without such logs, from
# what is known of the radii: a scale that is off by sigma puts v off by sigma v, at half of the top speed.

UNKNOWN = 0.01  # of the speed, where nothing is known of the radii
LEAST_SAMPLES = 30


class Covariance(NamedTuple):
    """Variances of the twist [(m/s)^2, (m/s)^2, (rad/s)^2] and of the pose after the horizon [m^2, m^2, rad^2].

    words: where they come from.
    """

    twist: FloatArray
    pose: FloatArray
    words: str


def covariance(robot: Robot, runs: Sequence[Run], horizon: float) -> Covariance:
    """From runs that have speeds of the wheels and a measured twist; from the robot where there are none.

    horizon [s]: after which the pose is that uncertain. Raises InputError for runs from which it cannot be told.
    """
    if not 0.0 < horizon <= 1e6:
        raise InputError("no horizon", got=horizon, expected="more than 0 and at most 1e6 s", where="horizon")
    return _from_runs(robot, runs, horizon) if runs else _from_robot(robot, horizon)


def odometry_error(robot: Robot, run: Run) -> tuple[FloatArray, FloatArray]:
    """(times [s], twist from the wheels minus the measured one), NaN where either is missing. Shape (samples, 3).

    Where sensors have clocks of their own: at the times of the twist, wheel speeds on straight lines between theirs.
    """
    if run.wheel_speed is None or run.twist is None:
        raise InputError(
            "cannot compare odometry with this run",
            got=", ".join(run.channels) or "no channel",
            expected="wheel_speed and twist",
            remedy="give logs that measured both, such as by motion capture",
        )
    if not run.staggered:
        return run.t, twist_from_wheel_speed(robot.wheels, run.wheel_speed) - run.twist
    (at, speeds), (t, twist) = run.samples("wheel_speed"), run.samples("twist")
    lines = [np.interp(t, at, speed, left=np.nan, right=np.nan) for speed in speeds.T]
    return t, twist_from_wheel_speed(robot.wheels, np.stack(lines, axis=1)) - twist


def _from_runs(robot: Robot, runs: Sequence[Run], horizon: float) -> Covariance:
    errors = [odometry_error(robot, run) for run in runs]
    samples = np.concatenate([error[np.isfinite(error).all(axis=1)] for _, error in errors])
    if len(samples) < LEAST_SAMPLES:
        raise InputError(
            "too few samples for a covariance",
            got=f"{len(samples)} samples with wheel speeds and twist",
            expected=f"{LEAST_SAMPLES} or more",
            remedy="give longer logs",
        )
    twist = np.mean(samples**2, axis=0)
    ways = [_windows(error, t, horizon) for t, error in errors]
    windows = np.concatenate(ways)
    words = f"from {len(runs)} log{'s' * (len(runs) > 1)}, {len(samples)} samples of odometry and measured twist"
    if len(windows):
        return Covariance(twist, np.mean(windows**2, axis=0), f"{words}, {len(windows)} windows of {horizon:g} s")
    steps = np.concatenate([np.diff(t) for t, _ in errors])
    # No log is that long: errors that do not last, summed as often as there are samples in the horizon.
    pose = twist * float(np.median(steps)) * horizon
    return Covariance(twist, pose, f"{words}; no log lasts {horizon:g} s: the pose as if errors did not last")


def _windows(error: FloatArray, t: FloatArray, horizon: float) -> FloatArray:
    """Sums of an error over windows of the horizon, one after the other. Shape (windows, 3)."""
    filled = np.where(np.isfinite(error), error, 0.0)
    steps = np.diff(t)[:, None]
    summed = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (filled[1:] + filled[:-1]) * steps, axis=0)])
    edges = np.searchsorted(t, np.arange(t[0], t[-1] + 1e-9 * horizon, horizon))
    return np.diff(summed[edges], axis=0)


def _from_robot(robot: Robot, horizon: float) -> Covariance:
    speed = 0.5 * top_speeds(robot)
    scale, has_std = _scale(robot)
    twist = (scale * speed) ** 2
    words = (
        "from the std of the radii" if has_std else f"a guess: {100 * UNKNOWN:g} % of the speed, as no radius has a std"
    )
    return Covariance(twist, twist * horizon**2, f"{words}, at half of the top speed: an error that lasts; give logs")


def _scale(robot: Robot) -> tuple[FloatArray, bool]:
    """(relative error of v_x, v_y and omega that the radii bring, whether anything is known of them)."""
    priors = numbers_told(robot)

    def share(name: str, value: float) -> float:
        stds = [prior.std for key, prior in priors.items() if key.partition("[")[0] == name and prior.std is not None]
        return float(np.mean(stds)) / value if stds else 0.0

    wheel = share("wheels.wheel_radius_m", float(robot.wheels.radii.mean()))
    body = share("wheels.robot_radius_m", float(np.mean(robot.wheels.robot_radius)))
    if wheel == 0.0 and body == 0.0:
        return np.full(3, UNKNOWN), False
    return np.array([wheel, wheel, np.hypot(wheel, body)]), True
