"""omnidyn identify by output error: the default method, groups, held-out logs, the report, refusals, an interrupt."""

import re

import numpy as np
import pytest

from omnidyn.cli import main
from omnidyn.identification.output_error.solve.progress import FitProgress
from omnidyn.identification.output_error.solve.solver import Solver
from omnidyn.logs.run_file import write_run
from omnidyn.model.keys import Key
from omnidyn.model.robot_file import load_robot
from omnidyn.run import Run
from omnidyn.simulation.simulate import simulate
from tests.support.axebot_logs import excitation, noisy_draw
from tests.support.outputs import strict

ROUGH = 2.6  # N along x; the preset has 2.2
COULOMB = "friction.axes.coulomb[0]"
TOLD = FitProgress.__call__


@pytest.fixture(scope="session")
def logs(tmp_path_factory):
    """Two logs of 20 s on each of two floors, and one without inputs."""
    folder, axebot = tmp_path_factory.mktemp("logs"), load_robot("axebot")
    for k, name in enumerate(("smooth", "smooth", "rough", "rough")):
        robot = axebot if name == "smooth" else Key.parse(COULOMB).set(axebot, ROUGH)
        write_run(noisy_draw(simulate(robot, excitation(20.0, seed=k), 0.01), k), folder / f"{name}{k}.csv")
    speeds = simulate(axebot, excitation(5.0), 0.01)
    write_run(Run(t=speeds.t, wheel_speed=speeds.wheel_speed), folder / "inputless.csv")
    return folder


@pytest.fixture
def call(logs, tmp_path, monkeypatch, capsys):
    """Run a command in the folder of the logs: (exit code, stdout, stderr)."""
    monkeypatch.chdir(logs)

    def run(*arguments):
        code = main(["identify", *arguments])
        return code, *capsys.readouterr()

    return run


@pytest.fixture
def mirrored(logs):
    """A log whose y points the other way, as of a camera above the field."""
    run = noisy_draw(simulate(load_robot("axebot"), excitation(20.0, seed=7), 0.01), 7)
    if not (logs / "mirrored.csv").exists():
        write_run(run.replace(twist=run.twist * [1.0, -1.0, 1.0]), logs / "mirrored.csv")
    return "mirrored.csv"


def test_a_model_that_does_not_follow_its_log_is_written_and_ends_with_4(call, mirrored, tmp_path):
    """The verdict is the first line; it was exit 0, with a warning after the table."""
    out = tmp_path / "fit.toml"
    code, told, err = call(mirrored, "--robot", "axebot", "-o", str(out), "--nuisance", "none")
    assert code == 4
    assert told.startswith("Failed: the model does not follow vy (fit ")
    assert "omnidyn: Failed: the model does not follow vy" in err
    assert load_robot(out).priors[COULOMB].origin == "identified"
    code, told, _ = call(mirrored, "--robot", "axebot", "--json", "--nuisance", "none", "--quick")
    assert code == 4
    assert not strict(told)["ok"]
    options = ("--hold-out", mirrored, "--nuisance", "none", "--quick")
    code, told, _ = call("smooth0.csv", mirrored, "--robot", "axebot", *options)
    assert code == 4
    assert "does not follow vy" in told.splitlines()[0]


def test_a_model_that_follows_says_so_first(call):
    code, told, _ = call("smooth0.csv", "--robot", "axebot", "--nuisance", "none")
    assert code == 0
    assert re.match(r"On the fitted logs the model follows .* within", told)


def test_output_error_is_the_default_and_predicts_a_log_it_never_saw(call, tmp_path):
    arguments = ("smooth0.csv", "smooth1.csv", "--robot", "axebot", "--hold-out", "smooth1.csv", "--full")
    code, out, err = call(*arguments, "-o", str(tmp_path / "fit.toml"), "--report", str(tmp_path / "r.html"))
    assert code == 0
    assert "output error, maximum likelihood" in out
    assert "held-out logs are predicted as well as the noise allows" in out
    assert f"wrote {tmp_path / 'fit.toml'}" in err
    robot = load_robot(tmp_path / "fit.toml")
    prior = robot.priors[COULOMB]
    assert abs(robot.friction.axes.coulomb[0] - 2.2) < 4.0 * prior.std
    page = (tmp_path / "r.html").read_text("utf-8")
    for anchor in ("numbers", "dead-zone", "data", "runs", "residuals", "correlation", "warnings", "next", "made"):
        assert f'id="{anchor}"' in page
    assert "on a log held out" in page
    assert '<th scope="col">voltage V</th>' in page
    assert "Band: 95 % interval" in page
    assert page.count("Bands: how far numbers that are off") >= 2  # fitted and held out
    assert len(robot.correlation.keys) == 6
    assert "://" not in page


def test_json_has_the_validation_and_is_the_same_again(call):
    arguments = ("smooth0.csv", "smooth1.csv", "--robot", "axebot", "--hold-out", "smooth1*", "--json")
    first, again = (strict(call(*arguments)[1]) for _ in range(2))
    assert first == again
    assert first["method"].startswith("output error, maximum likelihood")
    assert first["validation"]["held_out"]["logs"] == ["smooth1.csv"]
    vx = first["validation"]["held_out"]["components"]["vx"]
    assert vx["rmse"] == pytest.approx(0.02, rel=0.05)  # the noise of the log
    assert vx["chi2"] == pytest.approx(1.0, abs=0.1)
    assert len(first["provenance"]["inputs"]) == 3
    assert first["check"][0]["has_errors"] is False


def test_a_log_of_another_floor_is_not_predicted(call):
    arguments = ("smooth0.csv", "rough2.csv", "--robot", "axebot", "--hold-out", "rough2.csv", "--quick")
    out = " ".join(call(*arguments)[1].split())
    assert re.search(r"^On logs held out .* but its errors are [\d.]+ times the noise: something differs", out)
    assert "on held-out logs the errors of vx" in call(*arguments, "--full")[1]


def test_groups_share_the_motor_and_have_their_own_friction(call, tmp_path):
    code, out, _ = call(
        ".",
        "--robot",
        "axebot",
        "--per",
        "smooth=smooth*",
        "--per",
        "rough=rough*",
        "--free",
        "friction",
        "--free",
        "motor.torque_constant_Nm_A",
        "--json",
        "-o",
        str(tmp_path / "f.toml"),
    )
    assert code == 0
    result = strict(out)
    motors = {g["parameters"]["motor.torque_constant_Nm_A"]["value"] for g in result["groups"].values()}
    assert len(motors) == 1
    found = {d["key"]: d for d in result["differences"]}
    assert found[COULOMB]["differs"]
    change = ROUGH - 2.2 if found[COULOMB]["first"] == "smooth" else 2.2 - ROUGH
    assert found[COULOMB]["low"] < change < found[COULOMB]["high"]
    assert sum(d["differs"] for d in found.values()) <= 2  # one for certain; another by chance, one in 20 each
    assert load_robot(tmp_path / "f-rough.toml").friction.axes.coulomb[0] == pytest.approx(ROUGH, abs=0.1)


def test_without_inputs_it_is_steady_state_and_says_why(call):
    code, _, err = call("inputless.csv", "--robot", "axebot")
    assert code in (3, 4)
    assert "omnidyn: steady-state, not output-error: inputless.csv holds no voltage and no duty" in err
    assert err.count("columns of") == 1


def test_a_new_robot_is_fitted_to_its_logs_by_default(tmp_path, monkeypatch, capsys):
    """As omnidyn init writes it: friction along the direction of travel, a turning frame. The truth: 1.3 times it."""
    monkeypatch.chdir(tmp_path)
    assert (
        main(
            [
                "init",
                "newbie",
                "--azimuth",
                "60,180,300",
                "--wheel-radius",
                "0.05",
                "--robot-radius",
                "0.15",
                "--mass",
                "6",
                "--voltage-limit",
                "12",
            ]
        )
        == 0
    )
    guess = load_robot("newbie.toml")
    levels = tuple(1.3 * level for level in guess.friction.direction.coulomb)
    direction = guess.friction.direction.replace(coulomb=levels)
    true = guess.replace(friction=guess.friction.replace(direction=direction))
    write_run(noisy_draw(simulate(true, 2.0 * excitation(8.0), 0.01), 1), "log.csv")
    capsys.readouterr()
    assert main(["identify", "log.csv", "--robot", "newbie.toml", "--json"]) == 0
    told = strict(capsys.readouterr().out)
    assert told["method"].startswith("output error")
    for axis in range(2):
        low, high = told["parameters"][f"friction.direction.coulomb[{axis}]"]["ci95"]
        assert low - 0.1 < levels[axis] < high + 0.1


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["--method", "output-error", "--shape", "disc"], "output-error has no such option; got --shape"),
        (["--method", "output-error", "--group", "a=*"], "for groups use --per"),
        (["--method", "steady-state", "--free", "friction"], "steady-state has no such option; got --free"),
        (["--method", "steady-state", "--nuisance", "gain"], "steady-state has no such option; got --nuisance"),
        (["--shape", "disc", "--loss", "student-t"], "steady-state has no such option; got --loss"),
        (["--between", "mean"], "--between: an option of the motors"),
        (["--what", "motors", "--free", "friction"], "--what motors: not an option of the motors; got --free"),
        (["--hold-out", "none*"], "--hold-out: no log to hold out; got none*"),
        (["--hold-out", "*.csv"], "--hold-out: every log is held out"),
        (["--per", "a=smooth0*"], "the logs have only one group"),
        (["--free", "body.weight"], "body.weight"),
        (["--nuisance", "wind"], "no such nuisance; got wind"),
        (["--loss", "huber"], "unknown loss; got huber"),
        (["--start", "moving"], "unknown start; got moving"),
        (["--method", "magic"], "no such method; got magic"),
        (["--per-free", "body.mass_kg"], "--per-free: there are no groups"),
    ],
)
def test_what_does_not_belong_is_refused_by_name(call, arguments, words):
    code, out, err = call("smooth0.csv", "--robot", "axebot", *arguments)
    assert (code, out) == (3, "")
    assert words in err


def cut_at_the_second_state():
    """What follows a fit, and interrupts it at the second better state."""
    count = []

    def interrupted(self, report):
        TOLD(self, report)
        if report.state is not None:
            count.append(report.state)
            if len(count) == 2:
                raise KeyboardInterrupt

    return interrupted


def test_an_interrupt_leaves_the_best_so_far(call, tmp_path, monkeypatch):
    monkeypatch.setattr(FitProgress, "__call__", cut_at_the_second_state())
    code, out, err = call("smooth0.csv", "--robot", "axebot", "-o", str(tmp_path / "fit.toml"))
    assert code == 130
    assert "the fit was interrupted: the numbers are the best so far" in out.replace("\n  ", " ")
    assert "interrupted" in err
    assert load_robot(tmp_path / "fit.toml").friction.axes.coulomb[0] == pytest.approx(2.2, abs=0.3)


def test_an_interrupt_while_groups_are_fitted_alone_leaves_the_best_so_far(call, tmp_path, monkeypatch):
    told, heard = FitProgress.enter, []

    def listening(self, words):
        told(self, words)
        if words.startswith("rough alone"):
            heard.append(words)
            if len(heard) == 2:
                raise KeyboardInterrupt

    monkeypatch.setattr(FitProgress, "enter", listening)
    code, out, err = call(
        ".",
        "--robot",
        "axebot",
        "--per",
        "smooth=smooth*",
        "--per",
        "rough=rough*",
        "--json",
        "-o",
        str(tmp_path / "{group}.toml"),
    )
    assert code == 130
    assert "interrupted: the numbers are the best so far" in err
    groups = strict(out)["groups"]
    assert groups["rough"]["parameters"][COULOMB]["value"] == pytest.approx(ROUGH, abs=0.4)
    begun = [each["subject"] for each in groups["smooth"]["warnings"] if each["code"] == "group_not_fitted"]
    assert begun == ["smooth"]


def test_an_interrupt_of_groups_leaves_the_best_so_far_and_the_same_again(call, tmp_path, monkeypatch):
    arguments = (
        ".",
        "--robot",
        "axebot",
        "--per",
        "smooth=smooth*",
        "--per",
        "rough=rough*",
        "--free",
        "friction",
        "--free",
        "motor.torque_constant_Nm_A",
        "--json",
    )
    found = []
    for name in ("a.toml", "b.toml"):
        monkeypatch.setattr(FitProgress, "__call__", cut_at_the_second_state())
        code, out, err = call(*arguments, "-o", str(tmp_path / name))
        assert code == 130
        assert "interrupted" in err
        result = strict(out)
        del result["output"], result["provenance"]
        found.append(result)
        for group, level in (("smooth", 2.2), ("rough", ROUGH)):
            robot = load_robot(tmp_path / f"{name[0]}-{group}.toml")
            assert robot.friction.axes.coulomb[0] == pytest.approx(level, abs=0.3)
    assert found[0] == found[1]
    assert (tmp_path / "a-rough.toml").read_bytes() == (tmp_path / "b-rough.toml").read_bytes()


def test_too_few_runs_to_draw_are_told_before_the_fit(call, monkeypatch):
    def never(self, *_):
        raise AssertionError("a fit has begun")

    monkeypatch.setattr(Solver, "state", never)
    code, _, err = call("smooth0.csv", "smooth1.csv", "--robot", "axebot", "--bootstrap", "20")
    assert code == 4
    assert "too few runs for a bootstrap; got 2; expected 5 or more" in err
    groups = ("--per", "smooth=smooth*", "--per", "rough=rough*")
    code, _, err = call(".", "--robot", "axebot", *groups, "--bootstrap", "20")
    assert code == 4
    assert "too few runs for a bootstrap; got 2 in rough; expected 5 or more" in err


def test_groups_have_profiles(call):
    groups = ("--per", "smooth=smooth*", "--per", "rough=rough*")
    code, out, _ = call(
        ".", "--robot", "axebot", *groups, "--nuisance", "none", "--profile", COULOMB, "--json", "--quick"
    )
    assert code == 0
    low, high = strict(out)["groups"]["rough"]["parameters"][COULOMB]["ci95"]
    assert low < ROUGH + 0.05
    assert high > ROUGH - 0.05


def test_a_log_without_motion_is_exit_4(call, tmp_path):
    rest = simulate(load_robot("axebot"), np.full((200, 3), 0.05), 0.01)
    noise = np.random.default_rng(1).normal(size=rest.twist.shape) * 0.02
    write_run(Run(t=rest.t, voltage=rest.voltage, twist=rest.twist + noise), tmp_path / "rest.csv")
    code, out, err = call(str(tmp_path / "rest.csv"), "--robot", "axebot", "-o", str(tmp_path / "fit.toml"))
    assert (code, out) == (4, "")
    assert "never visibly moved" in err
    assert not (tmp_path / "fit.toml").exists()


# ---- motors ---------------------------------------------------------------------------------------------


def euler(speed, u, steps=200):
    """One row of 10 ms by Euler's method: w' = (u - 0.4 sgn w - 0.5 w)/(0.5 x 0.05), stick at 0."""
    h = 0.01 / steps
    for _ in range(steps):
        if speed == 0.0 and abs(u) <= 0.4:
            return 0.0
        side = np.sign(speed) or np.sign(u)
        new = speed + h * (u - 0.4 * side - 0.5 * speed) / (0.5 * 0.05)
        speed = new if new * side > 0.0 else 0.0
    return speed


def test_motors_by_output_error(call, tmp_path):
    """k = 0.5 V s/rad, a dead band of 0.4 V and a lag of 0.05 s, in small steps of Euler's; noise 0.05 rad/s."""
    t, rng = np.arange(2001) * 0.01, np.random.default_rng(0)
    for log in (1, 2):
        level = np.repeat(rng.uniform(-4.0, 4.0, 80), 25)
        speed = [0.0]
        for u in level:
            speed.append(euler(speed[-1], u))
        measured = np.array(speed) + 0.05 * rng.standard_normal(2001)
        put_in = np.append(level, level[-1])[:, None]
        write_run(Run(t=t, voltage=put_in, wheel_speed=measured[:, None]), tmp_path / f"{log}.csv")
    code, out, _ = call(
        str(tmp_path / "1.csv"),
        str(tmp_path / "2.csv"),
        "--what",
        "motors",
        "--method",
        "output-error",
        "--hold-out",
        "2.csv",
        "--json",
        "--report",
        str(tmp_path / "m.html"),
    )
    assert code == 0
    (motor,) = strict(out)["motors"]
    for name, true in (("slope", 0.5), ("dead_band", 0.4), ("lag", 0.05)):
        found = motor["parameters"][name]
        assert abs(found["value"] - true) < 4.0 * found["std"] + 2e-3 * true  # and what Euler's steps are off by
    assert motor["plain"]["held_out_rmse_rad_s"] > motor["held_out_rmse_rad_s"]
    assert motor["dead_band_seen"]
    assert "Motors from logs" in (tmp_path / "m.html").read_text("utf-8")


def test_an_interrupt_while_free_runs_are_compared_keeps_the_fit(call, tmp_path, monkeypatch):
    def cut(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("omnidyn.identification.identify.validate", cut)
    out = tmp_path / "fit.toml"
    code, text, err = call("smooth0.csv", "--robot", "axebot", "-o", str(out), "--report", str(tmp_path / "r.html"))
    assert code == 130
    assert "not made: the comparison with the logs: interrupted" in err
    assert COULOMB in text
    assert load_robot(out).priors[COULOMB].std
    assert not (tmp_path / "r.html").exists()
