"""A robot of LeRobot is driven: a class with the methods of LeRobot's `Robot`, over our simulation."""

import re
from pathlib import Path

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.clock import SimulatedClock
from omnidyn.errors import InputError
from omnidyn.interop.lerobot import LeRobotConnection
from omnidyn.model.wheels import wheel_speed
from omnidyn.simulation.live import LiveRobot

LEKIWI = omnidyn.load_robot("lekiwi")
DT = 0.05


class Base:
    """LeKiwi as LeRobot has it: actions and observations by key, speeds in m/s and deg/s, an arm."""

    def __init__(self, clock, sign=1.0):
        self.clock, self.sign, self.live, self.acting = clock, sign, LiveRobot(LEKIWI, DT), np.zeros(3)
        self.time, self.actions, self.is_connected = clock.now(), [], False

    def connect(self, calibrate=True):
        self.is_connected = True

    def disconnect(self):
        self.is_connected = False

    def get_observation(self):
        assert self.is_connected
        self.go_on()
        forward, left, turn = self.live.twist
        return {"arm_gripper.pos": 12.5, "x.vel": forward, "y.vel": left, "theta.vel": np.degrees(turn), "front": None}

    def send_action(self, action):
        assert self.is_connected
        self.go_on()
        self.actions.append(action)
        twist = self.sign * np.array([action["x.vel"], action["y.vel"], np.radians(action["theta.vel"])])
        self.acting = wheel_speed(LEKIWI.wheels, twist)
        return action

    def go_on(self):
        seconds = self.clock.now() - self.time
        if seconds > 1e-9:
            self.live.step(self.acting, seconds)
        self.time = self.clock.now()


def program():
    rows = [np.zeros((10, 3))]
    for twist in ((0.15, 0.0, 0.0), (0.0, 0.15, 0.0), (0.0, 0.0, 1.0)):
        speeds = wheel_speed(LEKIWI.wheels, np.array(twist))
        for sign in (1.0, -1.0):
            rows += [np.tile(sign * speeds, (25, 1)), np.zeros((10, 3))]
    return omnidyn.DriveProgram(LEKIWI, DT, np.concatenate(rows), (2.0, 2.0))


def test_it_drives_all_of_it_and_the_log_is_read(tmp_path):
    clock = SimulatedClock()
    base = Base(clock)
    record = omnidyn.drive(program(), LeRobotConnection(base, LEKIWI, clock.now), clock=clock)
    assert record.is_complete, str(record.verdict)
    assert {action["arm_gripper.pos"] for action in base.actions} == {12.5}
    assert base.actions[-1]["x.vel"] == base.actions[-1]["theta.vel"] == 0.0
    assert not base.is_connected
    omnidyn.write_run(record.run, tmp_path / "log.csv")
    log = omnidyn.read_log(tmp_path / "log.csv", robot=LEKIWI)
    np.testing.assert_allclose(np.asarray(log.wheel_speed_command)[:200], program().inputs[:200], atol=1e-9)
    assert np.asarray(log.twist)[:, 0].max() == pytest.approx(0.15, rel=0.1)


def test_a_base_that_goes_the_other_way_is_stopped():
    clock = SimulatedClock()
    base = Base(clock, sign=-1.0)
    record = omnidyn.drive(program(), LeRobotConnection(base, LEKIWI, clock.now), clock=clock)
    assert record.stopped is not None
    assert record.stopped.code == "drive_wrong_way"
    assert base.actions[-1]["x.vel"] == 0.0


def test_what_is_no_base_is_refused():
    with pytest.raises(InputError, match="LeRobot takes speeds"):
        LeRobotConnection(None, omnidyn.load_robot("axebot"))

    class Arm(Base):
        def get_observation(self):
            return {"arm_gripper.pos": 1.0}

    clock = SimulatedClock()
    with pytest.raises(InputError, match="no base in what this robot observes"):
        LeRobotConnection(Arm(clock), LEKIWI, clock.now).open()


def test_the_page_as_it_stands(tmp_path, monkeypatch, capsys):
    """The Python of docs/how-to/lekiwi.md drives a simulated LeKiwi, on a simulated clock."""
    monkeypatch.chdir(tmp_path)
    clock = SimulatedClock()
    monkeypatch.setattr("omnidyn.driving.drive.RealClock", lambda: clock)
    monkeypatch.setattr(
        "omnidyn.interop.LeRobotConnection", lambda r, m: LeRobotConnection(r, m, clock.now), raising=False
    )
    page = Path(__file__).resolve().parents[2] / "docs" / "how-to" / "lekiwi.md"
    (code,) = re.findall(r"^```python\n(.*?)^```$", page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    scope = {"robot": Base(clock)}
    exec(code, scope)
    assert scope["record"].is_complete, str(scope["record"].verdict)
    assert len(omnidyn.read_log("lekiwi.csv", robot=LEKIWI)) > 1000
