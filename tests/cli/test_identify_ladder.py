"""omnidyn identify --ladder: the robot file that it writes, what machines get, an interrupt, refusals."""

import json

import pytest

from benchmarks.wrong_worlds.kinds import by_name
from benchmarks.wrong_worlds.log import SPEEDS, logged, right_case, robot_of
from omnidyn.cli import main
from omnidyn.identification.structure.ladder import climb
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import load_robot, save_robot


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """A log of a robot in a turning frame, and the file of its owner, who left that out."""
    folder = tmp_path_factory.mktemp("logs")
    case = right_case(91).setup_but(sensor=SPEEDS, memory=0.0, rate=50.0, seconds=20.0)
    case = by_name("turning frame").make(case, 1.0)
    write_run(logged(case, 91), folder / "log1.csv")
    save_robot(robot_of(case.told), folder / "robot.toml")
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
    code, told, _ = call("--free", "friction", "-o", str(out), "--report", str(page), "--json")
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
    code, _, err = call("--free", "friction", "-o", str(out))
    assert code == 130
    assert "interrupted" in err
    assert not load_robot(str(out)).body.rotating_frame


def test_steady_states_have_no_ladder(call):
    code, _, err = call("--method", "steady-state")
    assert code == 3
    assert "--ladder" in err
