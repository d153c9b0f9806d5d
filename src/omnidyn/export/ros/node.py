"""ros2-node: a package with a node that drives the robot: feed-forward with friction, feedback, a dead-man stop.

No omnidyn runs on the robot: drive_loop.py is plain Python without imports beyond the standard library: also for a
robot without ROS. omnidyn_node.py puts it on /cmd_vel and /joint_states, and gives duties; set points of the wheels
[rad/s] where the drive is a speed loop. Constants come from the robot: gains of feedforward/gains.py, the twist from
the wheels by the pseudo-inverse of G^T, their set points by G^T. Checked without ROS: against stubs of rclpy, with our
simulation as the robot. With a controller: see `follower`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from omnidyn.control.feedforward import DT
from omnidyn.errors import InputError
from omnidyn.export.bodies.links import joint_names
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import gains
from omnidyn.export.ros.package import by_hand, package, package_name, read_me
from omnidyn.export.ros.path_node import BUILD, NODE_END, NUMBERS, SETUP, follower
from omnidyn.export.ros.ros2_control import HEADROOM, limits
from omnidyn.export.spelling import filled, number, python_comment
from omnidyn.model.deadzone import HIGHEST, axis_patterns, breakaway_voltage
from omnidyn.model.drive import SPEED
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import per_wheel, twist_from_wheel_speed

KIND = "ros2-node"
RATE = 100.0  # [Hz]
SHEBANG = "#!/usr/bin/env python3\n"
TIMEOUT = 0.3  # [s]
NOTES = (
    "made and checked without ROS: syntax, and its logic over stubs of rclpy with a simulated robot; try it on blocks",
)
OF_SUPPLY = "duties are of the supply: give its voltage as the parameter supply_V where it is measured"
OF_LOOP = "set points are speeds of the wheels [rad/s], all forward turn the robot counter-clockwise"
DEPENDS = ("geometry_msgs", "nav_msgs", "rclpy", "sensor_msgs", "std_msgs")


def ros2_node(
    robot: Robot,
    controller: str | os.PathLike = "",
    dt: float | None = None,
    timeout: float = TIMEOUT,
    joints: Sequence[str] = (),
) -> Export:
    """A package with a node for /cmd_vel and /joint_states that gives duties, and the loop in it as plain Python.

    For a robot whose drive is a speed loop it gives set points of the wheels [rad/s].

    Args:
        robot: The robot.
        controller: By name or file; then the node takes a path or /cmd_vel, and /odom, and steers by its C.
        dt: Between two steps [s]; 0.01, or 0.02 with a controller.
        timeout: Without a command for so long the robot stops [s].
        joints: Names of the joints, in the order of the wheels; wheel1_joint, ... by default.

    Raises InputError, and UnsupportedError for a robot or a controller that cannot be exported.
    """

    dt = dt if dt is not None else (DT if controller else 1.0 / RATE)
    for name, value, largest in (("dt", dt, 1.0), ("timeout", timeout, 60.0)):
        if not 0.0 < value <= largest:
            raise InputError("out of range", got=value, expected=f"more than 0 and at most {largest:g}", where=name)
    kind = "c-controller" if controller else KIND
    refuse(kind, robot)
    omissions, names = left_out(kind, robot), joint_names(robot, joints)
    about = python_comment(
        [
            f"{robot.name}, by omnidyn. SI units.",
            *(f"Not in it: {words}" for words in omissions),
            "Checked without ROS, see docs/exports.md: try it on blocks first.",
        ]
    )
    is_loop = robot.drive.kind == SPEED
    topic, notes = ("wheel_speed", (*NOTES, OF_LOOP)) if is_loop else ("duty", (*NOTES, OF_SUPPLY))
    sources = ()
    if controller:
        files, sources = follower(robot, controller, dt, timeout, about), ("omnidyn_control.c", "control_shared.c")
        notes = (*notes, BUILD, *map(str, robot.pose_lag_of_log))
    else:
        loop = _LOOP + (_TO_SPEEDS if is_loop else _TO_DUTIES)
        files = {"drive_loop.py": about + _constants(robot, 1.0 / dt, timeout) + NUMBERS + loop}
    quoted = ", ".join(f'"{name}"' for name in names)
    node = filled((SETUP if controller else _NODE) + NODE_END, JOINTS=f"[{quoted}]", TOPIC=topic)
    files["omnidyn_node.py"] = SHEBANG + about + node
    name = package_name(robot.name, "node")
    files["omnidyn_node.launch.py"] = about + filled(_LAUNCH, NAME=name)
    programs = ["omnidyn_node.py", "path_loop.py" if controller else "drive_loop.py"]
    words = f"A node that drives {robot.name}, by omnidyn"
    files |= package(name, words, DEPENDS, ["omnidyn_node.launch.py"], programs, sources)
    files["README.md"] = read_me(robot.name, (*omissions, *notes), _sections(name, topic, names, bool(controller)))
    return Export(KIND, robot.name, files, omissions, notes, folder=True)


def _sections(name: str, topic: str, joints: Sequence[str], follows: bool) -> list[str]:
    """The paragraphs of README.md."""
    heard = "`/path` or `/cmd_vel`, and `/odom`" if follows else "`/cmd_vel` and `/joint_states`"
    listed = ", ".join(f"`{joint}`" for joint in joints)
    return [
        f"Put the folder into the `src` of a workspace of ROS 2, as `{name}`, then:",
        f"    rosdep install --from-paths src --ignore-src\n    colcon build --packages-select {name}\n"
        f"    . install/setup.bash\n    ros2 launch {name} omnidyn_node.launch.py",
        f"It takes {heard}, and publishes `/{topic}` (std_msgs/Float64MultiArray): a number for each wheel, in the "
        f"order {listed}. A controller of ROS that takes these, such as JointGroupVelocityController, listens on "
        f"`/CONTROLLER/commands`: remap `{topic}` to it in the launch file.",
        by_hand("the driver of your motors: what takes these numbers, and publishes what the node listens to"),
    ]


_LAUNCH = '''\
"""Start the node of this package."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([
        Node(package="@NAME@", executable="omnidyn_node.py", output="screen", parameters=[{"stamped": True}]),
    ])
'''


def _constants(robot: Robot, rate: float, timeout: float) -> str:
    """What the loop knows of the robot."""
    robot_gains, (_, acceleration) = gains(robot), limits(robot)
    n, radii = robot.wheels.count, robot.wheels.radii
    to_twist = twist_from_wheel_speed(robot.wheels, np.eye(n)).T
    volts = per_wheel(robot.motor.voltage_limit, n)
    supply = robot.drive.supply or float(np.max(volts))
    holding = np.minimum(breakaway_voltage(robot, axis_patterns(robot)), HIGHEST)
    given = "set points of the wheels" if robot.drive.kind == SPEED else "duties"
    return f'''"""The loop: a twist that is wanted and speeds of wheels in, {given} out. No ROS, no omnidyn."""

import math

OK, LIMITED, STOPPED, BAD_SUPPLY, BAD_TIME = 0, 1, -1, -2, -3  # what a step says of itself
SUPPLIES, STEPS = (1e-3, 1e5), (1e-9, 3600.0)  # [V] that a battery may have, [s] from step to step
FARTHEST = 1e9  # of any number: what is beyond is none
WHEELS = {robot.wheels.count}
RATE = {number(rate)}  # [Hz]
TIMEOUT = {number(timeout)}  # [s] without a command, after which the robot stops
LIMIT = {number(float(np.min(robot.motor.voltage_limit)))}  # [V] of a motor
SUPPLY = {number(supply)}  # [V], where none is given
# Along x, along y, about yaw: volts of the most loaded motor per unit of sign, speed, acceleration.
KS = {_row(robot_gains.value[:, 0])}
KV = {_row(robot_gains.value[:, 1])}
KA = {_row(robot_gains.value[:, 2])}
START = {_row(holding)}  # [V] from rest
PATTERN = {_table(robot_gains.pattern)}  # [axis][motor]
TO_TWIST = {_table(to_twist)}  # [axis][wheel]: twist from the speeds of the wheels [rad/s]
TO_WHEELS = {_table((robot.wheels.wrench_matrix / radii).T)}  # [wheel][axis]: speeds of the wheels [rad/s] from a twist
FASTEST = {number(HEADROOM * float(np.min(no_load_speed(robot.motor, volts))))}  # [rad/s] that every wheel can keep
ACCELERATION = {_row(acceleration)}  # [m/s^2, m/s^2, rad/s^2] that the motors can keep
'''


def _row(values: np.ndarray) -> str:
    return f"({', '.join(number(float(value)) for value in values)})"


def _table(values: np.ndarray) -> str:
    return "(\n" + "".join(f"    {_row(row)},\n" for row in values) + ")"


_LOOP = '''
class DriveLoop:
    """Call `command` when a twist is asked for, `measured` when wheels tell their speeds, `step` RATE times a second.

    Times are seconds of any clock that does not go back. `status` says of the last step: OK, LIMITED where a motor is
    at its limit; STOPPED where nobody asks for anything, BAD_SUPPLY, BAD_TIME: then all duties are 0.
    """

    def __init__(self):
        self.goal = [0.0, 0.0, 0.0]
        self.asked_at = None
        self.set_point = [0.0, 0.0, 0.0]
        self.twist = None
        self.told_at = None
        self.status = STOPPED

    def command(self, now, twist):
        """A twist (vx, vy, omega); what is no number is no command."""
        twist = numbers(twist, 3)
        if twist is not None:
            self.goal, self.asked_at = twist, number(now)

    def measured(self, now, speeds):
        """Speeds of all wheels [rad/s], all forward turn the robot counter-clockwise; others are left out."""
        speeds = numbers(speeds, WHEELS)
        if speeds is not None:
            self.twist = [sum(a * b for a, b in zip(row, speeds)) for row in TO_TWIST]
            self.told_at = number(now)

    def alive(self, now):
        """Whether somebody still asks for something."""
        return self.asked_at is not None and 0.0 <= now - self.asked_at <= TIMEOUT

    def step(self, now, dt=1.0 / RATE, supply=SUPPLY):
        """What the drive takes, of each wheel. All 0 where `status` is below 0: the dead-man stop is STOPPED."""
        now, dt, supply = number(now), number(dt), number(supply)
        self.status = OK if is_within(supply, SUPPLIES) else BAD_SUPPLY
        if not is_within(dt, STEPS):
            self.status = BAD_TIME
        if not self.alive(now):
            self.status = STOPPED
        if self.status < 0:
            self.set_point = [0.0, 0.0, 0.0]
            return [0.0] * WHEELS
        before, self.set_point = self.set_point, []
        for axis in range(3):
            most = ACCELERATION[axis] * dt
            self.set_point.append(before[axis] + max(-most, min(most, self.goal[axis] - before[axis])))
        return self.outputs(now, dt, supply, before)
'''

_TO_DUTIES = '''
    def outputs(self, now, dt, supply, before):
        """Duties of the motors, -1 to 1. before: the set point of the step before."""
        volts = [0.0] * WHEELS
        known = self.twist is not None and 0.0 <= now - self.told_at <= TIMEOUT
        for axis in range(3):
            after = self.set_point[axis]
            u = KV[axis] * after + KA[axis] * (after - before[axis]) / dt
            error = after - self.twist[axis] if known else 0.0
            u += KV[axis] * error  # halves the time constant: KA/(2 KV)
            if after != 0.0:
                rests = known and abs(self.twist[axis]) < 1e-3 * abs(after)
                u += math.copysign(max(KS[axis], START[axis]) if rests else KS[axis], after)
            for motor in range(WHEELS):
                volts[motor] += PATTERN[axis][motor] * u
        largest = max(abs(each) for each in volts)
        share = LIMIT / largest if largest > LIMIT else 1.0  # all by the same share: the direction stays
        self.status = LIMITED if largest > min(LIMIT, supply) else OK
        return [max(-1.0, min(1.0, share * each / supply)) for each in volts]
'''

_TO_SPEEDS = '''
    def outputs(self, now, dt, supply, before):
        """Set points of the wheels [rad/s], for the loop in the firmware, which makes up for friction."""
        speeds = [sum(a * b for a, b in zip(row, self.set_point)) for row in TO_WHEELS]
        largest = max(abs(speed) for speed in speeds)
        share = FASTEST / largest if largest > FASTEST else 1.0  # all by the same share: the direction stays
        self.status = LIMITED if largest > FASTEST else OK
        return [share * speed for speed in speeds]
'''

_NODE = '''"""/cmd_vel (or a follower that publishes it) and /joint_states in, @TOPIC@ out, with a dead-man stop."""

import rclpy
from drive_loop import RATE, SUPPLY, WHEELS, DriveLoop
from geometry_msgs.msg import Twist, TwistStamped
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray


class OmnidynNode(Node):
    """Parameters: joints (names in the order of the wheels), stamped (TwistStamped on /cmd_vel), supply_V."""

    def __init__(self):
        super().__init__("omnidyn_node")
        self.loop = DriveLoop()
        self.joints = list(self.declare_parameter("joints", @JOINTS@).value)
        self.supply = float(self.declare_parameter("supply_V", SUPPLY).value)
        stamped = bool(self.declare_parameter("stamped", True).value)
        self.output = self.create_publisher(Float64MultiArray, "@TOPIC@", 10)
        kind = TwistStamped if stamped else Twist
        self.create_subscription(kind, "cmd_vel", self.on_command, 10)
        self.create_subscription(JointState, "joint_states", self.on_joints, 10)
        self.create_timer(1.0 / RATE, self.on_timer)

    def now(self):
        """Seconds of the clock of the node."""
        return self.get_clock().now().nanoseconds * 1e-9

    def on_command(self, message):
        """A twist that somebody asks for."""
        twist = getattr(message, "twist", message)
        self.loop.command(self.now(), (twist.linear.x, twist.linear.y, twist.angular.z))

    def on_joints(self, message):
        """Speeds by name: the order is free, and velocities may be missing."""
        found = dict(zip(message.name, message.velocity))
        if all(name in found for name in self.joints):
            self.loop.measured(self.now(), [found[name] for name in self.joints])

'''
