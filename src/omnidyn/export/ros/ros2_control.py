"""ros2-control: a package for ros2_control: parameters of the drive controller, URDF, velocity smoother, launch file.

Evenly spaced omni wheels are driven by omni_wheel_drive_controller, four mecanum wheels by mecanum_drive_controller:
see drive_controller.py. Joints of the URDF turn the way that the controller has it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.export.bodies.inertias import height_of
from omnidyn.export.bodies.links import joint_names, links
from omnidyn.export.bodies.urdf import description
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import axis_gains
from omnidyn.export.ros.drive_controller import DriveController, drive_controller
from omnidyn.export.ros.odometry_covariance import Covariance, covariance
from omnidyn.export.ros.package import by_hand, package, package_name, read_me
from omnidyn.export.spelling import filled, hash_comment, python_comment, yaml_number
from omnidyn.model.robot import Robot
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
        by_hand(
            "the hardware plugin: `robot.urdf` names `mock_components/GenericSystem`, whose joints do what they are "
            "told; put in that of your hardware"
        ),
        "The hardware plugin takes and gives speeds of the joints [rad/s], positive about these axes:",
        f"| wheel | joint | azimuth [degree] | axis of the joint points |\n| --- | --- | --- | --- |\n{rows}",
    ]
