"""ros2: a package with a node that drives the program while a key is held, and writes the log."""

from __future__ import annotations

from omnidyn.driving.program import DriveProgram
from omnidyn.export.bodies.links import joint_names
from omnidyn.export.contract import Export
from omnidyn.export.drives.python_core import python_core
from omnidyn.export.drives.rows import about
from omnidyn.export.ros.package import by_hand, package, package_name, read_me
from omnidyn.export.spelling import filled, python_comment
from omnidyn.logs.run_file import columns_of

SHEBANG = "#!/usr/bin/env python3\n"
DEPENDS = ("rclpy", "sensor_msgs", "std_msgs")
TOPICS = {"V": "volts", "duty": "duty", "rad/s": "wheel_speed"}
NOTES = (
    "made and checked without ROS: syntax, and its logic over stubs of rclpy with a simulated robot; try it on blocks",
    "the driver of the motors must switch off by itself where nothing is published for 0.25 s",
)


def ros2(program: DriveProgram) -> Export:
    """A package for ROS 2: /joint_states and /hold in, inputs of the wheels out, and a log that `identify` reads."""
    robot, topic = program.robot, TOPICS[program.unit]
    joints = ", ".join(f'"{name}"' for name in joint_names(robot, ()))
    columns = ["t_s", *columns_of(program.channel, robot.wheels.count), *columns_of("wheel_angle", robot.wheels.count)]
    name = package_name(robot.name, "drive")
    node = filled(_NODE, JOINTS=f"[{joints}]", TOPIC=topic, COLUMNS=",".join(columns))
    files = {"drive_program.py": python_core(program)}
    files["omnidyn_drive.py"] = SHEBANG + python_comment(about(program)[:2]) + node
    files |= package(name, f"Drives a plan with {robot.name}, by omnidyn", DEPENDS, ["README.md"], [*files][::-1])
    sections = [
        f"    colcon build --packages-select {name}\n    ros2 run {name} omnidyn_drive.py",
        "It drives only while something is published on `/hold` (std_msgs/Empty) at least five times a second: "
        "`ros2 topic pub -r 20 /hold std_msgs/msg/Empty`, and Ctrl-C to stop. A stop is for good: write the rest with "
        "`omnidyn drive` (`resume` LOG) and start that.",
        f"It takes `/joint_states`, and `/battery_state` where there is one, and publishes `/{topic}` "
        f"(std_msgs/Float64MultiArray), a number for each wheel in {program.unit}, in the order {joints}. It writes "
        "`omnidyn-log.csv` where it runs: give that to `omnidyn identify`.",
        by_hand("the driver of your motors: what takes these numbers, and publishes the angles of the wheels"),
    ]
    files["README.md"] = read_me(robot.name, NOTES, sections)
    return Export("ros2", robot.name, files, (), NOTES, folder=True)


_NODE = '''"""/joint_states and /hold in, @TOPIC@ out: a program, driven while it is held, and its log."""

import rclpy
from drive_program import DEAD_MAN, DT, RUNNING, WAITING, WHEELS, WORDS, DriveProgram
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, JointState
from std_msgs.msg import Empty, Float64MultiArray


class OmnidynDrive(Node):
    """Parameters: joints (names in the order of the wheels), log (its file)."""

    def __init__(self):
        super().__init__("omnidyn_drive")
        self.program, self.held_at, self.angles, self.supply = DriveProgram(), None, None, None
        self.joints = list(self.declare_parameter("joints", @JOINTS@).value)
        self.log = open(str(self.declare_parameter("log", "omnidyn-log.csv").value), "w", encoding="ascii")
        self.log.write("@COLUMNS@\\n")
        self.output = self.create_publisher(Float64MultiArray, "@TOPIC@", 10)
        self.create_subscription(JointState, "joint_states", self.on_joints, 10)
        self.create_subscription(BatteryState, "battery_state", self.on_battery, 10)
        self.create_subscription(Empty, "hold", self.on_hold, 10)
        self.create_timer(DT, self.on_timer)

    def now(self):
        """Seconds of the clock of the node."""
        return self.get_clock().now().nanoseconds * 1e-9

    def on_hold(self, message):
        """The key is held now."""
        self.held_at = self.now()

    def on_battery(self, message):
        """The supply [V]."""
        self.supply = float(message.voltage)

    def on_joints(self, message):
        """Angles by name: the order is free."""
        found = dict(zip(message.name, message.position))
        if all(name in found for name in self.joints):
            self.angles = [float(found[name]) for name in self.joints]

    def on_timer(self):
        """A row: off where it has stopped."""
        now, before = self.now(), self.program.status
        held = self.held_at is not None and 0.0 <= now - self.held_at <= DEAD_MAN
        angles, self.angles = self.angles, None
        inputs = self.program.step(now, held, angles, self.supply)
        self.output.publish(Float64MultiArray(data=inputs))
        if self.program.status == RUNNING:
            cells = [repr(value) for value in inputs]
            cells += [repr(value) for value in angles] if angles is not None else [""] * WHEELS
            self.log.write(",".join([f"{now - self.program.begun:.6f}", *cells]) + "\\n")
            self.log.flush()
        elif self.program.status != before or before == WAITING and now % 5.0 < DT:
            self.get_logger().info(WORDS[self.program.status])


def main():
    """Until Ctrl-C; then the motors get nothing."""
    rclpy.init()
    node = OmnidynDrive()
    try:
        rclpy.spin(node)
    finally:
        node.output.publish(Float64MultiArray(data=[0.0] * WHEELS))
        node.log.close()
        node.destroy_node()


if __name__ == "__main__":
    main()
'''
