"""The node for ROS 2 drives a simulated robot over a bus that is none, stops, and writes a log that can be read."""

import importlib.util
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import omnidyn
from omnidyn.export.drives.kinds import program_files
from omnidyn.simulation.live import LiveRobot
from tests.support.faulty_drives import axebot_program

PROGRAM = axebot_program()


def loaded(path, name):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def bus(monkeypatch, tmp_path):
    found = SimpleNamespace(heard={}, said=[], timers=[], clock=100.0, words=[])

    class Node:
        def __init__(self, name):
            found.name = name

        def declare_parameter(self, name, default):
            return SimpleNamespace(value=str(tmp_path / "log.csv") if name == "log" else default)

        def create_publisher(self, kind, topic, depth):
            found.topic = topic
            return SimpleNamespace(publish=lambda message: found.said.append(list(message.data)))

        def create_subscription(self, kind, topic, call, depth):
            found.heard[topic] = call

        def create_timer(self, period, call):
            found.timers.append((period, call))

        def get_clock(self):
            return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(found.clock * 1e9)))

        def get_logger(self):
            return SimpleNamespace(info=found.words.append)

        def destroy_node(self):
            found.ended = True

    def spin(node):
        raise KeyboardInterrupt

    stubs = {
        "rclpy": {"init": lambda: None, "spin": spin},
        "rclpy.node": {"Node": Node},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"JointState": SimpleNamespace, "BatteryState": SimpleNamespace},
        "std_msgs": {},
        "std_msgs.msg": {"Empty": SimpleNamespace, "Float64MultiArray": SimpleNamespace},
    }
    for name, content in stubs.items():
        module = ModuleType(name)
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, module)
    program_files(PROGRAM, "ros2").write(tmp_path / "node")
    monkeypatch.setitem(sys.modules, "drive_program", loaded(tmp_path / "node" / "drive_program.py", "drive_program"))
    found.module = loaded(tmp_path / "node" / "omnidyn_drive.py", "omnidyn_drive")
    return found


def driven(bus, until):
    """The robot under the node; the key is held up to a time."""
    node = bus.module.OmnidynDrive()
    ((dt, tick),) = bus.timers
    robot, angles = LiveRobot(PROGRAM.robot, dt), np.zeros(3)
    for k in range(len(PROGRAM.inputs) + 20):
        bus.clock = 100.0 + k * dt
        if k * dt < until:
            bus.heard["hold"](SimpleNamespace())
        names = ["wheel3_joint", "arm", "wheel1_joint", "wheel2_joint"]
        bus.heard["joint_states"](SimpleNamespace(name=names, position=[angles[2], 9.0, angles[0], angles[1]]))
        tick()
        before = robot.wheel_speed
        robot.step(np.array(bus.said[-1]))
        angles = angles + 0.5 * dt * (before + robot.wheel_speed)
    node.log.close()
    return node


def test_it_drives_all_of_it(bus, tmp_path):
    node = driven(bus, np.inf)
    np.testing.assert_allclose(bus.said[: len(PROGRAM.inputs)], PROGRAM.inputs, atol=1e-9)
    assert node.program.status == bus.module.RUNNING + 1
    assert bus.words[-1] == "is done"
    assert bus.topic == "volts"
    log = omnidyn.read_log(tmp_path / "log.csv", robot=PROGRAM.robot)
    assert log.voltage.shape == log.wheel_angle.shape == (len(PROGRAM.inputs), 3)
    np.testing.assert_allclose(log.voltage, PROGRAM.inputs, atol=1e-9)


def test_a_released_key_stops_it_for_good(bus):
    driven(bus, 1.0)
    assert bus.words[-1] == "stopped: the key was released"
    rows = np.flatnonzero(np.any(bus.said, axis=1))
    assert rows[-1] * PROGRAM.dt <= 1.0 + 0.25


def test_its_end_publishes_zeros(bus):
    with pytest.raises(KeyboardInterrupt):
        bus.module.main()
    assert bus.said[-1] == [0.0] * 3
    assert bus.ended
