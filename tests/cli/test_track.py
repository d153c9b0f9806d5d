"""omnidyn track: what it prints, writes and refuses, and its exit codes."""

import json

import numpy as np
import pytest

import omnidyn
from omnidyn.cli import main
from omnidyn.logs.run_file import read_run
from omnidyn.model.robot_file import robot_to_toml


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run the command in a folder of its own: (exit code, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments):
        code = main(["track", *arguments])
        return code, *capsys.readouterr()

    return run


SHORT = ("--path", "eight:period_s=4", "--duration", "2")


def test_controllers_side_by_side(call):
    code, out, _ = call("axebot", *SHORT, "--controller", "pid", "--controller", "pid_no_friction")
    assert code == 0
    assert out.startswith("The controller pid keeps axebot within ")
    assert "pid_no_friction" in out
    rows = {
        line.split()[0]: line.split() for line in out.splitlines() if line.startswith("pid") and "keeps" not in line
    }
    assert float(rows["pid"][1]) < float(rows["pid_no_friction"][1])


def test_the_values_for_machines(call):
    code, out, _ = call("axebot", *SHORT, "--controller", "pid", "--controller", "speed", "--no-friction", "--json")
    told = json.loads(out)
    assert code == 0
    assert [each["name"] for each in told["controllers"]] == ["pid_no_friction", "speed_no_friction"]
    for each in told["controllers"]:
        assert set(each) >= {
            "name",
            "rmse_position_m",
            "rmse_heading_rad",
            "worst_position_m",
            "saturated_share",
            "step_us",
        }
        assert set(each["step_us"]) == {"median", "p99"}
    assert told["provenance"]["inputs"][0]["role"] == "robot"


def test_the_numbers_are_those_of_the_library(call):
    spec = "encoder:2048,pose:60Hz,40ms,jitter:2ms,dropouts:5%"
    _, out, _ = call(
        "axebot", *SHORT, "--noise", "0.01", "--seed", "3", "--delay", "1", "--skip", "0.2", "--sensors", spec, "--json"
    )
    options = {"noise": 0.01, "rng": 3, "delay": 1, "skip": 0.2, "sensors": spec}
    mine = omnidyn.track(omnidyn.load_robot("axebot"), "eight:period_s=4", "pid", duration=2.0, **options)
    assert json.loads(out)["sensors"] == "encoder:2048,pose:60Hz,40ms,dropouts:5%,jitter:2ms"
    assert json.loads(out)["controllers"][0]["rmse_position_m"] == mine.rmse_position


def test_what_it_writes(call, tmp_path):
    files = ("-o", "run.csv", "--report", "page.html", "--gif", "way.gif")
    assert call("axebot", *SHORT, "--plant", "axebot", *files)[0] == 0
    run = read_run("run.csv")
    assert len(run) == 101
    np.testing.assert_array_equal(run.pose[0], [0.0, 0.0, 0.0])
    page = (tmp_path / "page.html").read_text("utf-8")
    assert "The controller pid keeps axebot" in page
    assert page.count("data:image/svg+xml;base64,") == 2
    assert page.count("data:image/gif;base64,R0lGOD") == 1
    assert "http" not in page.split("</head>")[1].replace("http-equiv", "")
    assert (tmp_path / "way.gif").read_bytes().startswith(b"GIF89a")
    code, _, err = call("axebot", *SHORT, "-o", "run.csv")
    assert (code, "the file exists already" in err) == (3, True)
    assert call("axebot", *SHORT, "-o", "run.csv", "--force")[0] == 0


def test_a_controller_file_and_a_path_of_rows(call, tmp_path):
    (tmp_path / "own.toml").write_text('schema = 1\ncontroller = "pid"\n[options]\nfaster = 1.0\n')
    (tmp_path / "way.csv").write_text("t_s,x_m,y_m,heading_rad\n0,0,0,0\n1,0.2,0,0\n2,0.2,0.2,0.5\n")
    code, out, _ = call("axebot", "--path", "way.csv", "--controller", "own.toml", "--json")
    assert code == 0
    assert {each["role"] for each in json.loads(out)["provenance"]["inputs"]} == {"robot", "path", "controller"}


@pytest.mark.parametrize(
    "arguments, code, words",
    [
        (("axebot", "--path", "eigt"), 3, "did you mean eight"),
        (("axebot", "--path", "missing.csv"), 3, "missing.csv"),
        (("axebot", "--path", "eight", "--controller", "pdi"), 3, "did you mean pid"),
        (("axebot", "--path", "eight", "--controller", "missing.toml"), 3, "missing.toml"),
        (("axebo", "--path", "eight"), 3, "axebo"),
        (("axebot",), 2, "--path"),
        (("axebot", "--path", "eight", "--dt", "0"), 3, "--dt"),
        (("axebot", "--path", "eight", "--delay", "-1"), 3, "--delay"),
        (("axebot", "--path", "eight", "--noise", "nan"), 3, "--noise"),
        (("axebot", "--path", "eight", "--duration", "1e9"), 3, "--duration"),
        (("axebot", "--path", "eight", "--no-observer"), 3, "--no-observer"),
        (("axebot", "--path", "eight", "--controller", "speed", "--horizon", "20"), 3, "--horizon"),
        (("axebot", "--path", "eight", "--plant", "robotino"), 3, "made for another drive"),
        (("axebot", "--path", "eight", "--report", "page.pdf"), 3, "ends in .html"),
        (("axebot", "--path", "eight", "-o", "run.xlsx"), 3, "spreadsheets"),
    ],
)
def test_what_it_refuses(call, arguments, code, words):
    found, out, err = call(*arguments)
    assert (found, out) == (code, "")
    assert words in err


def test_the_robot_in_truth_can_be_varied(call, tmp_path):
    text = (
        robot_to_toml(omnidyn.load_robot("axebot"))
        + "\n[variations.payload.2kg]\nmass_kg = 2\noffset_m = [0.05, 0.0]\n"
    )
    (tmp_path / "own.toml").write_text(text, "utf-8")
    code, out, _ = call("own.toml", *SHORT, "--with", "payload=2kg")
    assert code == 0
    assert out.startswith("The controller pid keeps axebot with payload 2kg within ")
    code, _, err = call("own.toml", *SHORT, "--with", "payload=3kg")
    assert code == 3
    assert "no payload of this name; got 3kg; did you mean 2kg?" in err
    code, _, err = call("own.toml", *SHORT, "--with", "2kg")
    assert code == 3
    assert "--with: not a variation; got 2kg" in err
