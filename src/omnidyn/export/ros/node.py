"""ros2-node: a node that drives the robot, as text: feed-forward with friction, feedback, a dead-man stop.

No omnidyn runs on the robot: drive_loop.py is plain Python without imports beyond the standard library: also for a
robot without ROS. omnidyn_node.py puts it on /cmd_vel and /joint_states, and gives duties. Constants come from the
robot: gains of feedforward/gains.py, the twist from the wheels by the pseudo-inverse of G^T. Checked without ROS:
against stubs of rclpy, with our simulation as the robot. With a controller: see follower.py.
"""

from __future__ import annotations

import os

import numpy as np

from omnidyn.errors import InputError
from omnidyn.export.contract import Export
from omnidyn.export.features import left_out, refuse
from omnidyn.export.feedforward.gains import gains
from omnidyn.export.ros.follower import BUILD, NODE_END, NUMBERS, follower
from omnidyn.export.ros.ros2_control import limits
from omnidyn.export.spelling import number, python_comment
from omnidyn.model.deadzone import HIGHEST, axis_patterns, breakaway_voltage
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import twist_from_wheel_speed

KIND = "ros2-node"
RATE = 100.0  # [Hz]
TIMEOUT = 0.3  # [s]
NOTES = (
    "made and checked without ROS: syntax, and its logic over stubs of rclpy with a simulated robot; try it on blocks",
    "duties are of the supply: give its voltage as the parameter supply_V where it is measured",
)


def ros2_node(
    robot: Robot, controller: str | os.PathLike = "", dt: float | None = None, timeout: float = TIMEOUT
) -> Export:
    """A node for /cmd_vel and /joint_states that gives duties, and the loop in it as plain Python.

    controller: by name or file, then the node takes a path or /cmd_vel, and /odom, and steers by its C. dt [s]: between
    two steps; 0.01, or 0.02 with a controller. timeout [s]: without a command for so long the robot stops. Raises
    InputError, and UnsupportedError for a robot or a controller that cannot be exported.
    """
    from omnidyn.control.feedforward import DT

    dt = dt if dt is not None else (DT if controller else 1.0 / RATE)
    for name, value, most in (("dt", dt, 1.0), ("timeout", timeout, 60.0)):
        if not 0.0 < value <= most:
            raise InputError("out of range", got=value, expected=f"more than 0 and at most {most:g}", where=name)
    own = "c-controller" if controller else KIND
    refuse(own, robot)
    missing = left_out(own, robot)
    about = python_comment([f"{robot.name}, by omnidyn. SI units.", *(f"Not in it: {words}" for words in missing),
                          "Checked without ROS, see docs/exports.md: try it on blocks first."])  # fmt: skip
    if controller:
        files = follower(robot, controller, dt, timeout, about)
        return Export(KIND, robot.name, files, missing, (*NOTES, BUILD), folder=True)
    files = {
        "drive_loop.py": about + _constants(robot, 1.0 / dt, timeout) + NUMBERS + _LOOP,
        "omnidyn_node.py": about + _NODE + NODE_END,
    }
    return Export(KIND, robot.name, files, missing, NOTES, folder=True)


def _constants(robot: Robot, rate: float, timeout: float) -> str:
    """What the loop knows of the robot."""
    found, (_, acceleration) = gains(robot), limits(robot)
    to_twist = twist_from_wheel_speed(robot.wheels, np.eye(robot.wheels.count)).T
    supply = robot.drive.supply or float(np.max(robot.motor.voltage_limit))
    holding = np.minimum(breakaway_voltage(robot, axis_patterns(robot)), HIGHEST)
    return f'''"""The loop: a twist that is wanted and speeds of wheels in, duties out. No ROS, no omnidyn."""

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
KS = {_row(found.value[:, 0])}
KV = {_row(found.value[:, 1])}
KA = {_row(found.value[:, 2])}
START = {_row(holding)}  # [V] from rest
PATTERN = {_table(found.pattern)}  # [axis][motor]
TO_TWIST = {_table(to_twist)}  # [axis][wheel]: twist from the speeds of the wheels [rad/s]
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
        """Duties of the motors, -1 to 1. All 0 where `status` is below 0: the dead-man stop is STOPPED."""
        now, dt, supply = number(now), number(dt), number(supply)
        self.status = OK if is_within(supply, SUPPLIES) else BAD_SUPPLY
        if not is_within(dt, STEPS):
            self.status = BAD_TIME
        if not self.alive(now):
            self.status = STOPPED
        if self.status < 0:
            self.set_point = [0.0, 0.0, 0.0]
            return [0.0] * WHEELS
        volts = [0.0] * WHEELS
        known = self.twist is not None and 0.0 <= now - self.told_at <= TIMEOUT
        for axis in range(3):
            before = self.set_point[axis]
            most = ACCELERATION[axis] * dt
            after = before + max(-most, min(most, self.goal[axis] - before))
            self.set_point[axis] = after
            u = KV[axis] * after + KA[axis] * (after - before) / dt
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

_NODE = '''"""/cmd_vel (or a path follower that publishes it) and /joint_states in, duties out, with a dead-man stop."""

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
        names = [f"wheel{k + 1}_joint" for k in range(WHEELS)]
        self.joints = list(self.declare_parameter("joints", names).value)
        self.supply = float(self.declare_parameter("supply_V", SUPPLY).value)
        stamped = bool(self.declare_parameter("stamped", True).value)
        self.duty = self.create_publisher(Float64MultiArray, "duty", 10)
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
