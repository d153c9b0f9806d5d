"""omnidyn identify --method steady-state on logs: what it prints and writes, groups, and what it refuses."""

import json
import re

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.logs.run_file import read_run, write_run
from omnidyn.model.friction import DirectionFriction, Friction
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from tests.support.outputs import strict
from tests.support.steady_logs import clean_runs, robot_with, spoiled

DIRECTIONS = range(0, 360, 30)


@pytest.fixture(scope="session")
def floors(tmp_path_factory):
    """Two folders of logs: a floor with 2.0 N and one with 2.6 N, the same in every direction."""
    folder, rng = tmp_path_factory.mktemp("floors"), np.random.default_rng(0)
    for name, level in (("smooth", 2.0), ("rough", 2.6)):
        friction = Friction(direction=DirectionFriction(coulomb=(level, level), yaw_coulomb=0.099))
        (folder / name).mkdir()
        for k, run in enumerate(clean_runs(robot_with("disc").replace(friction=friction), DIRECTIONS)):
            write_run(spoiled(run, rng), folder / name / f"run{k}.csv")
    return folder


@pytest.fixture
def call(floors, tmp_path, monkeypatch, capsys):
    """Run a command in the folder of the floors, outputs elsewhere: (exit code, stdout, stderr)."""
    monkeypatch.chdir(floors)

    def run(*arguments):
        code = main(["identify", *arguments, "--method", "steady-state"])
        return code, *capsys.readouterr()

    return run


def test_a_folder_of_logs_gives_friction_with_its_shape(call, tmp_path):
    code, out, err = call("smooth", "--robot", "axebot", "-o", str(tmp_path / "fit.toml"))
    assert code == 0
    assert "its shape, disc," in out
    assert "columns of smooth/run0.csv" in err
    assert err.count("columns of") == 1  # said once for all files that agree
    robot = load_robot(tmp_path / "fit.toml")
    assert robot.friction.direction.coulomb == pytest.approx((2.0, 2.0), rel=0.05)
    assert robot.priors["friction.direction.coulomb"].std > 0.0


def test_folders_are_groups_and_each_has_its_file(call, tmp_path):
    code, out, err = call("smooth", "rough", "--robot", "axebot", "-o", str(tmp_path / "fit.toml"))
    assert code == 0
    assert "smooth" in out
    assert re.match(r"Friction along travel is [\d.]+ N \(smooth\) and [\d.]+ N \(rough\)", out)
    assert "wrote" in err
    levels = [load_robot(tmp_path / f"fit-{name}.toml").friction.direction.coulomb[0] for name in ("smooth", "rough")]
    assert levels == pytest.approx([2.0, 2.6], rel=0.05)


def test_groups_by_glob_are_the_same_as_by_folder(call):
    by_folder = json.loads(call("smooth", "rough", "--robot", "axebot", "--json")[1])
    by_glob = json.loads(
        call(".", "--robot", "axebot", "--group", "smooth=smooth/*", "--group", "rough=rough", "--json")[1]
    )
    for name in ("smooth", "rough"):
        one, other = (each["groups"][name]["parameters"] for each in (by_folder, by_glob))
        assert one == other
    assert by_folder["differences"][0]["differs"] is True
    assert len(by_folder["provenance"]["inputs"]) == 25


def test_logs_of_no_group_are_not_used_and_counted(call):
    _, out, err = call(".", "--robot", "axebot", "--group", "smooth=smooth", "--json")
    assert [*json.loads(out)["groups"]] == ["smooth"]
    assert "12 of 24 logs belong to no group and are not used" in err


def test_json_holds_no_nan_and_says_what_was_used(call):
    result = strict(call("smooth", "--robot", "axebot", "--speed", "set", "--json")[1])
    assert result["shape"] == "disc"
    assert result["speed_from"] == "set"
    assert result["groups"]["all"]["along_travel"]["points"] == 12
    assert result["output"] is None


def test_a_report_is_one_page(call, tmp_path):
    code, _, err = call("smooth", "rough", "--robot", "axebot", "--report", str(tmp_path / "r.html"))
    assert code == 0
    assert f"wrote {tmp_path / 'r.html'}" in err
    assert "What to measure next" in (tmp_path / "r.html").read_text("utf-8")


def test_a_shape_can_be_asked_for(call):
    result = json.loads(call("smooth", "--robot", "axebot", "--shape", "box", "--json")[1])
    assert [*result["groups"]["all"]["parameters"]] == ["friction.axes.coulomb[0]", "friction.axes.coulomb[1]"]


def test_the_paper_s_line_on_each_axis(call, tmp_path):
    """A disc seen through the paper's eyes: lines on x and y, which a group each gets, and a robot with axes only."""
    out_file = tmp_path / "line.toml"
    code, out, _ = call("smooth", "rough", "--robot", "axebot", "--shape", "line", "--full", "-o", str(out_file))
    assert code == 0
    assert out.count("eqs (15)-(17)") == 2
    assert load_robot(tmp_path / "line-smooth.toml").friction.only_axes


def test_unsigned_currents_get_their_sign_when_told(call, floors, tmp_path):
    for k in range(12):
        run = read_run(floors / "smooth" / f"run{k}.csv")
        write_run(run.replace(current=np.abs(run.current)), tmp_path / f"run{k}.csv")
    code, _, err = call(str(tmp_path), "--robot", "axebot")
    assert code == 3
    assert "the currents have no sign: none is below 0" in err
    assert "use --current-unsigned" in err
    code, out, _ = call(str(tmp_path), "--robot", "axebot", "--current-unsigned")
    assert code == 0
    assert "its shape, disc," in out


def test_existing_files_are_refused_before_any_work(call, tmp_path, monkeypatch):
    (tmp_path / "fit.toml").write_text("mine")
    monkeypatch.setattr("omnidyn.identification.identify.fit_steady", None)
    assert call("smooth", "--robot", "axebot", "-o", str(tmp_path / "fit.toml"))[0] == 3
    assert (tmp_path / "fit.toml").read_text() == "mine"


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["smooth", "--robot", "axebot", "--shape", "round"], "no such shape; got round; expected auto, box"),
        (["smooth", "--robot", "axebot", "--speed", "fast"], "no such speed; got fast"),
        (["smooth", "--robot", "axebot", "--what", "magic"], "--what: nothing of that name; got magic"),
        (["smooth", "--robot", "axebot", "--window", "0.9,0.4"], "--window: not two shares; got 0.9,0.4"),
        (["smooth", "--robot", "axebot", "--group", "a"], "--group: cannot read the group; got a; expected NAME=GLOB"),
        (["smooth", "--robot", "axebot", "--group", "a=none"], "--group a: no log belongs to this group; got none"),
        ([".", "--robot", "axebot", "--group", "a=smooth", "--group", "b=s*"], "belongs to two groups; got a and b"),
        (["nothing.csv", "--robot", "axebot"], "nothing.csv: no such file"),
    ],
)
def test_bad_input_is_exit_3(call, arguments, words):
    code, out, err = call(*arguments)
    assert (code, out) == (3, "")
    assert words in err


def test_a_robot_is_needed_for_friction(call):
    code, out, err = call("smooth")
    assert (code, out) == (2, "")
    assert "--robot" in err


def test_data_that_cannot_answer_are_exit_4(call):
    code, out, err = call("smooth/run0.csv", "--robot", "axebot")
    assert (code, out) == (4, "")
    assert "no shape can be fitted" in err
    assert "drive in more directions" in err


@pytest.mark.parametrize("shape", [(), ("--shape", "line")])
def test_logs_with_a_fatal_fault_are_fitted_and_end_with_4(call, floors, tmp_path, shape):
    """The second encoder is wired the other way round; the commanded speeds hide it. It was exit 0."""
    for k in range(12):
        run = read_run(floors / "smooth" / f"run{k}.csv")
        write_run(run.replace(wheel_speed=run.wheel_speed * [1.0, -1.0, 1.0]), tmp_path / f"run{k}.csv")
    result, report = tmp_path / "fit.toml", tmp_path / "r.html"
    more = () if shape else ("--report", str(report))
    code, out, err = call(
        str(tmp_path), "--robot", "axebot", "--speed", "set", "--json", "-o", str(result), *more, *shape
    )
    told = strict(out)
    assert (code, told["ok"]) == (4, False)
    assert told["verdict"].startswith("Failed: ")
    assert "run0.csv and " in told["verdict"]
    assert "are not usable as they stand: " in told["verdict"]
    assert sum(each["has_errors"] for each in told["check"]) > 6
    assert err.count("omnidyn: warning: ") < 5  # twelve logs with one fault are one warning
    assert "omnidyn: Failed: " in err
    assert load_robot(result).priors
    if report:
        assert shape or "inverted" in report.read_text("utf-8").partition("What check says of the logs")[2]


# ---- motors ---------------------------------------------------------------------------------------------


@pytest.fixture(scope="session")
def bench(tmp_path_factory):
    """Two motors, u = 0.5 w + 0.4 sgn w, at many steady speeds."""
    folder, t = tmp_path_factory.mktemp("bench"), np.arange(2000) * 0.01
    speed = np.repeat(np.tile([2.0, -3.0, 5.0, -6.0, 4.0], 8), 50)[:, None] * [1.0, 0.9]
    angle = np.cumsum(np.vstack([[[0.0, 0.0]], speed[:-1]]) * 0.01, axis=0)
    write_run(Run(t=t, voltage=0.5 * speed + 0.4 * np.sign(speed), wheel_angle=angle), folder / "bench.csv")
    return folder / "bench.csv"


def test_motors_need_no_robot(call, bench, tmp_path):
    report = tmp_path / "m.html"
    code, out, _ = call(str(bench), "--what", "motors", "--json", "--report", str(report))
    assert code == 0
    first = json.loads(out)["motors"][0]
    assert first["parameters"]["slope"]["value"] == pytest.approx(0.5, rel=0.02)
    assert first["parameters"]["dead_band"]["value"] == pytest.approx(0.4, rel=0.05)
    assert first["dead_band_seen"] is True
    assert "What each motor needs to turn" in report.read_text("utf-8")


def test_motors_in_words(call, bench):
    code, out, err = call(str(bench), "--what", "motors", "-o", "x.toml")
    assert code == 0
    assert "motor 1: slope 0.50" in out
    assert "V s/rad; dead band 0.4" in out
    assert "-o is not used" in err


def test_motors_that_do_not_answer_end_with_4_and_are_shown(call, tmp_path):
    """The speed has nothing to do with the input: it was exit 0."""
    rng, t = np.random.default_rng(3), np.arange(3000) * 0.01
    speed = np.repeat(rng.choice([-6.0, -3.0, 3.0, 6.0], 60), 50)[:, None]
    volts = np.repeat(rng.choice([-4.0, -2.0, 2.0, 4.0], 60), 50)[:, None]
    write_run(Run(t=t, voltage=volts, wheel_speed=speed), tmp_path / "loose.csv")
    code, out, err = call(str(tmp_path / "loose.csv"), "--what", "motors", "--json")
    assert (code, json.loads(out)["ok"]) == (4, False)
    assert "omnidyn: No motor is seen to answer to its input" in err


def test_motors_of_a_log_with_a_fatal_fault_end_with_4_and_are_shown(call, bench, tmp_path):
    """Currents without a sign: whatever the lines say, they go through the wrong points. It was exit 0."""
    run = read_run(bench)
    log, result, report = tmp_path / "log.csv", tmp_path / "fit.toml", tmp_path / "m.html"
    write_run(run.replace(current=np.abs(run.voltage)), log)
    arguments = (str(log), "--what", "motors", "--input", "current", "--robot", "robotino", "-o", str(result))
    code, out, err = call(*arguments, "--report", str(report), "--json")
    told = strict(out)
    assert (code, told["ok"]) == (4, False)
    assert "log.csv is not usable as it stands: the currents are never negative" in told["verdict"]
    assert "omnidyn: Failed: " in err
    assert any("--current-unsigned" in step["text"] for step in told["next"])
    assert report.exists()
    code, out, _ = call(*arguments, "--current-unsigned", "--force", "--json")
    assert (code, strict(out)["ok"]) == (0, True)


@pytest.mark.parametrize("what", ["motors", "friction"])
def test_what_a_log_lacks_is_said_with_the_column_that_looks_like_it(call, tmp_path, what):
    """A PWM without a unit: "expected voltage, duty, current", and the remedy stood in a doubt three lines above."""
    rows = [f"{0.02 * k:.2f},{k % 200},{-(k % 200)},{k % 100},{0.1 * k},{-0.1 * k},{0.05 * k}" for k in range(400)]
    (tmp_path / "pwm.csv").write_text("t_s,pwm1,pwm2,pwm3,w1_rad_s,w2_rad_s,w3_rad_s\n" + "\n".join(rows) + "\n")
    code, _, err = call(str(tmp_path / "pwm.csv"), "--robot", "axebot", "--what", what)
    assert code == 3
    last = err.strip().splitlines()[-1]
    assert "error: " in last
    assert "no motor input: pwm1 .. pwm3, no unit is given (say --assume d=" in last


def test_a_file_named_twice_counts_once_and_so_it_says(call):
    _, out, err = call("smooth", "smooth/run3.csv", "--robot", "axebot", "--json")
    assert json.loads(out)["groups"]["all"]["along_travel"]["runs"] == 12
    assert "1 of 13 files are named twice: each counts once" in err


def test_motors_from_a_table_without_a_time(call, tmp_path):
    """u = 0.5 w + 0.4: at rest up to 0.6 V, and 0.8 V moves it."""
    table, report = tmp_path / "table.csv", tmp_path / "m.html"
    rows = [(u, (u - 0.4) / 0.5 if u > 0.7 else 0.0) for u in np.arange(0.0, 4.0, 0.2).tolist()]
    table.write_text("voltage_V,speed\n" + "".join(f"{u},{w}\n" for u, w in rows))
    code, out, _ = call(str(table), "--what", "motors", "--json", "--report", str(report))
    assert code == 0
    (start,) = json.loads(out)["starts"]
    assert start["parameters"]["start"]["ci95"] == pytest.approx([0.6, 0.8])
    assert start["parameters"]["offset"]["value"] == pytest.approx(0.4)
    assert "Where each direction starts" in report.read_text("utf-8")
    code, out, _ = call(str(table), "--what", "motors")
    assert "nan" not in out
    assert "both ways" not in out  # it turned one way only
    code, _, err = call(str(table))
    assert code == 2
    assert "table.csv is a table of motors: say --what motors" in err
    code, out, _ = call(str(table), "--what", "motors")
    assert "Motor 1 starts at 0.7 V." in out
    assert "the dead band is 0.7 V" in out


def test_motors_go_into_a_robot_file(call, bench, tmp_path):
    """u = 0.5 w + 0.4 sgn w at two wheels of three: K_v = 0.5 V s/rad over the gear of 16, c = g 0.4 V."""
    out = tmp_path / "fit.toml"
    code, text, _ = call(str(bench), "--what", "motors", "--robot", "robotino", "-o", str(out), "--json")
    assert code == 0
    robot, told = load_robot(out), json.loads(text)["robot"]["numbers"]
    key = "motor.emf_constant_Vs_rad[0]"
    assert robot.motor.emf_constant[0] == told[key]["value"] == pytest.approx(0.5 / 16.0, rel=0.02)
    assert robot.motor.emf_constant[2] == load_robot("robotino").motor.emf_constant
    assert "bench.csv" in robot.priors[key].source
    force = 0.5 / (5.95 * 0.04) * 0.4
    assert robot.friction.wheels.coulomb == pytest.approx((force, force, 0.0), rel=0.05)


@pytest.mark.parametrize("option", ["-o", "--report", "--save-map"])
def test_no_result_replaces_a_log_even_when_forced(call, floors, tmp_path, option):
    log = tmp_path / "drive.csv"
    log.write_bytes((floors / "smooth" / "run0.csv").read_bytes())
    before = log.read_bytes()
    code, _, err = call(str(log), "--robot", "axebot", option, str(log), "--force")
    assert code == 3
    assert "the result would replace its own input" in err
    assert log.read_bytes() == before


def test_a_log_of_one_row_is_exit_4_without_a_warning_of_numpy(call, tmp_path):
    (tmp_path / "one.csv").write_text("t_s,u1_V,u2_V,u3_V,w1_rad_s,w2_rad_s,w3_rad_s\n0,1,1,1,2,2,2\n")
    code, _, err = call(str(tmp_path / "one.csv"), "--robot", "axebot")
    assert code == 4
    assert "no steady window was found" in err


def test_a_method_that_the_logs_chose_is_named_in_the_result_of_the_command(tmp_path, capsys):
    """The logs have currents and no voltage: whole logs cannot be fitted."""
    for k, run in enumerate(clean_runs(robot_with("disc"), DIRECTIONS)):
        write_run(run.replace(voltage=None), tmp_path / f"run{k}.csv")
    assert main(["identify", str(tmp_path), "--robot", "axebot", "--quick", "--json"]) == 0
    assert "method_chosen" in [warning["code"] for warning in json.loads(capsys.readouterr().out)["warnings"]]


@pytest.mark.parametrize("command", ["check", "identify"])
def test_a_file_that_is_named_twice_is_said_once(command, floors, capsys):
    log = str(floors / "smooth" / "run0.csv")
    main([command, log, log, "--robot", "axebot"])
    assert capsys.readouterr().err.count("1 of 2 files are named twice") == 1
