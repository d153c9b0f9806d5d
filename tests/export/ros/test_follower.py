"""ros2-node with a controller: its loop follows a path as `track` does, by the C, and stops when it must."""

import shutil
import subprocess
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

import omnidyn
from omnidyn.control.controllers import controller_named
from omnidyn.control.paths.path import path as path_of
from omnidyn.export.ros.node import ros2_node
from omnidyn.model.drive import Drive
from tests.export.ros.test_node import NO_NUMBERS, NO_SUPPLY, NO_TIME, ROBOT, Plant, loaded
from tests.export.ros.test_node import bus as bus
from tests.support.exported import STRICT

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
DT = 0.02
TIMES = np.arange(0.0, 6.0 + DT / 2.0, DT)
CIRCLE = np.column_stack([TIMES, 0.4 * np.sin(TIMES), 0.4 * (1.0 - np.cos(TIMES)), TIMES])


def built(folder, robot=ROBOT, controller="mpc"):
    """The module path_loop of a robot, the C behind it compiled with every warning an error."""
    ros2_node(robot, controller).write(folder)
    command = ["gcc", *STRICT, "-shared", "-fPIC", "-o", "libomnidyn_control.so"]
    sources = ["omnidyn_control.c", "control_shared.c", "-lm"]
    subprocess.run([*command, *sources], cwd=folder, check=True, capture_output=True)
    return loaded(folder / "path_loop.py", "path_loop")


def wrapped(pose):
    """As odometry tells it: the heading within half a turn."""
    return [pose[0], pose[1], (pose[2] + np.pi) % (2.0 * np.pi) - np.pi]


@pytest.mark.parametrize("controller", ["pid", "mpc", "feedforward"])
def test_it_follows_a_path_as_track_does(tmp_path, controller):
    module = built(tmp_path / "node", controller=controller)
    loop, plant, errors = module.PathLoop(), Plant(ROBOT, DT), []
    for k in range(len(TIMES) - 1):
        loop.measured(k * DT, wrapped(plant.pose), plant.twist.tolist())
        if k == 0:
            loop.follow(0.0, [(t, x, y, wrapped((x, y, heading))[2]) for t, x, y, heading in CIRCLE.tolist()])
        plant.step(loop.step(k * DT), module.SUPPLY)
        errors.append(np.hypot(*(plant.pose[:2] - CIRCLE[k + 1, 1:3])))
    path = tmp_path / "circle.csv"
    np.savetxt(path, CIRCLE, delimiter=",", header="t_s,x_m,y_m,heading_rad", comments="", fmt="%.17g")
    expected = omnidyn.track(ROBOT, str(path), controller, dt=DT).rmse_position
    rmse = np.sqrt(np.mean(np.square(errors[round(0.5 / DT) :])))
    assert rmse == pytest.approx(expected, abs=1e-4, rel=0.05)


@pytest.mark.parametrize("controller", ["pid", "mpc"])
def test_it_reaches_a_twist_and_stops_when_nobody_asks(tmp_path, controller):
    module = built(tmp_path / "node", controller=controller)
    loop, plant, goal = module.PathLoop(), Plant(ROBOT, DT), [0.3, 0.1, -1.0]
    loop.command(0.0, goal)
    assert loop.step(0.0) == [0.0] * 3  # nobody knows where it is
    for k in range(150):
        loop.measured(k * DT, wrapped(plant.pose), plant.twist.tolist())
        if k < 100:
            loop.command(k * DT, goal)
        plant.step(loop.step(k * DT), module.SUPPLY)
        if k == 99:
            np.testing.assert_allclose(plant.twist, goal, atol=1e-3)
    assert not plant.twist.any()
    assert loop.status == -1


def test_it_stops_without_a_pose_at_an_empty_path_and_at_what_is_none(tmp_path):
    module = built(tmp_path / "node")
    loop, rows = module.PathLoop(), CIRCLE.tolist()
    here = ([0.0] * 3, [0.0] * 3)
    loop.measured(0.0, *here)
    loop.follow(0.0, rows)
    assert any(loop.step(0.0))
    assert loop.step(0.31) == [0.0] * 3  # no pose for so long
    loop.measured(0.4, *here)
    assert loop.step(0.4) == [0.0] * 3  # and it does not go on by itself
    for bad in ([], rows[::-1], [(0.0, 1.0, 2.0)], [(0.0, np.nan, 0.0, 0.0)], [(0.0, "1", 0.0, 0.0)]):
        loop.follow(0.5, rows)
        loop.measured(0.5, *here)
        assert any(loop.step(0.5))
        loop.follow(0.5, bad)
        assert loop.step(0.52) == [0.0] * 3
    loop.measured(0.6, [np.nan] * 3, [0.0] * 3)
    assert loop.told_at == 0.5


def test_what_is_no_number_stops_the_motors_and_raises_nothing(tmp_path):
    module = built(tmp_path / "node", controller="pid")
    for supply in NO_SUPPLY:
        loop = module.PathLoop()
        for k, given in enumerate((6.0, supply, 6.0)):
            loop.measured(k * DT, [0.0] * 3, [0.0] * 3)
            loop.command(k * DT, (0.3, 0.1, -1.0))
            duty = loop.step(k * DT, supply=given)
            assert any(duty) == (given == 6.0)
            assert (loop.status == module.BAD_SUPPLY) == (given != 6.0)
    for bad in NO_NUMBERS:
        loop = module.PathLoop()
        loop.measured(0.0, [0.0] * 3, [0.0] * 3)
        loop.measured(0.0, bad, [0.0] * 3)
        loop.measured(0.0, [0.0] * 3, bad)
        loop.command(0.0, bad)
        assert (loop.pose, loop.course) == ([0.0] * 3, None)
        loop.follow(0.0, [bad, bad])
        assert loop.step(0.0) == [0.0] * 3
        assert loop.status == module.STOPPED
    loop = module.PathLoop()
    for now in NO_TIME:
        for told, asked, stepped in ((now, 0.0, 0.0), (0.0, 0.0, now)):
            loop.measured(told, [0.0] * 3, [0.0] * 3)
            loop.command(asked, (0.3, 0.1, -1.0))
            assert loop.step(stepped) == [0.0] * 3
            assert loop.status == module.STOPPED
        loop.command(now, (0.3, 0.1, -1.0))
        loop.follow(now, [(0.0, 0.0, 0.0, 0.0)])
        assert np.isfinite(loop.step(0.0)).all()
    for rows in (None, 1.0, np.array(5.0)):
        loop.follow(0.0, rows)
        assert loop.course is None
    for now in (0.0, 1.7e9):  # of a clock that counts from 1970 two rows so near are at one time
        loop = module.PathLoop()
        loop.measured(now, [0.0] * 3, [0.0] * 3)
        loop.follow(now, [(0.0, 0.0, 0.0, 0.0), (1e-300, 1e8, 0.0, 0.0), (1.0, 1e8, 0.0, 1e8)])
        assert np.isfinite(loop.step(now)).all()


def test_the_node_on_a_bus(bus, tmp_path, monkeypatch):
    module = built(tmp_path / "n")
    monkeypatch.setitem(sys.modules, "path_loop", module)
    messages = ModuleType("nav_msgs.msg")
    messages.__dict__.update({"Path": type("Path", (), {}), "Odometry": type("Odometry", (), {})})
    monkeypatch.setitem(sys.modules, "nav_msgs", ModuleType("nav_msgs"))
    monkeypatch.setitem(sys.modules, "nav_msgs.msg", messages)
    node = loaded(tmp_path / "n" / "omnidyn_node.py", "omnidyn_node").OmnidynNode()
    ((period, tick),) = bus.timers
    assert period == DT

    def posed(x, y, heading, seconds=0.0):
        turned = SimpleNamespace(x=0.0, y=0.0, z=np.sin(heading / 2.0), w=np.cos(heading / 2.0))
        pose = SimpleNamespace(position=SimpleNamespace(x=x, y=y), orientation=turned)
        stamp = SimpleNamespace(sec=int(seconds), nanosec=round(seconds % 1.0 * 1e9))
        return SimpleNamespace(pose=pose, header=SimpleNamespace(stamp=stamp))

    for stamped in (True, False):
        plant, start = Plant(ROBOT, DT), bus.clock + 1.0
        for k in range(400):
            bus.clock = start + k * DT
            vx, vy, omega = plant.twist
            linear, angular = SimpleNamespace(x=vx, y=vy), SimpleNamespace(z=omega)
            twist = SimpleNamespace(twist=SimpleNamespace(linear=linear, angular=angular))
            bus.heard["odom"][1](SimpleNamespace(pose=posed(*plant.pose), twist=twist))
            if k == 0:
                rows = CIRCLE[:151:5]
                times = rows[:, 0] + 7.0 if stamped else np.zeros(len(rows))
                bus.heard["path"][1](
                    SimpleNamespace(
                        poses=[posed(*row, seconds) for row, seconds in zip(rows[:, 1:], times, strict=True)]
                    )
                )
            tick()
            plant.step(bus.said[-1][1], module.SUPPLY)
        np.testing.assert_allclose(plant.pose, CIRCLE[150, 1:], atol=4e-3)  # it stops 0.3 s after the end
        assert not plant.twist.any()
    node.stop()
    assert bus.said[-1] == ("duty", [0.0, 0.0, 0.0])


@pytest.mark.parametrize("name", ['"""', "\\", "速度\u202e", "a\nimport os"])
def test_whatever_the_robot_is_called(name):
    for file, text in ros2_node(ROBOT.replace(name=name), "pid").files.items():
        if file.endswith(".py"):
            compile(text, file, "exec")


def test_a_drive_that_takes_speeds_of_wheels_gets_them(tmp_path):
    """The set points that the controller of Python gives, on the way along the circle; they lead with its rate."""
    drive = Drive.model_validate({"kind": "speed", "rate_Hz": 100.0, "kp_V_s_rad": 0.3, "ki_V_rad": 6.0})
    robot = ROBOT.replace(name="looped", drive=drive)
    module = built(tmp_path / "node", robot, "pid")
    loop, law = module.PathLoop(), controller_named("pid", robot, dt=DT)
    course, times = path_of("circle:radius_m=0.4,speed_m_s=0.4,heading=along"), np.arange(2000) * 1e-3
    loop.measured(0.0, [0.0] * 3, [0.0] * 3)
    loop.follow(0.0, [[t, *course.at(t).pose] for t in times])
    for k in range(60):
        place, twist = np.add(course.at(k * DT).pose, 0.01), [0.3, 0.0, 1.0]
        loop.measured(k * DT, place, twist)
        expected = law.step(k * DT, place, twist, course)
        np.testing.assert_allclose(loop.step(k * DT), expected, atol=0.05)
    assert np.abs(expected).max() > 5.0
