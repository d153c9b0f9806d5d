"""What a page shows as "the same by hand" runs as it stands: each command line, and each Python call."""

import shlex
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra studio is not installed")

import omnidyn
from omnidyn.cli import main
from omnidyn.studio import calls
from omnidyn.studio.calls import LogFile
from omnidyn.studio.compare.state import Comparing
from omnidyn.studio.session import Session
from omnidyn.studio.track.state import Tracks
from tests.support.pages import write_log

NAMES = ("monday.csv", "tuesday.csv")


@pytest.fixture
def session(tmp_path, monkeypatch):
    """A session with two logs of one drive, the axebot and two fits."""
    monkeypatch.chdir(tmp_path)
    for name in NAMES:
        write_log(name, 8.0, robot=omnidyn.load_robot("axebot"))
    made = Session()
    made.robot = "axebot"
    made.logs = {name: LogFile(name, name, name) for name in NAMES}
    for name in ("fit-1.toml", "fit-2.toml"):
        assert main(["identify", NAMES[0], "--robot", "axebot", "--quick", "-o", name]) == 0
        made.robots[name] = name
    yield made
    made._folder.cleanup()


def by_hand(command, python):
    """Run both, line by line; returns what Python gives. voltages: those of a user."""
    for line in command.splitlines():
        assert main(shlex.split(line)[1:]) == 0
    voltages = np.zeros((10, 3))
    return [eval(line, {"omnidyn": omnidyn, "voltages": voltages}) for line in python.splitlines()]


def test_what_stands_under_the_same_by_hand_runs(session):
    first, second = session.logs.values()
    (verdict,) = by_hand(*calls.check(first, "axebot"))
    assert verdict.rows > 700
    (offset,) = by_hand(*calls.align(first, second, "axebot"))
    assert abs(offset) < 0.01
    comparing = Comparing(session)
    comparing.choose(1, "fit-1.toml")
    (comparison,) = by_hand(*comparing.calls())
    assert len(comparison.robots) == 2
    assert len(comparison.measured) == 2
    (fit,) = by_hand(*calls.fit([first, second], [second], "axebot", ("friction.axes.coulomb",)))
    assert "friction.axes.coulomb[0]" in fit.estimate.value
    tracks = Tracks(session)
    tracks.options[tracks.path]["rounds"] = "0.25"
    (trackings,) = by_hand(*tracks.calls())
    assert [tracking.controller for tracking in trackings] == ["pid", "mpc"]
    comparing.choose_fits(["fit-1.toml", "fit-2.toml"])
    (drift,) = by_hand(*comparing.drift_calls())
    assert drift.numbers
    assert drift.changed == ()
    Path("voltages.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n1,0,0,0\n", "utf-8")
    zone, run = by_hand(*calls.drive("axebot"))
    assert zone
    assert len(run) == 11
