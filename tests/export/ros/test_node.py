"""ros2-node: the loop drives our simulated robot, and the node does so over a bus that is none: stubs of rclpy."""

import importlib.util
import re
import shutil
import sys
from decimal import Decimal
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError
from omnidyn.export.ros.node import ros2_node
from omnidyn.model.drive import Drive
from omnidyn.model.wheels import twist_from_wheel_speed, wheel_speed
from tests.export.ros.test_ros2_control import checked_package, installed, started
from tests.support.exported import exact_robot

ROBOT = omnidyn.load_robot("axebot")
DT = 0.01


def loaded(path, name):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def drive(tmp_path):
    """The module drive_loop of a robot."""

    def made(robot):
        folder = tmp_path / robot.name.replace(" ", "_")
        ros2_node(robot).write(folder)
        return loaded(folder / "drive_loop.py", "drive_loop")

    return made


class Plant:
    """Our simulation as the robot on the other end."""

    def __init__(self, robot, dt=DT):
        self.robot, self.dt, self.twist, self.pose = robot, dt, np.zeros(3), np.zeros(3)

    def step(self, duty, supply):
        run = omnidyn.simulate(self.robot, [np.array(duty) * supply], self.dt, twist=self.twist, pose=self.pose)
        self.twist, self.pose = run.twist[-1], run.pose[-1]

    @property
    def speeds(self):
        return wheel_speed(self.robot.wheels, self.twist).tolist()


def driven(module, robot, goal, seconds, told=True):
    """Where the loop brings the robot that is asked for a twist all the time."""
    loop, plant = module.DriveLoop(), Plant(robot)
    for k in range(round(seconds / DT)):
        now = k * DT
        loop.command(now, goal)
        if told:
            loop.measured(now, plant.speeds)
        plant.step(loop.step(now), module.SUPPLY)
    return plant


@pytest.mark.parametrize("robot", [ROBOT, exact_robot(1), exact_robot(4)], ids=lambda robot: robot.name)
@pytest.mark.parametrize(
    "goal", [(0.4, 0.0, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 2.0), (0.3, 0.2, 1.0), (0.05, 0.0, 0.0)]
)
@pytest.mark.parametrize("told", [True, False])
@pytest.mark.some(8)
def test_it_reaches_the_twist_that_is_asked_for(drive, robot, goal, told):
    told = told or robot.friction.axes.breakaway is not None  # from rest it must know that it rests
    plant = driven(drive(robot), robot, goal, 1.5, told)
    np.testing.assert_allclose(plant.twist, goal, atol=1e-3)


def test_without_a_command_it_stops(drive):
    module = drive(ROBOT)
    loop, plant = module.DriveLoop(), Plant(ROBOT)
    assert loop.step(0.0) == [0.0, 0.0, 0.0]
    for k in range(300):
        now = k * DT
        if now < 1.0:
            loop.command(now, (0.5, 0.0, 0.0))
        duty = loop.step(now)
        assert any(duty) or now > 1.28  # the last command came at 0.99 s
        assert not any(duty) or now < 1.3
        plant.step(duty, module.SUPPLY)
    assert not plant.twist.any()
    loop.command(10.0, (0.5, 0.0, 0.0))
    assert loop.step(9.0) == [0.0, 0.0, 0.0]  # a clock that went back


@pytest.mark.parametrize("bad", [(np.nan, 0.0, 0.0), (np.inf, 0.0, 0.0), (1.0,), ("1", 0.0, 0.0), ()])
def test_what_is_no_command_is_none(drive, bad):
    loop = drive(ROBOT).DriveLoop()
    loop.command(0.0, bad)
    assert loop.asked_at is None
    loop.measured(0.0, bad)
    assert loop.twist is None


NO_NUMBERS = [
    (np.nan, 0.0, 0.0),
    (1e308, -1e308, 1e308),
    (10**400, 0, 0),
    (None, 0.0, 0.0),
    ("x", 1.0, 2.0, 3.0),
    None,
    1.0,
    "abc",
    ([], [], []),
]
NO_SUPPLY = [np.nan, np.inf, 0.0, -6.0, 1e-300, None, "6", b"6", 10**400, [], object()]
NO_TIME = [np.nan, np.inf, None, "0.01", b"1", [], 10**400, 1j, object()]


@pytest.mark.parametrize("supply", NO_SUPPLY, ids=lambda value: str(value)[:9])
def test_a_supply_that_is_none_stops_the_motors_with_a_status(drive, supply):
    module = drive(ROBOT)
    loop = module.DriveLoop()
    for k, given in enumerate((6.0, supply, supply, 6.0)):
        loop.command(k * DT, (0.1, 0.0, 0.0))
        duty = loop.step(k * DT, supply=given)
        assert any(duty) == (given == 6.0)
        assert loop.status == (module.OK if given == 6.0 else module.BAD_SUPPLY)
    assert loop.step(9.0, supply=supply) == [0.0] * 3
    assert loop.status == module.STOPPED


@pytest.mark.parametrize("dt", [np.nan, np.inf, 0.0, -0.01, None, "0.01", b"1", []])
def test_a_time_step_that_is_none_stops_the_motors_with_a_status(drive, dt):
    module = drive(ROBOT)
    loop = module.DriveLoop()
    loop.command(0.0, (0.1, 0.0, 0.0))
    assert loop.step(0.0, dt=dt) == [0.0] * 3
    assert loop.status == module.BAD_TIME
    assert loop.step(np.nan) == [0.0] * 3
    assert loop.status == module.STOPPED
    assert any(loop.step(0.01))
    assert loop.status == module.OK


@pytest.mark.parametrize("now", NO_TIME, ids=lambda value: str(value)[:9])
def test_a_time_that_is_none_stops_the_motors(drive, now):
    module = drive(ROBOT)
    loop = module.DriveLoop()
    loop.command(now, (0.1, 0.0, 0.0))
    loop.measured(now, [0.0] * 3)
    assert loop.step(0.0) == [0.0] * 3
    loop.command(0.0, (0.1, 0.0, 0.0))
    assert loop.step(now) == [0.0] * 3
    assert loop.status == module.STOPPED
    assert any(loop.step(0.01))


@pytest.mark.parametrize("bad", NO_NUMBERS, ids=lambda value: str(value)[:9])
def test_no_measurement_and_no_command_raises(drive, bad):
    loop = drive(ROBOT).DriveLoop()
    loop.command(0.0, bad)
    loop.measured(0.0, bad)
    assert loop.step(0.0) == [0.0] * 3
    loop.command(0.0, (0.3, 0.0, 0.0))
    first = loop.step(0.0)
    loop.measured(0.01, bad)
    assert loop.twist is None
    assert np.isfinite(first).all()


def test_what_numpy_calls_a_number_is_one(drive):
    module = drive(ROBOT)
    loop = module.DriveLoop()
    loop.command(0.0, np.array([0.3, 0.0, 0.0], np.float32))
    for supply in (np.float32(7.2), Decimal("7.2")):
        assert any(loop.step(0.0, supply=supply))
        assert loop.status == module.OK


def test_duties_stay_in_their_range_and_keep_the_direction(drive):
    module = drive(ROBOT)
    loop = module.DriveLoop()
    for k in range(400):
        loop.command(k * DT, (50.0, 0.0, 0.0))
        duty = loop.step(k * DT, supply=7.2)
        assert max(map(abs, duty)) <= 6.0 / 7.2 + 1e-12
        assert duty[0] == pytest.approx(0.0, abs=1e-12)
        assert duty[1] == pytest.approx(-duty[2])


@pytest.fixture
def bus(monkeypatch):
    """Stubs of what the node imports: the topics that it has, and what it published."""
    found = SimpleNamespace(heard={}, said=[], timers=[], clock=0.0, parameters={}, stopped=False)

    class Node:
        def __init__(self, name):
            found.name = name

        def declare_parameter(self, name, default):
            return SimpleNamespace(value=found.parameters.get(name, default))

        def create_publisher(self, kind, topic, depth):
            return SimpleNamespace(publish=lambda message: found.said.append((topic, list(message.data))))

        def create_subscription(self, kind, topic, call, depth):
            found.heard[topic] = (kind, call)

        def create_timer(self, period, call):
            found.timers.append((period, call))

        def get_clock(self):
            return SimpleNamespace(now=lambda: SimpleNamespace(nanoseconds=round(found.clock * 1e9)))

        def destroy_node(self):
            found.stopped = True

    class Message:
        data: list

    def interrupted(node):
        raise KeyboardInterrupt

    stubs = {
        "rclpy": {"init": lambda: None, "spin": interrupted, "try_shutdown": lambda: None},
        "rclpy.node": {"Node": Node},
        "geometry_msgs.msg": {"Twist": type("Twist", (), {}), "TwistStamped": type("TwistStamped", (), {})},
        "sensor_msgs.msg": {"JointState": type("JointState", (), {})},
        "std_msgs.msg": {"Float64MultiArray": Message},
        "geometry_msgs": {},
        "sensor_msgs": {},
        "std_msgs": {},
    }
    for name, content in stubs.items():
        module = ModuleType(name)
        module.__dict__.update(content)
        monkeypatch.setitem(sys.modules, name, module)
    return found


@pytest.mark.parametrize("stamped", [True, False])
def test_the_node_on_a_bus(bus, tmp_path, monkeypatch, stamped):
    ros2_node(ROBOT).write(tmp_path / "n")
    monkeypatch.setitem(sys.modules, "drive_loop", loaded(tmp_path / "n" / "drive_loop.py", "drive_loop"))
    module = loaded(tmp_path / "n" / "omnidyn_node.py", "omnidyn_node")
    bus.parameters = {"stamped": stamped, "supply_V": 7.2}
    node = module.OmnidynNode()
    ((period, tick),) = bus.timers
    assert period == DT
    kind, command = bus.heard["cmd_vel"]
    assert kind.__name__ == ("TwistStamped" if stamped else "Twist")
    twist = SimpleNamespace(linear=SimpleNamespace(x=0.3, y=0.1), angular=SimpleNamespace(z=-1.0))
    plant = Plant(ROBOT)
    for k in range(150):
        bus.clock = k * DT
        command(SimpleNamespace(twist=twist) if stamped else twist)
        w = plant.speeds
        states = bus.heard["joint_states"][1]
        states(
            SimpleNamespace(
                name=["arm", "wheel3_joint", "wheel1_joint", "wheel2_joint"], velocity=[9, w[2], w[0], w[1]]
            )
        )
        states(SimpleNamespace(name=["wheel1_joint"], velocity=[99.0]))  # not all of them: left out
        states(SimpleNamespace(name=["wheel1_joint", "wheel2_joint", "wheel3_joint"], velocity=[]))
        tick()
        plant.step(bus.said[-1][1], 7.2)
    np.testing.assert_allclose(plant.twist, [0.3, 0.1, -1.0], atol=1e-3)
    node.stop()
    assert bus.said[-1] == ("duty", [0.0, 0.0, 0.0])
    module.main()
    assert bus.stopped
    assert bus.said[-1][1] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("name", ['"""', "\\", "速度\u202e", "a\nimport os"])
def test_whatever_the_robot_is_called(name):
    for file, text in ros2_node(ROBOT.replace(name=name)).files.items():
        if file.endswith(".py"):
            compile(text, file, "exec")


@pytest.fixture
def looped():
    """A robot whose firmware holds speeds of the wheels."""
    drive = Drive.model_validate({"kind": "speed", "rate_Hz": 100.0, "kp_V_s_rad": 0.3, "ki_V_rad": 6.0})
    return omnidyn.load_robot("mecanum").replace(name="looped", drive=drive)


def test_a_speed_loop_gets_set_points_of_the_wheels(drive, looped):
    """A simulation with friction follows them: to 1 % once the loop has settled; without a command it rests."""
    module, goal = drive(looped), np.array([0.3, -0.2, 0.8])
    loop, rows = module.DriveLoop(), []
    for k in range(300):
        if k < 160:
            loop.command(k * DT, goal.tolist())
        rows.append(loop.step(k * DT))
    np.testing.assert_allclose(rows[150], wheel_speed(looped.wheels, goal), rtol=1e-12)
    run = omnidyn.simulate(looped, wheel_speed_command=rows, dt=DT)
    np.testing.assert_allclose(run.twist[155], goal, rtol=1e-2)
    assert np.abs(run.twist[-1]).max() < 1e-6
    loop.command(3.0, [50.0, 0.0, 0.0])
    for k in range(3000):
        loop.command(3.0 + k * DT, [50.0, 0.0, 0.0])
        row = np.array(loop.step(3.0 + k * DT))
    assert loop.status == module.LIMITED
    assert np.abs(row).max() == pytest.approx(0.8 * 6.0 / (0.0059 * 19.0), rel=1e-9)  # 0.8 of the speed without load
    np.testing.assert_allclose(twist_from_wheel_speed(looped.wheels, row)[1:], 0.0, atol=1e-12)


@pytest.mark.parametrize("controller", ["", "pid"])
def test_the_package_installs_what_it_starts(tmp_path, controller):
    made = ros2_node(ROBOT, controller, joints=["fl", "fr", "back"])
    name, needs = checked_package(made, tmp_path / "bot")
    (node,) = started(made.files["omnidyn_node.launch.py"], tmp_path / "bot")
    assert node["package"] == name
    assert made.files["omnidyn_node.py"].startswith("#!/usr/bin/env python3\n")
    text = "".join(made.files[file] for file in made.files if file.endswith(".py") and "launch" not in file)
    imported = {
        line.split()[1].split(".")[0] for line in text.splitlines() if re.match(r"(from|import) [a-z_.]+", line)
    }
    standard = set(sys.stdlib_module_names) | {"drive_loop", "path_loop"}
    assert imported - standard <= needs
    assert "`fl`, `fr`, `back`" in made.files["README.md"]
    if shutil.which("cmake"):
        loop = "path_loop.py" if controller else "drive_loop.py"
        library = {"lib/N/libomnidyn_control.so"} if controller else set()
        files = {f"lib/N/{loop}", "lib/N/omnidyn_node.py", "share/N/omnidyn_node.launch.py"} | library
        found = installed(tmp_path / "bot", tmp_path / "build")
        assert {file.replace(f"/{name}/", "/N/") for file in found} == files


@pytest.mark.parametrize("options", [{"dt": 0.0}, {"timeout": -1.0}, {"dt": float("nan")}])
def test_what_makes_no_loop_is_refused(options):
    with pytest.raises(InputError, match="out of range"):
        ros2_node(ROBOT, **options)
