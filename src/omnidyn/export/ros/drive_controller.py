"""The controllers of ros2_controllers that drive a robot: their kinematics, their parameters, the topics they have.

omni_wheel_drive_controller numbers the wheels counter-clockwise from `wheel_offset`; its joints turn the other way than
ours: r w = v_x sin theta - v_y cos theta - b omega, minus the row of G^T (odometry.cpp). All joints turn outwards.

mecanum_drive_controller names four wheels by their places; all joints forward drive the robot forward:

    r w = v_x -+ v_y -+ k omega     front left - -, front right + +, rear right - +, rear left + -   (k = b)

so that left wheels, whose rows of G^T are minus that, turn outwards, and right ones inwards, as ours.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.export.features import PLACES, mecanum_places
from omnidyn.export.spelling import yaml_number
from omnidyn.model.robot import Robot


class DriveController(NamedTuple):
    """A controller of ROS for a robot: its name, type, the topic on which it takes a stamped twist.

    outward: wheels, counted from 0, whose joints turn about an axis that points outwards. parameters: as YAML.
    odometry, transform: topics that it publishes; transform: "" for /tf itself.
    """

    name: str
    type: str
    command: str
    outward: frozenset[int]
    parameters: str
    odometry: str
    transform: str
    words: str


def drive_controller(robot: Robot, joints: Sequence[str], twist: FloatArray, pose: FloatArray) -> DriveController:
    """The controller that takes this robot. joints: their names; twist, pose: variances along x, y, yaw."""
    wheels = mecanum_places(robot)
    if wheels is None:
        return _omni(robot, joints, twist, pose)
    name = "mecanum_drive_controller"
    commands = "".join(f'    {place}_wheel_command_joint_name: "{joints[k]}"\n' for place, k in wheels.items())
    parameters = f"""\
{commands}    reference_timeout: 0.5
    kinematics:
      base_frame_offset: {{x: 0.0, y: 0.0, theta: 0.0}}
      wheels_radius: {yaml_number(float(robot.wheels.radii.mean()))}
      # half track + half wheelbase
      sum_of_robot_center_projection_on_X_Y_axis: {yaml_number(float(np.mean(robot.wheels.robot_radius)))}
    odom_frame_id: odom
    base_frame_id: base_link
    enable_odom_tf: true
    pose_covariance_diagonal: {_diagonal(pose)}
    twist_covariance_diagonal: {_diagonal(twist)}
"""
    return DriveController(
        name,
        f"{name}/MecanumDriveController",
        f"/{name}/reference",
        frozenset(k for place, k in wheels.items() if PLACES[place][1]),
        parameters,
        f"/{name}/odometry",
        f"/{name}/tf_odometry",
        "the joints of the left wheels turn outwards, as that controller has it, opposite to the wheels of omnidyn: "
        "all joints forward drive the robot forward",
    )


def _omni(robot: Robot, joints: Sequence[str], twist: FloatArray, pose: FloatArray) -> DriveController:
    name = "omni_wheel_drive_controller"
    parameters = f"""\
    wheel_names: [{", ".join(f'"{joints[k]}"' for k in order(robot))}]
    wheel_offset: {yaml_number(offset(robot))}
    robot_radius: {yaml_number(float(np.mean(robot.wheels.robot_radius)))}
    wheel_radius: {yaml_number(float(robot.wheels.radii.mean()))}
    odom_frame_id: odom
    base_frame_id: base_link
    position_feedback: false
    cmd_vel_timeout: 0.5
    diagonal_covariance:
      pose: {_diagonal(pose)}
      twist: {_diagonal(twist)}
"""
    return DriveController(
        name,
        f"{name}/OmniWheelDriveController",
        f"/{name}/cmd_vel",
        frozenset(range(robot.wheels.count)),
        parameters,
        f"/{name}/odom",
        "",
        "the joints of this URDF turn outwards, as that controller has it: opposite to the wheels of omnidyn",
    )


def order(robot: Robot) -> list[int]:
    """The wheels counter-clockwise from forward, counted from 0."""
    return [int(k) for k in np.argsort(np.mod(robot.wheels.azimuth_deg, 360.0))]


def offset(robot: Robot) -> float:
    """The azimuth of the first of them [rad]."""
    return float(np.radians(np.mod(robot.wheels.azimuth_deg, 360.0)[order(robot)[0]]))


def _diagonal(variance: FloatArray) -> str:
    """x, y, z, roll, pitch, yaw: what the robot cannot do is certain to be 0, and said with a tiny variance."""
    x, y, yaw = (f"{value:.6e}" for value in np.maximum(variance, 1e-12))
    return f"[{x}, {y}, 1.0e-12, 1.0e-12, 1.0e-12, {yaw}]"
