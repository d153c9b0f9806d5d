"""A node with a controller: a loop that follows a path or /cmd_vel by the C of c-controller, and a node around it.

control_shared.c holds the one controller of the node, for a shared library that path_loop.py loads: plain Python with
nothing beyond the standard library, so it drives a robot without ROS as well. Checked like the other node: against
stubs of rclpy, with our simulation as the robot.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from omnidyn.control.controllers import controller_spec
from omnidyn.control.mpc.controller import Mpc
from omnidyn.export.code.c_controller import c_controller
from omnidyn.export.contract import Content
from omnidyn.export.spelling import number
from omnidyn.model.robot import Robot

BUILD = "compile it: cc -O2 -std=c99 -shared -fPIC -o libomnidyn_control.so omnidyn_control.c control_shared.c -lm"


def follower(robot: Robot, controller: str | os.PathLike, dt: float, timeout: float, about: str) -> dict[str, Content]:
    """The files of a node that follows by a controller, each step `dt` [s]. Raises UnsupportedError, as c_controller.

    timeout [s]: without a pose, or a command where one is followed, for so long the robot stops.
    """
    code = c_controller(robot, controller, dt)
    law: Any = controller_spec(controller).make(robot, dt=dt)
    if isinstance(law, Mpc):
        ahead = [law.steps_late * dt + k * dt for k in range(law.horizon + 1)]
    else:
        ahead = [0.0, law.late, law.late + dt]
    constants = f'''"""The loop: a path or a twist that is wanted and the pose in, outputs out. No ROS, no omnidyn."""

import bisect
import ctypes
import math
import os
import sys

SUPPLIES = 1e-3, 1e5  # [V] that a battery may have
STOPPED, BAD_SUPPLY = -1, -2  # what a step says of itself, beside what the controller says: see omnidyn_control.h
FARTHEST = 1e9  # of any number: what is beyond is none
WHEELS = {robot.wheels.count}
DT = {number(dt)}  # [s] between two steps
TIMEOUT = {number(timeout)}  # [s] without a pose, or without a command, after which the robot stops
SUPPLY = {number(robot.drive.supply or float(np.min(robot.motor.voltage_limit)))}  # [V], where none is given
OUTPUT = "{law.output}"  # what the controller gives: voltage, duty, or wheel_speed
# [s] from now: when it wants to know the path.
AHEAD = ({", ".join(number(time) for time in ahead)})
'''
    return {
        **code.files,
        "control_shared.c": _SHARED,
        "path_loop.py": about + constants + NUMBERS + _STEP,
    }


# What both loops ask of numbers from outside.
NUMBERS = '''

def number(value):
    """The value as a float; not a number where it is none."""
    try:
        return math.nan if isinstance(value, (str, bytes)) else float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def numbers(values, count):
    """The values as `count` numbers of a size that robots have; None where they are not."""
    try:
        found = [number(each) for each in values]
    except TypeError:
        return None
    return found if len(found) == count and all(abs(each) <= FARTHEST for each in found) else None


def is_within(value, limits):
    """Whether a supply or a time step is in a range that batteries and clocks have."""
    return limits[0] <= value <= limits[1]
'''

# How every node ends: its step, its last word, its loop. rclpy imports are at the top of the text before it.
NODE_END = '''    def on_timer(self):
        """One step of the loop."""
        message = Float64MultiArray()
        message.data = self.loop.step(self.now(), supply=self.supply)
        self.output.publish(message)

    def stop(self):
        """Zeros, the last word of the node."""
        message = Float64MultiArray()
        message.data = [0.0] * WHEELS
        self.output.publish(message)


def main():
    """Run until interrupted; then stop."""
    rclpy.init()
    node = OmnidynNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.stop()
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
'''

_SHARED = """/* The controller of a node, for a shared library:
   cc -O2 -std=c99 -shared -fPIC -o libomnidyn_control.so omnidyn_control.c control_shared.c -lm */
#include "omnidyn_control.h"

static omnidyn_control control;

void control_reset(void);
int control_step(float elapsed, const float *pose, const float *twist, const float *path, float *output);

void control_reset(void) { omnidyn_control_reset(&control); }

int control_step(float elapsed, const float *pose, const float *twist, const float *path, float *output)
{
    return omnidyn_control_step(&control, elapsed, pose, twist, (const omnidyn_motion *)path, output);
}
"""

_STEP = '''LEAD = (0.05, 0.05, 0.2)  # [m, m, rad] by which what is asked for may be ahead of a robot that cannot follow
# Beside this file, or beside the program where colcon has made links to the sources.
FOLDERS = [os.path.dirname(os.path.abspath(path)) for path in (__file__, sys.argv[0])]
PLACES = [os.path.join(folder, "libomnidyn_control.so") for folder in FOLDERS]
LIBRARY = next((place for place in PLACES if os.path.exists(place)), PLACES[0])


def nearest_turn(angle, to):
    """The same angle, full turns added so that it is nearest to another."""
    return angle + 2.0 * math.pi * round((to - angle) / (2.0 * math.pi))


class Course:
    """Rows (t [s], x [m], y [m], heading [rad]), times increasing, joined by straight lines."""

    def __init__(self, rows):
        self.times = [row[0] for row in rows]
        self.poses = [list(row[1:]) for row in rows]
        for before, pose in zip(self.poses, self.poses[1:]):
            pose[2] = nearest_turn(pose[2], before[2])

    def at(self, t):
        """(pose, velocity) at a time; before the first row and after the last one it stands still."""
        k = bisect.bisect_right(self.times, t)
        if k == 0 or k == len(self.times):
            return self.poses[min(k, len(self.poses) - 1)], [0.0, 0.0, 0.0]
        step = self.times[k] - self.times[k - 1]
        velocity = [(b - a) / step for a, b in zip(self.poses[k - 1], self.poses[k])]
        return [a + v * (t - self.times[k - 1]) for a, v in zip(self.poses[k - 1], velocity)], velocity


class Ahead:
    """A twist that is held from a pose on."""

    def __init__(self, t, pose, twist):
        self.t, self.pose, self.twist = t, list(pose), twist

    def at(self, t):
        """(pose, velocity) at a time: along an arc of a circle."""
        vx, vy, omega = self.twist
        span = t - self.t
        turn = omega * span
        along, aside = (math.sin(turn) / omega, (1.0 - math.cos(turn)) / omega) if abs(turn) > 1e-9 else (span, 0.0)
        c, s = math.cos(self.pose[2]), math.sin(self.pose[2])
        dx, dy = vx * along - vy * aside, vx * aside + vy * along
        ct, st = math.cos(self.pose[2] + turn), math.sin(self.pose[2] + turn)
        pose = [self.pose[0] + c * dx - s * dy, self.pose[1] + s * dx + c * dy, self.pose[2] + turn]
        return pose, [ct * vx - st * vy, st * vx + ct * vy, omega]


class PathLoop:
    """Call `follow` with a path or `command` with a twist, `measured` when a pose is known, `step` every DT.

    Times are seconds of any clock that does not go back. The last of `follow` and `command` counts. `status` is what
    the controller said of its last step: see omnidyn_control.h. Where it is STOPPED or BAD_SUPPLY all duties are 0.
    """

    def __init__(self, library=LIBRARY):
        self.code = ctypes.CDLL(library)
        self.code.control_step.argtypes = [ctypes.c_float, *[ctypes.c_void_p] * 4]
        self.code.control_reset()
        self.course = self.until = self.pose = self.told_at = self.stepped_at = None
        self.twist, self.status = [0.0, 0.0, 0.0], STOPPED

    def follow(self, now, rows):
        """Rows (t, x, y, heading), t in seconds from now; no rows, or what is no path, stops the robot."""
        self.course = None
        try:
            now, rows = number(now), [numbers(row, 4) for row in rows]
        except TypeError:
            return
        if rows and all(rows) and all(a[0] < b[0] for a, b in zip(rows, rows[1:])):
            near = self.pose[2] if self.pose is not None else 0.0
            first = nearest_turn(rows[0][3], near)
            rows[0][3] = first
            self.course = Course([(now + t, x, y, heading) for t, x, y, heading in rows])
            self.until = now + rows[-1][0] + TIMEOUT

    def command(self, now, twist):
        """A twist (vx, vy, omega) of the body; what is no number is no command."""
        now, twist = number(now), numbers(twist, 3)
        if twist is None or self.pose is None:
            return
        start = self.pose
        if isinstance(self.course, Ahead) and now <= self.until:
            start = self.course.at(now)[0]
            start = [p + max(-most, min(most, s - p)) for s, p, most in zip(start, self.pose, LEAD)]
        self.course, self.until = Ahead(now, start, twist), now + TIMEOUT

    def measured(self, now, pose, twist):
        """The pose in the world and the twist of the body; others are left out."""
        pose, twist = numbers(pose, 3), numbers(twist, 3)
        if pose is None or twist is None:
            return
        heading = pose[2] if self.pose is None else nearest_turn(pose[2], self.pose[2])
        self.pose, self.twist, self.told_at = [pose[0], pose[1], heading], twist, number(now)

    def alive(self, now):
        """Whether there is something to follow, and it is known where the robot is."""
        known = self.pose is not None and 0.0 <= now - self.told_at <= TIMEOUT
        return known and self.course is not None and now <= self.until

    def step(self, now, supply=SUPPLY):
        """What the drive takes, of each wheel. All 0 where `status` is below 0: the dead-man stop is STOPPED."""
        now, supply = number(now), number(supply)
        self.status = 0 if is_within(supply, SUPPLIES) else BAD_SUPPLY
        if not self.alive(now):
            self.course, self.status = None, STOPPED
        if self.status < 0:
            self.stepped_at = None
            self.code.control_reset()
            return [0.0] * WHEELS
        elapsed = 0.0 if self.stepped_at is None else now - self.stepped_at
        self.stepped_at = now
        rows = [each for ahead in AHEAD for part in self.course.at(now + ahead) for each in part]
        path, output = (ctypes.c_float * len(rows))(*rows), (ctypes.c_float * WHEELS)()
        pose, twist = (ctypes.c_float * 3)(*self.pose), (ctypes.c_float * 3)(*self.twist)
        self.status = self.code.control_step(elapsed, pose, twist, path, output)
        if OUTPUT == "wheel_speed":
            return list(output)
        scale = 1.0 / supply if OUTPUT == "voltage" else 1.0
        return [max(-1.0, min(1.0, scale * each)) for each in output]
'''

SETUP = '''"""path or /cmd_vel, and /odom in, @TOPIC@ out, with a dead-man stop."""

import math

import rclpy
from geometry_msgs.msg import Twist, TwistStamped
from nav_msgs.msg import Odometry, Path
from path_loop import DT, SUPPLY, WHEELS, PathLoop
from rclpy.node import Node
from std_msgs.msg import Float64MultiArray


def heading_of(q):
    """The heading of a quaternion [rad]."""
    return math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))


class OmnidynNode(Node):
    """Parameters: stamped (TwistStamped on /cmd_vel), supply_V, speed_m_s (along a path whose poses have no times)."""

    def __init__(self):
        super().__init__("omnidyn_node")
        self.loop = PathLoop()
        self.supply = float(self.declare_parameter("supply_V", SUPPLY).value)
        speed = float(self.declare_parameter("speed_m_s", 0.2).value)
        self.speed = speed if speed > 1e-3 else 0.2
        stamped = bool(self.declare_parameter("stamped", True).value)
        self.output = self.create_publisher(Float64MultiArray, "@TOPIC@", 10)
        self.create_subscription(TwistStamped if stamped else Twist, "cmd_vel", self.on_command, 10)
        self.create_subscription(Path, "path", self.on_path, 10)
        self.create_subscription(Odometry, "odom", self.on_odometry, 10)
        self.create_timer(DT, self.on_timer)

    def now(self):
        """Seconds of the clock of the node."""
        return self.get_clock().now().nanoseconds * 1e-9

    def on_command(self, message):
        """A twist that somebody asks for."""
        twist = getattr(message, "twist", message)
        self.loop.command(self.now(), (twist.linear.x, twist.linear.y, twist.angular.z))

    def on_path(self, message):
        """Poses at the times of their stamps, the first one now; an empty path stops the robot."""
        posed = [each.pose for each in message.poses]
        poses = [(each.position.x, each.position.y, heading_of(each.orientation)) for each in posed]
        stamps = [each.header.stamp.sec + 1e-9 * each.header.stamp.nanosec for each in message.poses]
        times = [each - stamps[0] for each in stamps]
        if not all(a < b for a, b in zip(times, times[1:])):
            times = [0.0] * len(poses)
            for k in range(1, len(poses)):
                (x, y, turn), (x0, y0, turn0) = poses[k], poses[k - 1]
                turned = abs(math.remainder(turn - turn0, 2.0 * math.pi))
                times[k] = times[k - 1] + max(math.hypot(x - x0, y - y0) / self.speed, turned, 1e-3)
        self.loop.follow(self.now(), [(t, *pose) for t, pose in zip(times, poses)])

    def on_odometry(self, message):
        """Where the robot is, and its twist in its own frame."""
        pose, twist = message.pose.pose, message.twist.twist
        self.loop.measured(
            self.now(), (pose.position.x, pose.position.y, heading_of(pose.orientation)),
            (twist.linear.x, twist.linear.y, twist.angular.z),
        )

'''
