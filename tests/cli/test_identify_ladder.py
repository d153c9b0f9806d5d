"""omnidyn identify --ladder: the robot file that it writes, what machines get, an interrupt, refusals."""

import json

import pytest

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.write import write_logs
from omnidyn.cli import main
from omnidyn.identification.structure.ladder import climb
from omnidyn.model.robot_file import load_robot


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """A log of a robot in a turning frame, and the file of its owner, who left that out."""
    folder = tmp_path_factory.mktemp("logs")
    write_logs(by_name("turning frame"), 1, folder)
    return folder


@pytest.fixture
def call(logs, tmp_path, monkeypatch, capsys):
    """Climb in the folder of the logs: (exit code, stdout, stderr)."""
    monkeypatch.chdir(logs)

    def run(*arguments):
        code = main(["identify", "log1.csv", "--robot", "robot.toml", "--ladder", *arguments])
        return code, *capsys.readouterr()

    return run


def test_the_best_robot_is_written_and_all_that_was_fitted_told(call, tmp_path):
    out, page = tmp_path / "better.toml", tmp_path / "page.html"
    code, told, _ = call("-o", str(out), "--report", str(page), "--json")
    assert code == 0
    found = json.loads(told)
    taken = [rung["key"] for rung in found["ladder"]["rungs"] if rung["taken"]]
    assert taken == ["", "body.rotating_frame"]
    assert found["ladder"]["end"]["code"] == "only_noise"
    assert load_robot(str(out)).body.rotating_frame
    assert not found["lack_of_fit"]["found"]
    assert "What was switched on, step by step" in page.read_text("utf-8")


def test_an_interrupt_of_the_ladder_leaves_the_robot_as_it_was_given(call, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(climb, "judged", interrupted)
    out = tmp_path / "fit.toml"
    code, _, err = call("-o", str(out))
    assert code == 130
    assert "interrupted" in err
    assert not load_robot(str(out)).body.rotating_frame


def test_steady_states_have_no_ladder(call):
    code, _, err = call("--method", "steady-state")
    assert code == 3
    assert "--ladder" in err
