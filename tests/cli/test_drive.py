"""omnidyn drive: a simulated robot, a stop, the rest, files, and what it does not take."""

import importlib
import json

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.guard import DriveGuard
from omnidyn.errors import InputError, Terminated

ROWS = [[0.0, 0.0, 0.0]] * 20 + [[0.0, 3.0, -3.0]] * 40 + [[0.0] * 3] * 20 + [[0.0, -3.0, 3.0]] * 40 + [[0.0] * 3] * 20


@pytest.fixture
def commands(here):
    """There and back, as a command file without a plan."""
    omnidyn.write_run(omnidyn.Run(t=0.02 * np.arange(len(ROWS)), voltage=ROWS), "rows.csv")
    return "rows.csv"


def test_a_simulated_robot_is_driven_and_recorded(call, here, commands):
    code, out, err = call("drive", commands, "--robot", "axebot", "-o", "log.csv")
    assert code == 0
    assert out.startswith("Axebot drove the whole program: 2 legs in 2.8 s.")
    assert "forward 0.56 m" in out
    assert "wrote log.csv" in err
    log = omnidyn.read_log(here / "log.csv", robot=omnidyn.load_robot("axebot"))
    np.testing.assert_allclose(np.asarray(log.voltage)[:139], ROWS[:139], atol=1e-12)
    assert log.wheel_speed is not None


def test_a_dry_run_sends_and_writes_nothing(call, here, commands):
    code, out, _ = call(
        "drive", commands, "--robot", "axebot", "--to", "serial:/dev/none", "--dry-run", "-o", "log.csv"
    )
    assert (code, (here / "log.csv").exists()) == (0, False)
    assert out.startswith("2 legs in 2.8 s for axebot: up to 0.56 m along x and 0.00 m along y, in 3 m x 3 m.")
    code, out, _ = call("drive", commands, "--robot", "axebot", "--dry-run", "--json")
    legs = json.loads(out)["legs"]
    assert [leg["words"] for leg in legs] == ["forward 0.56 m", "back 0.56 m"]


def test_the_border_of_a_small_room_stops_it(call, here, commands):
    code, out, _ = call("drive", commands, "--robot", "axebot", "--area", "0.4x0.4", "-o", "log.csv")
    assert code == 4
    assert "the border is at 0.20 m" in " ".join(out.split())
    assert "put it back into the middle" in " ".join(out.split())


def test_what_is_left_is_driven(call, here):
    omnidyn.write_run(omnidyn.Run(t=0.02 * np.arange(3 * len(ROWS)), voltage=ROWS * 3), "rows.csv")
    robot = omnidyn.load_robot("axebot")
    stopped = omnidyn.Run(t=0.02 * np.arange(200), voltage=(ROWS * 3)[:200], twist=np.zeros((200, 3)))  # in leg 3
    omnidyn.write_run(stopped, "log.csv")
    omnidyn.save_robot(robot, "mine.toml")
    code, out, _ = call("drive", "rows.csv", "--robot", "mine.toml", "--resume", "log.csv", "-o", "rest.csv")
    assert code == 0
    assert out.startswith("Axebot drove the whole program: 4 legs in 5.7 s.")
    code, _, err = call("drive", "rows.csv", "--robot", "mine.toml", "--resume", "log.csv", "--resume", "rest.csv")
    assert code == 4
    assert "nothing is left to drive" in err


@pytest.mark.parametrize("kind", ["csv", "page", "arduino", "ros2", "ftc", "wpilib"])
def test_files_are_written(call, here, commands, kind):
    out = {"csv": "again.csv", "page": "page.html"}.get(kind, kind)
    code, told, _ = call("drive", commands, "--robot", "axebot", "--to", kind, "-o", out)
    assert code == 0
    assert (here / out).exists()
    assert f"axebot as {kind}" in told
    code, _, _ = call("drive", commands, "--robot", "axebot", "--to", kind, "-o", out)
    assert code == 3  # it is there


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["rows.csv"], "no robot to drive it; got no rows.json beside it"),
        (["rows.csv", "--robot", "axebot", "--to", "udp:10.0.0.1:99"], "nowhere to record the drive"),
        (["rows.csv", "--robot", "axebot", "--to", "moon", "-o", "l.csv"], "not a robot to send to"),
        (["rows.csv", "--robot", "axebot", "--area", "3"], "not the size of a room"),
        (["rows.csv", "--robot", "lekiwi"], "not what the drive takes"),
        (["rows.csv", "--robot", "axebot", "--hold", "--to", "udp:127.0.0.1:9", "-o", "l.csv"], "no key can be held"),
        (["none.csv", "--robot", "axebot"], "none.csv"),
        (["rows.csv", "--robot", "axebot", "--plant", "lekiwi"], "not a robot for this plan; got 3 wheels, speed"),
        (["rows.csv", "--robot", "axebot", "--dead-man", "nan"], "--dead-man: out of range"),
        (["rows.csv", "--robot", "axebot", "--supply", "nan"], "supply: not a voltage"),
        (["rows.csv", "--robot", "axebot", "--area", "0x3"], "--area: wrong room"),
    ],
)
def test_what_it_does_not_take(call, here, commands, arguments, words):
    code, _, err = call("drive", *arguments)
    assert code == 3
    assert words in err


@pytest.mark.parametrize(("error", "code"), [(IndexError("of ours"), 1), (Terminated(), 143)])
def test_an_error_on_the_way_is_told_when_the_log_is_written(call, here, commands, monkeypatch, error, code):
    fault = DriveGuard.fault

    def fail(guard, now):
        if now > 1.3:
            raise error
        return fault(guard, now)

    monkeypatch.setattr(DriveGuard, "fault", fail)
    assert call("drive", commands, "--robot", "axebot", "-o", "log.csv")[0] == code
    assert len(omnidyn.read_log(here / "log.csv", robot=omnidyn.load_robot("axebot"))) == pytest.approx(50, abs=4)


@pytest.mark.parametrize("json_", [False, True])
def test_a_drive_without_a_row_names_no_log(call, here, commands, monkeypatch, json_):
    monkeypatch.setattr(importlib.import_module("omnidyn.driving.drive"), "ANSWERS_WITHIN", 0.1)
    options = ["--robot", "axebot", "--to", "udp:127.0.0.1:9", "-o", "log.csv", *(["--json"] if json_ else [])]
    code, out, err = call("drive", commands, *options)
    assert (code, (here / "log.csv").exists()) == (4, False)
    assert "does not answer" in err
    assert "-o LOG" not in err
    if json_:
        assert json.loads(out)["output"] is None


def test_a_key_that_nobody_holds_is_waited_for_no_longer_than_a_minute(monkeypatch):
    from contextlib import nullcontext

    from omnidyn.cli import drive

    monkeypatch.setattr(drive, "held_key", lambda: nullcontext(lambda: False))
    monkeypatch.setattr(drive, "KEY_WITHIN", 0.0)
    with pytest.raises(InputError, match="no key is held"), drive._held(True):
        pass
