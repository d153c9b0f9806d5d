"""The commands, in process: what they print, write and refuse."""

import json
import re
import sys

import numpy as np
import pytest

from omnidyn.logs.run_file import read_run
from omnidyn.model.robot_file import load_robot, preset_names, robot_to_toml
from omnidyn.simulation.simulate import simulate
from tests.support.outputs import strict

VOLTAGES = "t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n1,0,0,0\n2,1,1,1\n"
TABLE_1 = (
    "axis,speed,force\nx,0,2.25\nx,0.37,2.48\nx,0.74,2.79\nx,1.08,3.28\ny,0,1.47\ny,0.42,1.97\ny,0.75,2.33\n"
    "y,1.08,2.49\nyaw,0,0.1\nyaw,5.84,0.14\nyaw,8.04,0.18\nyaw,10.02,0.21\n"
)


@pytest.fixture
def here(here):
    """An own folder with a voltage file and a steady table."""
    (here / "u.csv").write_text(VOLTAGES)
    (here / "t.csv").write_text(TABLE_1)
    return here


# ---- usage ----------------------------------------------------------------------------------------------


def test_no_command_shows_the_help_and_is_a_usage_error(call):
    code, out, err = call()
    assert (code, out) == (2, "")
    assert "Usage: omnidyn" in err


@pytest.mark.parametrize("arguments", [["--help"], ["-h"], ["simulate", "--help"], ["demo", "-h"]])
def test_help_is_a_result(call, arguments):
    code, out, err = call(*arguments)
    assert (code, err) == (0, "")
    assert out.startswith("Usage: omnidyn")


def test_version(call):
    assert call("--version") == (0, "omnidyn 0.1.0\n", "")


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["fly"], "No such command 'fly'"),
        (["simulate"], "Missing argument"),
        (["simulate", "axebot", "u.csv", "--max-steps", "0"], "--max-steps"),
        (["simulate", "axebot", "u.csv", "--duration", "long"], "--duration"),
        (["simulate", "axebot", "u.csv", "-o", "-", "--json"], "both want stdout"),
        (["identify", "t.csv"], "--robot"),
        (["deadzone", "axebot", "--loud"], "--loud"),
    ],
)
def test_wrong_words_are_usage(call, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.startswith("omnidyn: error: ")
    assert err.count("\n") == 1


# ---- robots, deadzone -----------------------------------------------------------------------------------


def test_robots_lists_every_preset(call):
    code, out, _ = call("robots")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()] == preset_names()
    listed = strict(call("robots", "--json")[1])
    assert [robot["name"] for robot in listed["robots"]] == preset_names()
    assert listed["robots"][0]["wheels"] == 3


def test_deadzone_has_the_paper_s_numbers(call):
    code, out, _ = call("deadzone", "axebot")
    assert code == 0
    lines = [line.split() for line in out.splitlines()[4:7]]
    assert [(line[0], line[1]) for line in lines] == [("x", "0.670"), ("y", "0.528"), ("yaw", "0.174")]
    assert [line[-1] for line in lines] == ["0.112", "0.088", "0.029"]  # duty of 6 V
    assert "no interval: no number of the robot file has a std; identify writes them" in out


def test_deadzone_has_intervals_and_names_the_guesses_behind_them(call):
    _, out, _ = call("deadzone", "robotino")
    assert "it rests on guesses: friction.direction.yaw_coulomb (60 % by its std)" in out
    assert "the duty rests on guesses: motor.voltage_limit_V (8" in out
    told = strict(call("deadzone", "robotino", "--json")[1])
    x, _, yaw = told["dead_zone"]
    # The ellipse is known to 0.2 of 42.5 N, the turn to 1.5 of 2.5 N m: a guess.
    assert (x["interval_V"][1] - x["interval_V"][0]) / x["breakaway_scale_V"] < 0.03
    assert (yaw["interval_V"][1] - yaw["interval_V"][0]) / yaw["breakaway_scale_V"] > 1.5
    assert told["guesses"] == ["friction.direction.yaw_coulomb", "motor.voltage_limit_V"]
    around = told["directions"]
    assert len(around["direction_deg"]) == len(around["low_V"]) == len(around["high_V"]) == 72
    assert "it rests on guesses" in call("deadzone", "robotino", "--json")[2]


def test_friction_says_what_holds_and_draws_it(call, tmp_path):
    picture = tmp_path / "friction.png"
    code, out, _ = call("friction", "axebot", "--picture", str(picture))
    assert code == 0
    assert "2.2, 2.2, 2.2, 2.2" in out
    assert picture.stat().st_size > 5000
    told = strict(call("friction", "axebot", "--json")[1])
    assert [row["holds"] for row in told["axes"]] == [[2.2, 2.2], [1.5, 1.5], [0.099, 0.099]]
    assert told["axes"][0]["law"] == "Coulomb (axes)"


def test_deadzone_for_machines(call):
    result = strict(call("deadzone", "axebot", "--json")[1])
    assert [row["axis"] for row in result["dead_zone"]] == ["x", "y", "yaw"]
    assert result["dead_zone"][0]["breakaway_scale_V"] == pytest.approx(0.6702104418344872, rel=1e-14)
    assert result["provenance"]["command"] == "omnidyn deadzone axebot --json"
    assert len(result["provenance"]["inputs"][0]["sha256"]) == 64


def test_what_rests_on_a_guess_says_so(call, here):
    """A file of `init` is nothing but guesses beside what a ruler tells; the paper's robot has none."""
    from omnidyn.model.first_guess import first_guess
    from omnidyn.model.robot_file import save_robot

    line = "rests on guesses of the robot file: "
    save_robot(first_guess("new", load_robot("axebot").wheels, 1.5, 6.0), "new.toml")
    out = call("deadzone", "new.toml")[1]
    for key in (
        "motor.resistance_ohm",
        "motor.torque_constant_Nm_A",
        "motor.gear_ratio",
        "friction.direction.coulomb[0]",
    ):
        assert re.search(rf"it rests on guesses: [^:]*{re.escape(key)}", out.replace("\n  ", " "))
    assert f"{line}inertia, resistance" in call("simulate", "new.toml", "u.csv")[1]
    assert strict(call("simulate", "new.toml", "u.csv", "--json")[1])["rests_on_guesses"][0] == "inertia"
    call("simulate", "axebot", "u.csv", "-o", "run.csv")
    compared = call("compare", "run.csv", "--robot", "new.toml")[1]
    assert f"{line}inertia, resistance" in compared
    assert "rests on guesses" not in call("deadzone", "axebot")[1] + call("simulate", "axebot", "u.csv")[1]


def test_deadzone_of_a_pattern_names_the_axis_that_gives_way(call):
    row = strict(call("deadzone", "axebot", "--pattern", "-1,2,-3", "--json")[1])["dead_zone"][0]
    assert row["axis"] == "yaw"
    assert row["voltage_V"] == pytest.approx([-0.26119, 0.52238, -0.78357], abs=1e-5)


def test_a_pattern_that_drives_nothing_never_moves(call):
    code, out, _ = call("deadzone", "axebot", "--pattern", "0,0,0")
    assert code == 0
    assert "never   no voltage times (0, 0, 0) moves it" in out
    assert strict(call("deadzone", "axebot", "--pattern", "0,0,0", "--json")[1])["dead_zone"][0]["voltage_V"] is None


def test_a_dead_zone_beyond_the_motors_is_said(call, here):
    weak = load_robot("axebot")
    weak = weak.replace(motor=weak.motor.replace(voltage_limit=0.5))
    from omnidyn import save_robot

    save_robot(weak, here / "weak.toml")
    lines = call("deadzone", "weak.toml")[1].splitlines()[4:7]
    assert [line.endswith("(beyond the limit of the motors)") for line in lines] == [True, True, False]


@pytest.mark.parametrize("pattern", ["1,2", "a,b,c", "1,,1", "nan,0,0", "inf,1,1", "1_0,1,1", "1e400,0,0", "1" * 2000])
def test_a_bad_pattern_is_refused(call, pattern):
    code, out, err = call("deadzone", "axebot", "--pattern", pattern)
    assert (code, out) == (3, "")
    assert "pattern" in err


@pytest.mark.parametrize(
    "robot",
    ["axbot", "none.toml", "", ".", "u.csv", "a\0b", "\N{ROBOT FACE}", "-", "x" * 4000, "none/x.toml", "axebot/"],
)
def test_a_bad_robot_is_refused_in_one_line(call, robot):
    code, out, err = call("deadzone", "--", robot)
    assert (code, out) == (3, "")
    assert err.startswith("omnidyn: error: ")
    assert err.count("\n") == 1


# ---- simulate -------------------------------------------------------------------------------------------


def test_simulate_carries_a_load_beside_the_middle(call, here):
    load = "\n[variations.payload.2kg]\nmass_kg = 2\ninertia_kg_m2 = 0.01\noffset_m = [0.05, 0.0]\n"
    (here / "own.toml").write_text(robot_to_toml(load_robot("axebot")) + load, "utf-8")
    code, out, _ = call("simulate", "own.toml", "u.csv", "--with", "payload=2kg", "-o", "run.csv")
    assert code == 0
    assert "axebot with payload 2kg, implicit engine" in out
    body = load_robot("axebot").body
    body = body.replace(mass=3.5, centre=(0.1 / 3.5, 0.0), inertia=0.035 + 1.5 * 2.0 / 3.5 * 0.05**2)
    expected = simulate(load_robot("axebot").replace(body=body), [[0, 3, -3], [0, 0, 0], [1, 1, 1]], 1.0)
    np.testing.assert_allclose(read_run("run.csv").twist, expected.twist, rtol=0, atol=1e-6)


def test_simulate_refuses_a_tolerance_that_is_none(call, here):
    code, out, err = call("simulate", "axebot", "u.csv", "--tol", "-1")
    assert (code, out) == (3, "")
    assert "--tol: tolerance out of range; got -1.0; expected 1e-10 to 1 m/s" in err
    assert "leave --tol out" in err


def test_simulate_writes_the_run_that_python_gives(call, here):
    from omnidyn import read_commands, simulate

    code, out, err = call("simulate", "axebot", "u.csv", "-o", "run.csv")
    assert code == 0
    assert "4 samples, 3 s" in out
    assert "wrote run.csv" in err
    held = read_commands(here / "u.csv", 3)
    wanted = simulate(load_robot("axebot"), held.voltage, held.dt)
    assert read_run(here / "run.csv").pose.tobytes() == wanted.pose.tobytes()


def test_simulate_with_a_band_writes_its_ends_beside_the_run(call, here):
    from omnidyn import confidence_band, read_commands, save_robot
    from omnidyn.model.robot import Prior

    known = load_robot("axebot").replace(priors={"friction.axes.coulomb[0]": Prior(std=0.1, origin="guess")})
    save_robot(known, here / "known.toml")
    code, out, err = call("simulate", "known.toml", "u.csv", "-o", "run.csv", "--band")
    assert code == 0
    assert "[..]: 95 %, 100 robots drawn from the std and correlations of 1 numbers of the file" in out
    assert "rests on guesses of the robot file: friction" in out
    assert "wrote run.csv, run-low.csv, run-high.csv" in err
    held = read_commands(here / "u.csv", 3)
    wanted = confidence_band(known, held.voltage, held.dt)
    for name, end in (("low", wanted.low), ("high", wanted.high)):
        assert read_run(here / f"run-{name}.csv").twist.tobytes() == end.twist.tobytes()
    code, _, err = call("simulate", "known.toml", "u.csv", "-o", "other.csv", "--band", "--json", "--force")
    assert (here / "other-low.csv").exists()
    (here / "run.csv").unlink()
    code, _, err = call("simulate", "known.toml", "u.csv", "-o", "run.csv", "--band")
    assert code == 3
    assert "run-low.csv" in err
    assert not (here / "run.csv").exists()


def test_the_band_for_machines_and_its_refusals(call, here):
    from omnidyn import save_robot
    from omnidyn.model.robot import Prior

    known = load_robot("axebot").replace(priors={"motor.resistance_ohm": Prior(std=0.1)})
    save_robot(known, here / "known.toml")
    told = strict(call("simulate", "known.toml", "u.csv", "--band", "--json")[1])
    low, high = told["band"]["low"]["final_pose"]["x_m"], told["band"]["high"]["final_pose"]["x_m"]
    assert low < told["final_pose"]["x_m"] < high
    assert (told["band"]["draws"], told["band"]["output"], told["band"]["guesses"]) == (100, None, [])
    assert call("simulate", "axebot", "u.csv", "-o", "-", "--band")[0] == 2
    code, _, err = call("simulate", "axebot", "u.csv", "--band")
    assert code == 4
    assert "nothing says how far the numbers of this robot may be off; got axebot without any std" in err


def test_without_an_output_nothing_is_written(call, here):
    before = sorted(here.iterdir())
    code, out, err = call("simulate", "axebot", "u.csv")
    assert code == 0
    assert "at the end" in out
    assert "nothing written" in err
    assert sorted(here.iterdir()) == before


def test_a_dash_writes_the_run_to_stdout(call, here):
    _, out, _ = call("simulate", "axebot", "u.csv", "-o", "-")
    call("simulate", "axebot", "u.csv", "-o", "run.csv")
    assert out == (here / "run.csv").read_text()


def test_the_summary_for_machines(call):
    result = strict(call("simulate", "axebot", "u.csv", "--json", "--pose", "1,-2,0.5")[1])
    assert result["moved"] is True
    assert result["samples"] == 4
    assert result["final_pose"]["x_m"] > 1.0
    assert {each["role"] for each in result["provenance"]["inputs"]} == {"robot", "voltages"}


def test_the_run_keeps_the_time_of_the_voltages(call, here):
    (here / "late.csv").write_text("t_s,u1_V,u2_V,u3_V\n10,0,3,-3\n11,0,0,0\n")
    call("simulate", "axebot", "late.csv", "-o", "run.csv")
    assert read_run(here / "run.csv").t.tolist() == [10.0, 11.0, 12.0]


def test_the_duration_ends_the_run(call, here):
    call("simulate", "axebot", "u.csv", "-o", "run.csv", "--duration", "1.5")
    assert read_run(here / "run.csv").t.tolist() == [0.0, 1.0, 1.5]


def test_a_run_is_written_as_parquet_by_its_name(call, here):
    pytest.importorskip("pyarrow")
    call("simulate", "axebot", "u.csv", "-o", "run.csv")
    assert call("simulate", "axebot", "u.csv", "-o", "run.parquet")[0] == 0
    csv, parquet = read_run(here / "run.csv"), read_run(here / "run.parquet")
    assert all(np.array_equal(parquet.channels[name], csv.channels[name], equal_nan=True) for name in csv.channels)


def test_parquet_without_pyarrow_ends_with_6_before_any_work(call, here, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    code, out, err = call("simulate", "axebot", "u.csv", "-o", "run.parquet")
    assert (code, out) == (6, "")
    assert 'pip install "omnidyn[logs]"' in err
    assert not (here / "run.parquet").exists()


def test_a_robot_that_never_moves_is_said(call, here):
    (here / "low.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,0.6,-0.6\n1,0,0,0\n")
    assert "It never moved" in call("simulate", "axebot", "low.csv")[1]


def test_clipped_voltages_are_a_warning_on_stderr_and_in_the_result(call, here):
    (here / "high.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,30,-30\n1,0,0,0\n")
    _, out, err = call("simulate", "axebot", "high.csv", "--json")
    assert "omnidyn: warning: voltage above the limit was clipped" in err
    assert [warning["code"] for warning in strict(out)["warnings"]] == ["clipped"]


@pytest.mark.parametrize(
    "text, words",
    [
        ("t_s,u1_V,u2_V,u3_V\n0,nan,3,-3\n1,0,0,0\n", "bad.csv:2, column u1_V"),
        ("t_s,u1_V,u2_V,u3_V\n0,,3,-3\n1,0,0,0\n", "bad.csv:2, column u1_V"),
        ("t_s,u1_V,u2_V,u3_V\n0,1e400,3,-3\n1,0,0,0\n", "not a finite number"),
        ("t_s;u1_V;u2_V;u3_V\n0;1,5;3\n", "bad.csv"),
        ("", "the file is empty"),
        ("t_s,u1_V\n0,1\n1,1\n", "another number of wheels"),
        ("t_s,u1_V,u2_V,u3_V\n0,1,1,1\n", "--duration"),
    ],
)
def test_a_bad_voltage_file_is_refused_with_its_place(call, here, text, words):
    (here / "bad.csv").write_text(text)
    code, out, err = call("simulate", "axebot", "bad.csv", "-o", "run.csv")
    assert (code, out) == (3, "")
    assert words in err
    assert not (here / "run.csv").exists()


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--pose", "0,0"], "--pose: wrong number of values"),
        (["--pose", "0,0,nan"], "--pose: not a list of numbers"),
        (["--twist", "1;2;3"], "--twist: not a list of numbers"),
        (["--duration", "nan"], "duration"),
        (["--duration", "-1"], "duration"),
        (["--max-steps", "2"], "too many rows"),
        (["-o", "none/run.csv"], "mkdir -p none"),
        (["-o", "u.csv"], "the result would replace its own input"),
        (["-o", "t.csv"], "the file exists already"),
        (["-o", "."], "a folder"),
        (["-o", "run.csv", "--force", "--pose", "x"], "--pose"),
    ],
)
def test_bad_values_are_refused(call, here, arguments, words):
    code, out, err = call("simulate", "axebot", "u.csv", *arguments)
    assert (code, out) == (3, "")
    assert words in err
    assert (here / "u.csv").read_text() == VOLTAGES
    assert sorted(file.name for file in here.iterdir()) == ["t.csv", "u.csv"]


def test_an_existing_output_is_refused_before_any_work(call, here, monkeypatch):
    (here / "run.csv").write_text("mine")
    monkeypatch.setattr("omnidyn.simulation.simulate.simulate", None)  # would be a bug, exit 1
    assert call("simulate", "axebot", "u.csv", "-o", "run.csv")[0] == 3
    assert (here / "run.csv").read_text() == "mine"


# ---- identify -------------------------------------------------------------------------------------------


def test_identify_gives_table_2_in_the_paper_s_way(call):
    result = strict(call("identify", "t.csv", "--robot", "axebot", "--rest", "line", "--json")[1])
    values = {name: entry["value"] for name, entry in result["parameters"].items()}
    assert values["friction.axes.viscous[0]"] == pytest.approx(0.9382, abs=5e-5)
    assert values["friction.axes.coulomb[2]"] == pytest.approx(0.09337, abs=5e-6)


def test_identify_writes_a_robot_that_loads(call, here):
    code, out, err = call("identify", "t.csv", "--robot", "axebot", "-o", "fit.toml")
    assert code == 0
    assert "95 % interval" in out
    assert "wrote fit.toml" in err
    assert load_robot(here / "fit.toml").friction.axes.coulomb[0] == pytest.approx(2.0306, abs=5e-5)


def test_identify_says_its_warnings_in_words(call):
    _, out, err = call("identify", "t.csv", "--robot", "axebot", "--json")
    warnings = strict(out)["warnings"]
    assert warnings
    assert all(f"omnidyn: {warning['severity']}: {warning['text']}" in err for warning in warnings)


@pytest.mark.parametrize(
    "method, words",
    [
        ("output-error", "--method: a table of steady points has no time in it"),
        ("magic", "--method: no such method; got magic; expected output-error or steady-state"),
    ],
)
def test_another_method_is_refused_by_name(call, method, words):
    code, _, err = call("identify", "t.csv", "--robot", "axebot", "--method", method)
    assert code == 3
    assert words in err


def test_too_few_points_are_exit_4(call, here):
    (here / "few.csv").write_text("axis,speed,force\nx,0.4,2.5\nx,0.7,2.8\n")
    assert call("identify", "few.csv", "--robot", "axebot", "-o", "fit.toml")[0] == 4
    assert not (here / "fit.toml").exists()


# ---- errors ---------------------------------------------------------------------------------------------


def test_debug_adds_the_traceback_and_keeps_the_code(call):
    code, _, err = call("deadzone", "axbot", "--debug")
    assert code == 3
    assert "Traceback (most recent call last)" in err
    assert "no such robot" in err


def test_our_own_bug_is_exit_1_without_a_traceback(call, monkeypatch):
    def broken(robot):
        raise ZeroDivisionError("oh\nno")

    monkeypatch.setattr("omnidyn.load_robot", broken)
    code, out, err = call("deadzone", "axebot")
    assert (code, out) == (1, "")
    assert "omnidyn: bug: ZeroDivisionError: oh no" in err
    assert "Traceback" not in err


def test_a_missing_extra_is_exit_6(call, monkeypatch):
    from omnidyn.errors import MissingExtraError

    def missing(robot):
        raise MissingExtraError("mcap is not installed", remedy="pip install omnidyn[logs]")

    monkeypatch.setattr("omnidyn.load_robot", missing)
    code, _, err = call("deadzone", "axebot")
    assert code == 6
    assert "pip install omnidyn[logs]" in err


def test_no_memory_is_no_bug(call, monkeypatch):
    def full(robot):
        raise MemoryError

    monkeypatch.setattr("omnidyn.load_robot", full)
    code, _, err = call("deadzone", "axebot")
    assert code == 3
    assert "not enough memory" in err


def test_simulate_takes_a_duty_file(here, call):
    """A duty of 1/4 of 12 V is 3 V: the run of the voltage file."""
    text = robot_to_toml(load_robot("axebot")) + '\n[drive]\nkind = "duty"\nsupply_V = 12.0\n'
    (here / "duty.toml").write_text(text)
    (here / "d.csv").write_text("t_s,d1_duty,d2_duty,d3_duty\n0,0,0.25,-0.25\n1,0,0,0\n")
    (here / "v.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,0,3,-3\n1,0,0,0\n")
    assert call("simulate", "duty.toml", "d.csv", "-o", "a.csv")[0] == 0
    assert call("simulate", "duty.toml", "v.csv", "-o", "b.csv")[0] == 0
    by_duty, by_volts = read_run(here / "a.csv"), read_run(here / "b.csv")
    np.testing.assert_array_equal(by_duty.twist, by_volts.twist)
    assert by_duty.duty[:, 1].tolist() == [0.25, 0.0, 0.0]
    assert by_duty.supply.tolist() == [12.0] * 3


def test_simulate_refuses_a_speed_file_for_a_drive_that_takes_volts(here, call):
    (here / "w.csv").write_text("t_s,w1_cmd_rad_s,w2_cmd_rad_s,w3_cmd_rad_s\n0,1,2,3\n1,0,0,0\n")
    code, _, error = call("simulate", "axebot", "w.csv")
    assert code == 3
    assert "the drive of axebot takes no wheel_speed_command" in error


def test_deadzone_begins_with_a_sentence(call, here):
    from omnidyn import save_robot

    assert call("deadzone", "axebot")[1].splitlines()[0] == (
        "The robot axebot starts to move forward from 0.67 V, sideways from 0.53 V and turning from 0.17 V."
    )
    weak = load_robot("axebot")
    save_robot(weak.replace(motor=weak.motor.replace(voltage_limit=0.5)), here / "weak.toml")
    assert call("deadzone", "weak.toml")[1].splitlines()[0] == (
        "The robot axebot starts to move turning from 0.17 V; forward and sideways its motors cannot move it."
    )
    save_robot(weak.replace(motor=weak.motor.replace(voltage_limit=0.1)), here / "weaker.toml")
    told = json.loads(call("deadzone", "weaker.toml", "--json")[1])
    assert told["verdict"] == (
        "The robot axebot does not move forward, sideways and turning, whatever voltage its motors can have."
    )


def test_simulate_begins_with_a_sentence(call, here):
    (here / "turn.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,3,3,3\n1,0,0,0\n")
    out = call("simulate", "axebot", "turn.csv")[1]
    assert re.match(r"In 2 s the robot came \S+ m from where it began and turned by \S+ degrees; it is at rest", out)
