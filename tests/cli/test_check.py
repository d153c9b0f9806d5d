"""omnidyn check: what it prints, writes and returns."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.logs.run_file import write_run
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.outputs import strict


@pytest.fixture(scope="module")
def run():
    """A run of the AxeBot under pushes in many directions, with a little noise."""
    rng = np.random.default_rng(0)
    robot = load_robot("axebot")
    push = (robot.wheels.wrench_matrix.T @ (rng.normal(size=(24, 3)) / [1.0, 1.0, 0.1]).T).T
    volts = np.repeat(4.0 * push / np.abs(push).max(axis=1, keepdims=True), 50, axis=0)
    clean = simulate(robot, volts, 0.01)

    def noisy(values):
        return values + 0.005 * np.abs(values).max() * rng.normal(size=values.shape)

    return clean.replace(current=noisy(clean.current), wheel_speed=noisy(clean.wheel_speed), twist=noisy(clean.twist))


@pytest.fixture
def logs(tmp_path, monkeypatch, run):
    """A folder with a clean log, one with two motors exchanged, and one with a gap."""
    monkeypatch.chdir(tmp_path)
    write_run(run, "clean.csv")
    write_run(run.replace(wheel_speed=run.wheel_speed[:, [1, 0, 2]]), "swapped.csv")
    keep = np.r_[0:400, 430:1201]
    channels = {name: values[keep] for name, values in run.channels.items()}
    write_run(Run(t=run.t[keep], **channels), "gap.csv")
    return tmp_path


@pytest.fixture
def call(logs, capsys):
    def run_it(*arguments):
        code = main(["check", *arguments])
        return code, *capsys.readouterr()

    return run_it


def test_a_clean_log_is_fit_for_use(call):
    code, out, err = call("clean.csv", "--robot", "axebot")
    assert code == 0
    assert "1201 rows, 12 s at 100 Hz: " in out
    assert "error" not in out
    assert "wheel_speed: w1 <- w1_rad_s" in err  # the columns are always shown


def test_an_error_is_exit_code_4_and_shown(call):
    code, out, _ = call("swapped.csv", "--robot", "axebot")
    assert code == 4
    assert "error    swapped w1 w2" in out
    assert "-> put the columns right" in out


def test_without_a_robot_what_needs_none_is_checked(call):
    code, out, _ = call("gap.csv")
    assert code == 0
    assert "1 gap, about 30 rows lost" in " ".join(out.split())
    assert "line 401-402" in " ".join(out.split())


def test_a_log_that_cannot_be_read_does_not_stop_the_others(call):
    code, out, err = call("missing.csv", "gap.csv", "clean.csv")
    assert code == 3
    assert "gap.csv" in out
    assert "1 is not readable" in out
    assert "missing.csv: no such file" in err


def test_a_column_name_of_a_megabyte_is_refused_in_a_sentence(call, logs):
    """It took minutes, and nothing was said."""
    (logs / "long.csv").write_text(f"t,{'w' * 2**20}\n0,1\n1,2\n")
    code, _, talk = call("check", "long.csv")
    assert code == 3
    assert "long.csv:1: the name of column 2 is too long; got 1048576 characters, wwww" in talk
    assert len(talk) < 1000


def test_a_folder_is_a_table_of_its_logs_and_what_is_wrong(call, run):
    write_run(run, "again.csv")
    code, out, _ = call(".", "--robot", "axebot")
    assert code == 4
    assert re.search(r"clean.csv +1201 +12 s +- +1 +", out)  # the same data as again.csv
    assert "error    swapped w1 w2 (swapped.csv): " in out
    assert len(out.splitlines()) <= 25


def test_two_names_for_one_recording(call):
    Path("copy.csv").write_bytes(Path("clean.csv").read_bytes())
    code, out, _ = call("clean.csv", "copy.csv")
    assert code == 0
    assert "it holds the same numbers as clean.csv" in " ".join(out.split())


def test_json_of_all_logs(call):
    code, out, _ = call(".", "missing.csv", "--robot", "axebot", "--json")
    document = strict(out)
    assert code == 3
    assert [Path(log["source"]).name for log in document["logs"]] == ["clean.csv", "gap.csv", "swapped.csv"]
    assert document["has_errors"] is True
    assert "no such file" in document["unread"][0]["error"]
    (swapped,) = [f for f in document["logs"][2]["findings"] if f["code"] == "swapped"]
    assert swapped["subject"] == "w1 w2"
    assert {each["role"] for each in document["provenance"]["inputs"]} == {"robot", "log"}
    assert all(len(each["sha256"]) == 64 for each in document["provenance"]["inputs"])


@pytest.mark.parametrize("ending, magic", [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_a_picture_of_the_log(call, ending, magic):
    code, _, err = call("gap.csv", "--picture", f"log.{ending}")
    assert code == 0
    assert Path(f"log.{ending}").read_bytes().startswith(magic)
    assert f"wrote log.{ending}" in err
    code, _, err = call("gap.csv", "--picture", f"log.{ending}")
    assert code == 3
    assert "exists already" in err


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["clean.csv", "--picture", "log.pdf"], "cannot tell the kind of picture"),
        (["clean.csv", "gap.csv", "--picture", "log.png"], "a picture shows one log"),
        ([".", "--picture", "log.png"], "a picture shows one log"),
        (["clean.csv", "--robot", "nobody"], "nobody"),
    ],
)
def test_what_is_refused_before_any_work(call, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (3, "")
    assert words in err


def test_a_robot_with_fewer_wheels_is_refused_for_that_log(call):
    code, _, err = call("clean.csv", "--robot", "four-wheel")
    assert code == 0 or "wheels" in err


def test_ascii_in_the_c_locale_and_narrow(call, monkeypatch):
    monkeypatch.setenv("COLUMNS", "50")
    code, out, _ = call("gap.csv", "--robot", "axebot")
    assert code == 0
    assert out.isascii()


def test_blocks_of_a_long_log_are_one_verdict(call, monkeypatch):
    whole = call("gap.csv", "--robot", "axebot", "--json")[1]
    monkeypatch.setattr("omnidyn.cli.check.BLOCK", 500)
    parts = call("gap.csv", "--robot", "axebot", "--json")[1]
    (one,), (other,) = ([f for f in strict(out)["logs"][0]["findings"] if f["code"] == "gap"] for out in (whole, parts))
    assert one["rows"] == other["rows"]
    assert strict(parts)["logs"][0]["rows"] == strict(whole)["logs"][0]["rows"]


def test_what_was_decided_in_reading_is_said(call):
    lines = Path("clean.csv").read_text().splitlines()
    Path("german.csv").write_text("\n".join(line.replace(",", ";").replace(".", ",") for line in lines), "utf-16")
    code, _, err = call("german.csv", "--robot", "axebot")
    assert code == 0
    assert "german.csv: the encoding is UTF-16" in err
    assert "german.csv: numbers have a decimal comma" in err
    (log,) = json.loads(call("german.csv", "--json")[1])["logs"]
    assert "columns are separated by a semicolon" in [note["text"] for note in log["notes"]]


def test_a_log_of_which_nothing_is_known_is_not_fit_for_use(call):
    Path("odd.csv").write_text("t_s,foo,bar\n" + "".join(f"{0.01 * k:.2f},{k},1\n" for k in range(100)))
    code, out, _ = call("odd.csv")
    assert code == 4
    assert "no column but the time is known: nothing was checked of foo, bar" in out


def test_a_map_never_replaces_a_log(call):
    before = Path("clean.csv").read_bytes()
    code, _, err = call(".", "--save-map", "clean.csv", "--force")
    assert code == 3
    assert "the result would replace its own input" in err
    assert Path("clean.csv").read_bytes() == before


def test_a_log_that_nothing_can_be_done_with_is_exit_code_4(call, run):
    write_run(Run(t=run.t, wheel_speed=run.wheel_speed), "speeds.csv")
    code, out, _ = call("speeds.csv", "--robot", "axebot")
    assert code == 4
    assert out.startswith("Not usable: holds no voltage and no duty.\n")
    assert "no findings" in out


def test_what_reading_left_open_is_part_of_the_result(call):
    rows = "\n".join(f"{0.02 * k:.2f},{100 + k % 50},{k},on" for k in range(100))
    Path("pwm.csv").write_text(f"time_s,PWM1,PWM2,mode\n{rows}\n")
    code, out, err = call("pwm.csv")
    assert code == 4
    assert "not_taken: PWM1, PWM2 look like d1, d2" in " ".join(out.split())
    assert "up to 149 may be a PWM value, of 0..255: not taken -> say --assume d=duty/255" in " ".join(out.split())
    assert "columns not used: mode" in out
    assert "doubt" not in err
    assert "time: t <- time_s [s]" in err
    code, out, _ = call("pwm.csv", "--json")
    (log,) = json.loads(out)["logs"]
    assert [each["code"] for each in log["findings"]] == ["no_channel", "not_taken", "not_used"]
    assert log["verdict"] == json.loads(out)["verdict"]
    assert log["useless"]


def test_several_logs_begin_with_a_sentence_about_all(call):
    code, out, _ = call("clean.csv", "swapped.csv", "missing.csv", "--robot", "axebot")
    assert code == 3
    assert out.startswith(
        "Of 3 logs 2 are usable for whole logs, motors and geometry; 1 has errors; 1 is not readable."
    )
