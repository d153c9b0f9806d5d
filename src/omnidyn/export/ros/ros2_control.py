"""ros2-control: omni_wheel_drive_controller for this robot: parameters, URDF, velocity smoother, launch file.

That controller numbers the wheels counter-clockwise from `wheel_offset`; its joints turn the other way than ours:
r w = v_x sin theta - v_y cos theta - b omega, minus the row of G^T (odometry.cpp of ros2_controllers). So wheels are
named in the order of their azimuth, and the joints of this URDF turn outwards: the same wheel turns the same way.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.export.bodies.links import links
from omnidyn.export.bodies.shape import height_of
from omnidyn.export.bodies.urdf import description
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import axis_gains
from omnidyn.export.ros.covariance import Covariance, covariance
from omnidyn.export.spelling import hash_comment, python_comment, yaml_number
from omnidyn.model.robot import Robot
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

    runs: logs with wheel speeds and a measured twist, for the covariances. horizon [s]: of the covariance of the pose.
    height [m]: of the base. Raises UnsupportedError for other wheels, InputError for runs that cannot tell.
    """
    refuse("ros2-control", robot)
    found, missing = covariance(robot, as_list(runs), horizon), left_out("ros2-control", robot)
    about = [f"{robot.name}, by omnidyn.", *(f"Not in it: {words}" for words in missing), *NOTES]
    parts = links(robot, height_of(robot, height))
    files = {
        "controllers.yaml": hash_comment(about) + _controllers(robot, found, horizon),
        "velocity_smoother.yaml": hash_comment(about[:1]) + _smoother(robot),
        "robot.urdf": description(robot.name, parts, missing, outward=True),
        "bringup.launch.py": python_comment(about[:1]) + _LAUNCH,
    }
    return Export("ros2-control", robot.name, files, missing, (f"covariances: {found.words}", *NOTES), folder=True)


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
    left = np.maximum(volts - axis_gains(robot)[:, 0], 0.0)
    return HEADROOM * left / axis_gains(robot)[:, 1], HEADROOM * left / axis_gains(robot)[:, 2]


def _controllers(robot: Robot, found: Covariance, horizon: float) -> str:
    names = ", ".join(f'"wheel{k + 1}_joint"' for k in order(robot))
    return f"""\
# Covariances: {found.words}.
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
      pose: {_diagonal(found.pose)}
      twist: {_diagonal(found.twist)}
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
