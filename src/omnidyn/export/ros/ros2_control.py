"""ros2-control: omni_wheel_drive_controller for this robot: parameters, URDF, velocity smoother, launch file.

That controller numbers the wheels counter-clockwise from `wheel_offset`; its joints turn the other way than ours:
r w = v_x sin theta - v_y cos theta - b omega, minus the row of G^T (odometry.cpp of ros2_controllers). So wheels are
named in the order of their azimuth, and the joints of this URDF turn outwards: the same wheel turns the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.export.bodies.links import height_of, links
from omnidyn.export.bodies.urdf import description
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import axis_gains
from omnidyn.export.spelling import hash_comment, python_comment, yaml_number
from omnidyn.model.known.told import numbers_told
from omnidyn.model.robot import Robot
from omnidyn.model.sliding import top_speeds
from omnidyn.model.wheels import twist_from_wheel_speed
from omnidyn.run import Run, as_list

HEADROOM = 0.8  # of what the motors can keep: the rest is for friction that is worse today, and for steering
HORIZON = 10.0  # [s]
RATE = 100  # [Hz]
NOTES = (
    "omni_wheel_drive_controller knows kinematics only: no friction, no motor, no slip; its covariance is constant, "
    "however fast or far the robot has gone",
    "the joints of this URDF turn outwards, as that controller has it: opposite to the wheels of omnidyn",
    "limits of velocity and acceleration are those of one axis alone: on a diagonal, or turning, motors have less left",
)


def ros2_control(
    robot: Robot, runs: Run | Sequence[Run] = (), horizon: float = HORIZON, height: float | None = None
) -> Export:
    """The files of a robot with evenly spaced omni wheels for ros2_control.

    Args:
        robot: The robot.
        runs: Logs with wheel speeds and a measured twist, for the covariances.
        horizon: Of the covariance of the pose [s].
        height: Of the base [m].

    Raises UnsupportedError for other wheels, InputError for runs that cannot tell.
    """
    refuse("ros2-control", robot)
    covariances, omissions = covariance(robot, as_list(runs), horizon), left_out("ros2-control", robot)
    about = [f"{robot.name}, by omnidyn.", *(f"Not in it: {words}" for words in omissions), *NOTES]
    parts = links(robot, height_of(robot, height))
    files = {
        "controllers.yaml": hash_comment(about) + _controllers(robot, covariances, horizon),
        "velocity_smoother.yaml": hash_comment(about[:1]) + _smoother(robot),
        "robot.urdf": description(robot.name, parts, omissions, outward=True),
        "bringup.launch.py": python_comment(about[:1]) + _LAUNCH,
    }
    return Export(
        "ros2-control", robot.name, files, omissions, (f"covariances: {covariances.words}", *NOTES), folder=True
    )


def order(robot: Robot) -> list[int]:
    """The wheels counter-clockwise from forward, counted from 0."""
    return [int(k) for k in np.argsort(np.mod(robot.wheels.azimuth_deg, 360.0))]


def offset(robot: Robot) -> float:
    """The azimuth of the first of them [rad]."""
    return float(np.radians(np.mod(robot.wheels.azimuth_deg, 360.0)[order(robot)[0]]))


def limits(robot: Robot) -> tuple[FloatArray, FloatArray]:
    """(speed, acceleration from rest) that the motors can keep along each axis alone, friction taken off. (3,) each.

    [m/s, m/s, rad/s] and [m/s^2, m/s^2, rad/s^2], with some headroom; 0 on an axis that its friction holds.
    """
    volts = float(np.min(robot.motor.voltage_limit))
    volts_left = np.maximum(volts - axis_gains(robot)[:, 0], 0.0)
    return HEADROOM * volts_left / axis_gains(robot)[:, 1], HEADROOM * volts_left / axis_gains(robot)[:, 2]


def _controllers(robot: Robot, covariances: Covariance, horizon: float) -> str:
    names = ", ".join(f'"wheel{k + 1}_joint"' for k in order(robot))
    return f"""\
# Covariances: {covariances.words}.
controller_manager:
  ros__parameters:
    update_rate: {RATE}
    joint_state_broadcaster:
      type: joint_state_broadcaster/JointStateBroadcaster
    omni_wheel_drive_controller:
      type: omni_wheel_drive_controller/OmniWheelDriveController

omni_wheel_drive_controller:
  ros__parameters:
    wheel_names: [{names}]
    wheel_offset: {yaml_number(offset(robot))}
    robot_radius: {yaml_number(float(np.mean(robot.wheels.robot_radius)))}
    wheel_radius: {yaml_number(float(robot.wheels.radii.mean()))}
    odom_frame_id: odom
    base_frame_id: base_link
    position_feedback: false
    cmd_vel_timeout: 0.5
    diagonal_covariance:
      # of the pose after {horizon:g} s
      pose: {_diagonal(covariances.pose)}
      twist: {_diagonal(covariances.twist)}
"""


def _diagonal(variance: FloatArray) -> str:
    """x, y, z, roll, pitch, yaw: what the robot cannot do is certain to be 0, and said with a tiny variance."""
    x, y, yaw = (f"{value:.6e}" for value in np.maximum(variance, 1e-12))
    return f"[{x}, {y}, 1.0e-12, 1.0e-12, 1.0e-12, {yaw}]"


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
"""


_LAUNCH = '''\
"""Start ros2_control with the controller of this folder."""

from pathlib import Path

from launch import LaunchDescription
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

HERE = Path(__file__).resolve().parent


def generate_launch_description():
    text = (HERE / "robot.urdf").read_text("utf-8")
    description = {"robot_description": ParameterValue(text, value_type=str)}
    controllers = str(HERE / "controllers.yaml")
    return LaunchDescription([
        Node(package="robot_state_publisher", executable="robot_state_publisher", parameters=[description]),
        Node(package="controller_manager", executable="ros2_control_node", parameters=[description, controllers]),
        Node(package="controller_manager", executable="spawner",
             arguments=["joint_state_broadcaster", "omni_wheel_drive_controller"]),
    ])
'''


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


def odometry_error(robot: Robot, run: Run) -> FloatArray:
    """Twist from the wheels minus the measured one, NaN where either is missing. Shape (samples, 3)."""
    if run.wheel_speed is None or run.twist is None:
        raise InputError(
            "cannot compare odometry with this run",
            got=", ".join(run.channels) or "no channel",
            expected="wheel_speed and twist",
            remedy="give logs that measured both, such as by motion capture",
        )
    return twist_from_wheel_speed(robot.wheels, run.wheel_speed) - run.twist


def _from_runs(robot: Robot, runs: Sequence[Run], horizon: float) -> Covariance:
    errors = [odometry_error(robot, run) for run in runs]
    samples = np.concatenate([error[np.isfinite(error).all(axis=1)] for error in errors])
    if len(samples) < LEAST_SAMPLES:
        raise InputError(
            "too few samples for a covariance",
            got=f"{len(samples)} samples with wheel speeds and twist",
            expected=f"{LEAST_SAMPLES} or more",
            remedy="give longer logs",
        )
    twist = np.mean(samples**2, axis=0)
    ways = [_windows(error, run.t, horizon) for error, run in zip(errors, runs, strict=True)]
    windows = np.concatenate(ways)
    words = f"from {len(runs)} log{'s' * (len(runs) > 1)}, {len(samples)} samples of odometry and measured twist"
    if len(windows):
        return Covariance(twist, np.mean(windows**2, axis=0), f"{words}, {len(windows)} windows of {horizon:g} s")
    steps = np.concatenate([np.diff(run.t) for run in runs])
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
