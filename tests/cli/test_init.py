"""omnidyn init and deadzone --map: what they write, ask and refuse."""

import contextlib
import io
import json
import os
import re
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn import Run, write_run
from omnidyn.cli import main
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import Key
from omnidyn.model.mass import mass_matrix
from omnidyn.model.robot import Prior
from omnidyn.model.robot_file import load_robot, parse_robot, robot_to_toml
from tests.support.staggered import Logged, Topic, plant

MINI = ["--azimuth", "60,180,300", "--wheel-radius", "0.04", "--robot-radius", "0.125", "--mass", "8"]


class Terminal(io.StringIO):
    """Somebody who types these lines."""

    def isatty(self):
        return True


@pytest.fixture
def typed(call, monkeypatch):
    """Run a command at a terminal with these answers."""

    def run(answers, *arguments):
        monkeypatch.setattr("sys.stdin", Terminal(answers))
        monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
        return call(*arguments)

    return run


# ---- what it writes --------------------------------------------------------------------------------------


def test_azimuths_radii_and_a_mass_are_enough(call, here):
    code, out, err = call("init", "mini", "--wheels", "3", *MINI)
    assert (code, out) == (0, "mini.toml\n")
    assert err == (
        "omnidyn: guessed: inertia, resistance, torque constant, emf constant, gear ratio, voltage limit, "
        "rotor inertia, friction\n"
    )
    robot = load_robot(here / "mini.toml")
    assert robot.name == "mini"
    assert (robot.body.mass, robot.wheels.wheel_radius, robot.wheels.robot_radius) == (8.0, 0.04, 0.125)
    assert robot.wheels.azimuth_deg == (60.0, 180.0, 300.0)
    assert robot.body.rotating_frame is True
    assert robot.priors["body.mass_kg"] == Prior(origin="given")
    assert robot.priors["motor.resistance_ohm"] == Prior(std=robot.motor.resistance, origin="guess")


def test_the_file_is_for_people_too(call, here):
    call("init", "mini", *MINI)
    text = (here / "mini.toml").read_text()
    assert text.startswith("# Written by omnidyn init.")
    assert "#   body.inertia_kg_m2: a uniform disc out to the wheels, M b^2/2\n" in text
    assert 'mass_kg = { value = 8.0, origin = "given" }  # M\n' in text
    assert "[N]" in text
    assert text.endswith(robot_to_toml(load_robot(here / "mini.toml")))


def test_the_file_simulates_at_once(call, here):
    call("init", "mini", *MINI)
    (here / "u.csv").write_text("t_s,u1_V,u2_V,u3_V\n0,-10.4,0,10.4\n2,0,0,0\n3,0,0,0\n")
    code, out, err = call("simulate", "mini.toml", "u.csv", "--json")
    assert code == 0
    assert "warning" not in err
    result = json.loads(out)
    assert result["moved"] is True
    assert 1.0 < result["final_pose"]["x_m"] < 2.5
    assert result["final_twist"] == {"vx_m_s": 0.0, "vy_m_s": 0.0, "omega_rad_s": 0.0}


def test_the_guess_for_machines(call):
    code, out, _ = call("init", "mini", *MINI, "--voltage-limit", "24", "--json")
    assert code == 0
    result = json.loads(out)
    assert (result["robot"], result["output"]) == ("mini", "mini.toml")
    assert result["guessed"][-1] == "friction"
    assert "voltage limit" not in result["guessed"]
    assert result["provenance"]["command"].startswith("omnidyn init mini --azimuth 60,180,300")


def test_the_file_to_stdout_or_elsewhere(call, here):
    _, out, _ = call("init", "mini", *MINI, "-o", "-")
    assert os.listdir(here) == []
    assert call("init", "mini", *MINI, "--out", "other.toml")[1] == "other.toml\n"
    assert (here / "other.toml").read_text() == out
    assert call("init", "mini.toml", *MINI)[1] == "mini.toml\n"
    assert load_robot(here / "mini.toml").name == "mini"


def test_a_rotor_from_its_data_sheet(call, here):
    """At the motor shaft, behind a gear that is known: 1.1 kg of a 6.2 kg robot."""
    known = ["--azimuth", "45,135,225,315", "--wheel-radius", "0.05", "--robot-radius", "0.18", "--mass", "6.2"]
    code, _, err = call("init", "mini", *known, "--rotor-inertia", "1.5e-6", "--gear-ratio", "30")
    assert code == 0
    assert "rotor" not in err
    assert "gear" not in err
    robot = load_robot(here / "mini.toml")
    assert (robot.motor.rotor_inertia, robot.motor.gear_ratio) == (1.5e-6, 30.0)
    assert robot.priors["motor.rotor_inertia_kg_m2"] == robot.priors["motor.gear_ratio"] == Prior(origin="given")
    assert mass_matrix(robot)[0, 0] == pytest.approx(6.2 + 1.08, rel=1e-9)
    guess = first_guess("mini", robot.wheels, 6.2)
    assert robot.motor.torque_constant * 30.0 == pytest.approx(
        guess.motor.torque_constant * guess.motor.gear_ratio, rel=1e-5
    )


def test_a_known_gear_leaves_what_a_guessed_rotor_weighs(call, here):
    call("init", "guess", *MINI)
    call("init", "known", *MINI, "--gear-ratio", "100")
    guess, known = (load_robot(here / f"{name}.toml") for name in ("guess", "known"))
    assert mass_matrix(known)[0, 0] == pytest.approx(mass_matrix(guess)[0, 0], rel=1e-4)
    prior = known.priors["motor.rotor_inertia_kg_m2"]
    assert prior.origin == "guess"
    assert prior.std == pytest.approx(known.motor.rotor_inertia, rel=1e-2)


def test_gear_and_rotor_beside_a_preset(call, here):
    code, _, _ = call("init", "mine", "--like", "robotino", "--rotor-inertia", "7.1e-6", "--gear-ratio", "16")
    robot, preset = load_robot(here / "mine.toml"), load_robot("robotino")
    assert code == 0
    assert (robot.motor.rotor_inertia, robot.motor.gear_ratio) == (7.1e-6, 16.0)
    assert robot.motor.torque_constant == preset.motor.torque_constant
    assert call("init", "other", "--like", "robotino", "--rotor-inertia", "7.1e-6")[0] == 0


@pytest.mark.parametrize(
    "more, words",
    [
        (["--rotor-inertia", "1.5e-6"], "give --gear-ratio too"),
        (["--rotor-inertia", "15", "--gear-ratio", "30"], "1 g cm2 = 1e-7 kg m2"),
        (["--rotor-inertia", "-1e-6", "--gear-ratio", "30"], "rotor_inertia"),
        (["--gear-ratio", "0"], "more than 0, such as 30"),
    ],
)
def test_a_rotor_that_cannot_be_is_refused(call, here, more, words):
    code, _, err = call("init", "mini", *MINI, *more)
    assert code == 3
    assert words in err
    assert not (here / "mini.toml").exists()


def test_mecanum_wheels_need_no_azimuths(call, here):
    code, _, _ = call("init", "crab", "--mecanum", "--wheel-radius", "0.05", "--robot-radius", "0.3", "--mass", "12")
    assert code == 0
    robot = load_robot(here / "crab.toml")
    assert robot.wheels.roller_angle_deg == (-45.0, 45.0, 45.0, -45.0)
    assert robot.wheels.count == 4


def test_friction_on_the_axes_can_be_identified_today(call, here):
    call("init", "box", *MINI, "--friction", "axes")
    robot = load_robot(here / "box.toml")
    assert robot.friction.only_axes
    assert robot.friction.axes.coulomb == (15.7, 15.7, 0.981)


def test_like_a_preset(call, here):
    code, out, err = call("init", "mine", "--like", "robotino", "--mass", "16")
    assert (code, out) == (0, "mine.toml\n")
    assert err == "omnidyn: what was not given is like robotino; inertia and friction are scaled to the size\n"
    robot, preset = load_robot(here / "mine.toml"), load_robot("robotino")
    assert robot.motor == preset.motor
    assert robot.drive == preset.drive
    assert robot.friction.direction.coulomb == (85.0, 72.2)
    assert robot.priors["body.mass_kg"] == Prior(origin="given")
    assert robot.priors["motor.gear_ratio"] == Prior(std=4.8, source="like robotino", origin="imported")


def test_like_a_preset_with_other_wheels(call, here):
    code, _, err = call("init", "mine", "--like", "axebot", "--wheels", "4")
    assert code == 2
    assert "--azimuth missing" in err
    assert call("init", "mine", "--like", "axebot", "--azimuth", "45,135,-135,-45")[0] == 0
    assert load_robot(here / "mine.toml").wheels.azimuth_deg == (45.0, 135.0, -135.0, -45.0)
    assert call("init", "crab", "--like", "axebot", "--mecanum")[0] == 0
    assert load_robot(here / "crab.toml").wheels.wheel_radius == 0.035


def test_like_one_s_own_file(call, here):
    call("init", "mini", *MINI)
    assert call("init", "maxi", "--like", "mini.toml", "--mass", "9")[0] == 0
    assert load_robot(here / "maxi.toml").priors["motor.gear_ratio"].source == "like mini"


@pytest.mark.parametrize("gear", [1.0, 16.0])
def test_a_log_shows_where_the_wheels_stand(call, here, gear):
    """The log is made by hand: rim speed of wheel i is -sin(phi) vx + cos(phi) vy + b omega."""
    twist = np.random.default_rng(4).normal(size=(50, 3)) * 0.2
    phi = np.radians([60.0, 180.0, 300.0])
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi)) + 0.125 * twist[:, 2:]
    write_run(Run(t=np.arange(50) * 0.01, twist_command=twist, wheel_speed_command=gear * rim / 0.04), here / "log.csv")
    code, out, err = call("init", "bot", "--log", "log.csv", "--wheel-radius", "0.04", "--mass", "8")
    assert (code, out) == (0, "bot.toml\n")
    assert "omnidyn: wheels at 60,180,300 degrees, from twist_command and wheel_speed_command" in err
    robot = load_robot(here / "bot.toml")
    assert robot.wheels.azimuth_deg == (60.0, 180.0, 300.0)
    assert robot.wheels.robot_radius == 0.125
    assert robot.priors["wheels.azimuth_deg"].source == "logs: twist_command and wheel_speed_command"
    assert robot.priors["wheels.wheel_radius_m"] == Prior(origin="given")
    plain = first_guess("bot", robot.wheels, 8.0)
    assert (robot.motor.gear_ratio == 16.0) == (gear == 16.0)
    assert robot.motor.gear_ratio * robot.motor.emf_constant == pytest.approx(
        plain.motor.gear_ratio * plain.motor.emf_constant, rel=1e-2
    )


def test_the_columns_of_a_log_can_be_named(call, here):
    """What check accepts, init does: wheels named by their place, a clock without a unit, speeds in rpm."""
    rng = np.random.default_rng(4)
    twist = rng.normal(size=(50, 3)) * 0.2
    phi = np.radians([60.0, 180.0, 300.0])
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi)) + 0.125 * twist[:, 2:]
    rows = np.column_stack([np.arange(50) * 500.0, twist, rim / 0.04 * 30.0 / np.pi])
    head = "count,vx,vy,omega,left,back,right"
    np.savetxt(here / "log.csv", rows, delimiter=",", header=head, comments="")
    given = ("init", "bot", "--log", "log.csv", "--wheel-radius", "0.04", "--mass", "8")
    assert call(*given)[0] == 3
    named = [f"--column=w{k + 1}={name}:rpm" for k, name in enumerate(("left", "back", "right"))]
    code, out, err = call(*given, *named, "--column=t=count:ms")
    assert (code, out) == (0, "bot.toml\n")
    assert "omnidyn:   wheel_speed: w1 <- left [rpm], w2 <- back [rpm], w3 <- right [rpm]" in err
    np.testing.assert_allclose(load_robot(here / "bot.toml").wheels.azimuth_deg, (60.0, 180.0, 300.0), atol=0.01)
    code, _, err = call("init", "bot2", *MINI, "--column", "w1=left")
    assert (code, "are for --log" in err) == (2, True)


def test_a_log_that_does_not_tell_of_turning_says_so(call, here):
    twist = np.random.default_rng(4).normal(size=(50, 3)) * [0.2, 0.2, 3.0]
    phi = np.radians([60.0, 180.0, 300.0])
    rim = np.outer(twist[:, 0], -np.sin(phi)) + np.outer(twist[:, 1], np.cos(phi)) + 0.125 * twist[:, 2:]
    twist[:, 2] = np.nan
    write_run(Run(t=np.arange(50) * 0.01, twist=twist, wheel_speed=rim / 0.04), here / "log.csv")
    code, _, err = call("init", "bot", "--log", "log.csv", "--wheel-radius", "0.04", "--mass", "8")
    assert code == 3
    assert "a turn rate is not in the logs, or 0" in err
    assert "--column omega=NAME:UNIT" in err


@pytest.mark.parametrize(
    "wrong, words, call_meant",
    [
        (["--wheel-radius", "2.9"], "--wheel-radius: no wheel radius is so large; got 2.9 m", "--wheel-radius 0.029"),
        (["--wheel-radius", "40"], "--wheel-radius: no wheel radius is so large; got 40 m", "--wheel-radius 0.04"),
        (["--wheel-radius", "40,40,34"], "got 40,40,34 m; expected metres", "--wheel-radius 0.04,0.04,0.034"),
        (
            ["--wheel-radius", "0.4", "--robot-radius", "0.3"],
            "a wheel is larger than the robot",
            "--wheel-radius 0.01016",
        ),
        (
            ["--wheel-radius", "0.125", "--robot-radius", "0.04"],
            "a wheel is larger than the robot",
            "--wheel-radius 0.04 --robot-radius 0.125",
        ),
        (["--robot-radius", "125"], "--robot-radius: no robot radius is so large; got 125 m", "--robot-radius 0.125"),
        (["--mass", "1450"], "--mass: no robot of this size is so heavy; got 1450 kg in 0.33 m", "--mass 1.45"),
        (["--mass", "0.008"], "--mass: no robot of this size is so light", "--mass 8"),
        (["--azimuth", "1.047,3.1416,5.236"], "--azimuth: these angles look like radians", "--azimuth 60,180,300"),
        (["--azimuth", "0.785,2.356,-2.356,-0.785"], "look like radians", "--azimuth 45,135,-135,-45"),
        (["--azimuth", "0,2.0944,-2.0944"], "look like radians", "--azimuth 0,120,-120"),
    ],
)
def test_sizes_that_cannot_be_are_asked_about_and_the_call_in_the_message_works(call, here, wrong, words, call_meant):
    code, out, err = call("init", "mini", *MINI, *wrong)
    assert (code, out, os.listdir(here)) == (3, "", [])
    assert words in err
    assert f"say {call_meant} if " in err
    assert call("init", "mini", *MINI, *call_meant.split())[0] == 0


@pytest.mark.parametrize(
    "right",
    [
        ["--mass", "40"],
        ["--mass", "0.3"],
        ["--robot-radius", "1.2", "--wheel-radius", "0.2", "--mass", "1450"],
        ["--robot-radius", "0.02", "--wheel-radius", "0.008", "--mass", "0.1"],
        ["--azimuth", "0,10,180,270"],
        ["--wheel-radius", "0.12"],
        ["--azimuth", "-5,120,240"],
    ],
)
def test_sizes_of_small_and_large_robots_are_taken(call, here, right):
    assert call("init", "mini", *MINI, *right)[0] == 0


def test_sizes_are_asked_again_at_a_terminal(typed, here):
    code, _, err = typed("3\n1.047,3.1416,5.236\n60,180,300\n29\n0.029\n0.125\n1450\n1.45\n", "init", "mini")
    assert code == 0
    assert err.count("if that is meant") == 3
    assert load_robot(here / "mini.toml").body.mass == 1.45


def test_the_reason_beside_a_guessed_motor_is_true_with_a_gear_that_is_known(call, here):
    """K l stays: behind a gear of 1 the guessed motor does not turn at 600 rad/s, but the robot at 1 m/s."""
    call("init", "mini", *MINI, "--gear-ratio", "1")
    call("init", "other", *MINI)
    known, guessed = (load_robot(here / f"{name}.toml") for name in ("mini", "other"))
    reason = "#   motor.emf_constant_Vs_rad: the robot reaches 1 m/s at the voltage limit\n"
    assert reason in (here / "mini.toml").read_text()
    assert "600 rad/s" not in (here / "mini.toml").read_text()
    assert "600 rad/s" in (here / "other.toml").read_text()
    assert known.motor.emf_constant == pytest.approx(guessed.motor.emf_constant * guessed.motor.gear_ratio, rel=0.01)


# ---- at a terminal ---------------------------------------------------------------------------------------


def test_it_asks_at_a_terminal(typed, here):
    code, out, err = typed("4\n\n0.06\n0.2\n10\n", "init", "asked")
    assert (code, out) == (0, "asked.toml\n")
    assert "how many wheels [3]: " in err
    assert "where the wheels stand, counter-clockwise from forward [degree] [45,135,225,315]: " in err
    assert "mass of the robot [kg] [3]: " in err
    robot = load_robot(here / "asked.toml")
    assert robot.wheels.azimuth_deg == (45.0, 135.0, 225.0, 315.0)
    assert (robot.wheels.wheel_radius, robot.wheels.robot_radius, robot.body.mass) == (0.06, 0.2, 10.0)
    assert robot.priors["wheels.azimuth_deg"] == Prior(source="default of omnidyn init, accepted")
    assert robot.priors["body.mass_kg"] == Prior(origin="given")


def test_enter_accepts_everything_and_a_default_is_no_measurement(typed, here):
    assert typed("\n\n\n\n\n", "init", "asked")[0] == 0
    robot = load_robot(here / "asked.toml")
    assert robot.wheels.azimuth_deg == (60.0, 180.0, 300.0)
    assert robot.priors["body.mass_kg"] == Prior(std=0.9, source="default of omnidyn init, accepted")


def test_places_accepted_beside_a_preset_with_other_wheels_are_not_given(typed, here):
    assert typed("4\n\n\n\n\n", "init", "asked", "--like", "robotino")[0] == 0
    robot = load_robot(here / "asked.toml")
    assert robot.wheels.azimuth_deg == (45.0, 135.0, 225.0, 315.0)
    assert robot.priors["wheels.azimuth_deg"] == Prior(source="default of omnidyn init, accepted")


def test_it_asks_only_for_what_is_missing(typed, here):
    code, _, err = typed("7\n", "init", "asked", *MINI[:-2])
    assert code == 0
    assert err.count("]: ") == 1
    assert load_robot(here / "asked.toml").body.mass == 7.0


def test_it_asks_again_after_a_bad_answer(typed, here):
    answers = "2\nmany\n3\n0,1\n0,0,0\n60,180,300\n0,04\n-1\n0.04\nnan\n0.1\n0\n1e400\n5\n"
    code, _, err = typed(answers, "init", "asked")
    assert code == 0
    for words in (
        "got 2; expected 3 to 16 wheels",
        "got many; expected 3 to 16 wheels",
        "got 0,1; expected 3 numbers",
        "cannot move the robot in every direction",
        "got 0,04; expected one number, such as 0.05",
        "got -1.0; expected greater than",
        "got nan; expected one number",
        "mass: cannot use this value; got 0.0",
        "got 1e400; expected one number",
    ):
        assert words in err
    assert load_robot(here / "asked.toml").body.mass == 5.0


def test_a_preset_is_what_stands_in_brackets(typed, here):
    code, _, err = typed("\n\n\n\n9\n", "init", "asked", "--like", "axebot")
    assert code == 0
    assert "[180,-60,60]: " in err
    assert "how many wheels" in err
    robot = load_robot(here / "asked.toml")
    assert robot.wheels == load_robot("axebot").wheels
    assert robot.priors["wheels.wheel_radius_m"].source == "like axebot"


def test_an_input_that_ends_is_refused(typed, here):
    code, out, err = typed("3\n", "init", "asked")
    assert (code, out) == (3, "")
    assert err.endswith("the input ended before all was answered; or give the numbers as options\n")
    assert os.listdir(here) == []


def test_ctrl_c_at_a_question(call, here, monkeypatch):
    class Impatient(Terminal):
        def readline(self, *_):
            raise KeyboardInterrupt

    monkeypatch.setattr("sys.stdin", Impatient())
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    assert call("init", "asked")[0] == 130
    assert os.listdir(here) == []


# ---- what it refuses -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["mini"], "--azimuth, --wheel-radius, --robot-radius, --mass missing"),
        (["mini", *MINI[:-2]], "--mass missing; without them it asks, but only at a terminal."),
        (["mini", "--mecanum", "--mass", "3"], "--wheel-radius, --robot-radius missing"),
        (["mini", "--mecanum", *MINI], "leave out the rest"),
        (["mini", "--mecanum", "--wheels", "3"], "leave out the rest"),
        (["mini", "--wheels", "4", *MINI], "--azimuth has 3 values for --wheels 4."),
        (["mini", "--wheels", "2"], "--wheels"),
        (["mini", "--wheels", "17"], "--wheels"),
        (["mini", "--wheels", "three"], "--wheels"),
        (["mini", "--mass", "heavy"], "--mass"),
        (["mini", *MINI, "--friction", "disc"], "--friction is direction or axes."),
        (["mini", "--like", "axebot", "--friction", "axes"], "--friction is for a guess"),
        (["mini", *MINI, "-o", "-", "--json"], "both want stdout"),
        ([], "Missing argument"),
    ],
)
def test_wrong_words_are_usage(call, here, arguments, words):
    code, out, err = call("init", *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.count("\n") == 1
    assert os.listdir(here) == []


@pytest.mark.parametrize(
    "arguments, words",
    [
        (["axebot", *MINI], "NAME: a preset has this name; got axebot; choose another one"),
        (["", *MINI], "NAME: cannot name a robot"),
        (["a/b", *MINI], "use --out for a file in another folder"),
        (["..", *MINI], "NAME: cannot name a robot"),
        (["a\nb", *MINI], "NAME: cannot name a robot"),
        (["x" * 61, *MINI], "a plain name of 1 to 60 letters"),
        (["mini", *MINI, "--out", "a\0b"], "--out: not a file name"),
        (["mini", *MINI, "--out", "none/mini.toml"], "mkdir -p none"),
        (["mini", *MINI, "--out", "."], "a folder"),
        (["mini", "--like", "axbot"], "no such robot; got axbot"),
        (["mini", *MINI, "--mass", "nan"], "mass: cannot use this value; got nan; expected a finite number"),
        (["mini", *MINI, "--mass", "-8"], "mass: cannot use this value; got -8.0; expected greater than"),
        (["mini", *MINI, "--mass", "1e400"], "got inf"),
        (["mini", *MINI, "--robot-radius", "0"], "robot_radius: cannot use this value; got 0.0; expected greater"),
        (["mini", *MINI, "--azimuth", "60,60,60"], "cannot move the robot in every direction"),
        (["mini", *MINI, "--azimuth", "60,180"], "--azimuth: .*; got 2 angles; expected 3 to 16, one per wheel"),
        (["mini", *MINI, "--azimuth", "60;180;300"], "--azimuth: not a list of numbers"),
        (["mini", *MINI, "--azimuth", "60,180,inf"], "--azimuth: not a list of numbers"),
        (["mini", *MINI, "--voltage-limit", "0"], "--voltage-limit: no motor .*; got 0 V; expected volts, 0.5"),
        (["mini", *MINI, "--voltage-limit", "-6"], "--voltage-limit: no motor .*; got -6 V; expected volts, 0.5"),
        (["mini", *MINI, "--voltage-limit", "1e-3"], "--voltage-limit: no motor turns at this voltage; got"),
        (["mini", *MINI, "--robot-radius", "0.1,0.1"], r"--robot-radius: wrong number .*expected 1, or one per wheel"),
        (["mini", *MINI, "--wheel-radius", "0.1,x"], "--wheel-radius: not a list of numbers"),
        (["mini", *MINI, "--speed-loop", "1,2"], "--speed-loop: not a speed loop; got 2 numbers"),
        (["mini", *MINI, "--speed-loop", "0"], "rate"),
    ],
)
def test_bad_values_are_refused(call, here, arguments, words):
    code, out, err = call("init", *arguments)
    assert (code, out) == (3, "")
    assert re.search(words, err)
    assert err.startswith("omnidyn: error: ")
    assert err.count("\n") == 1
    assert os.listdir(here) == []


def test_radii_of_each_wheel_and_the_loop_of_the_firmware(call, here):
    radii = ["--wheel-radius", "0.03,0.03,0.034", "--robot-radius", "0.11,0.11,0.14"]
    assert call("init", "uneven", *MINI, *radii, "--speed-loop", "0.5,3,100")[0] == 0
    robot = load_robot(here / "uneven.toml")
    assert robot.wheels.wheel_radius == (0.03, 0.03, 0.034)
    assert robot.wheels.robot_radius == (0.11, 0.11, 0.14)
    assert (robot.drive.kind, robot.drive.kp, robot.drive.ki, robot.drive.rate) == ("speed", 0.5, 3.0, 100.0)
    assert {robot.priors[f"drive.{key}"].origin for key in ("kp_V_s_rad", "ki_V_rad", "rate_Hz")} == {"given"}


def test_a_drive_that_takes_duties_and_its_supply(call, here):
    assert call("init", "pulsed", *MINI, "--supply", "11.1")[0] == 0
    robot = load_robot(here / "pulsed.toml")
    assert (robot.drive.kind, robot.drive.supply, robot.motor.voltage_limit) == ("duty", 11.1, 11.1)
    assert {robot.priors[key].origin for key in ("drive.supply_V", "motor.voltage_limit_V")} == {"given"}
    assert call("init", "less", *MINI, "--supply", "11.1", "--voltage-limit", "9")[0] == 0
    assert load_robot(here / "less.toml").motor.voltage_limit == 9.0


@pytest.mark.parametrize(
    ("more", "code", "words"),
    [
        (["--supply", "0"], 3, "--supply: no motor turns at this voltage; got 0 V"),
        (["--supply", "-5"], 3, "--supply: no motor turns at this voltage; got -5 V; expected volts, 0.5 to 1000"),
        (["--supply", "nan"], 3, "--supply: no motor turns at this voltage; got nan V"),
        (["--supply", "11800"], 3, "--supply: no motor turns at this voltage; got 11800 V"),  # mV
        (["--supply", "1e300"], 3, "--supply: no motor turns at this voltage; got 1e.300 V"),
        (["--voltage-limit", "1e300"], 3, "--voltage-limit: no motor turns at this voltage; got 1e.300 V"),
        (["--supply", "12", "--voltage-limit", "24"], 3, "no driver gives more than its supply; got 24 V of a supply"),
        (["--supply", "12", "--speed-loop", "100"], 2, "give one of them"),
        (["--supply", "12", "--like", "axebot"], 2, "--supply is for a guess"),
    ],
)
def test_a_supply_that_cannot_be(call, here, more, code, words):
    got, out, err = call("init", "mini", *MINI, *more)
    assert (got, out) == (code, "")
    assert re.search(words, err)


def test_gains_that_nobody_gave_are_guesses(call, here):
    assert call("init", "looped", *MINI, "--speed-loop", "100")[0] == 0
    robot = load_robot(here / "looped.toml")
    for key in ("drive.kp_V_s_rad", "drive.ki_V_rad"):
        assert (robot.priors[key].origin, robot.priors[key].std) == ("guess", Key.parse(key).get(robot))
    no_load = robot.motor.voltage_limit / (robot.motor.emf_constant * robot.motor.gear_ratio)
    assert 0.5 * no_load * robot.drive.kp == pytest.approx(robot.motor.voltage_limit, rel=0.01)


def test_an_existing_file_is_refused_before_any_question(typed, here):
    (here / "mini.toml").write_text("mine")
    code, _, err = typed("\n" * 9, "init", "mini")
    assert code == 3
    assert "the file exists already; use --force" in err
    assert "]: " not in err
    assert (here / "mini.toml").read_text() == "mine"
    assert typed("", "init", "mini", *MINI, "--force")[0] == 0
    assert load_robot(here / "mini.toml").name == "mini"


TEXT = st.text(max_size=12)
NUMBER = st.floats().map(repr) | st.integers().map(str) | TEXT
FLAGS = st.one_of(
    st.tuples(
        st.sampled_from(["--wheels", "--wheel-radius", "--robot-radius", "--mass", "--voltage-limit", "--supply"]),
        NUMBER,
    ),
    st.tuples(st.just("--azimuth"), st.lists(NUMBER, max_size=5).map(",".join) | TEXT),
    st.tuples(st.just("--like"), st.sampled_from(["axebot", "robotino", "four-wheel"]) | TEXT),
    st.tuples(st.just("--friction"), st.sampled_from(["axes", "direction"]) | TEXT),
    st.tuples(st.just("--speed-loop"), st.lists(NUMBER, max_size=4).map(",".join) | TEXT),
    st.sampled_from([("--mecanum",), ("--json",), ("--force",)]),
)


@given(st.lists(FLAGS, max_size=6), st.booleans(), TEXT | st.just("mini"))
def test_any_words_end_in_a_file_or_a_refusal(flags, whole, name):
    """Never a bug (1), never a traceback, never a file that does not load."""
    words = [*(MINI if whole else []), *(word for flag in flags for word in flag)]
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(["init", *words, "-o", "-", "--", name])
    assert code in (0, 2, 3), (code, words, err.getvalue())
    assert "Traceback" not in err.getvalue()
    if code == 0:
        assert parse_robot(out.getvalue()).priors


# ---- deadzone --map --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name, start", [("map.png", b"\x89PNG"), ("map.svg", b"<?xml")])
def test_a_map_of_the_dead_zone(call, here, name, start):
    code, out, err = call("deadzone", "robotino", "--map", name)
    assert code == 0
    assert "7.101 V x (-1, 0, 1)" in out
    assert f"omnidyn: wrote {name}\n" in err
    assert (here / name).read_bytes().startswith(start)
    code, _, err = call("deadzone", "robotino", "--map", name)
    assert code == 3
    assert "the file exists already" in err
    assert call("deadzone", "axebot", "--map", name, "--force", "--json")[0] == 0


@pytest.mark.parametrize(
    "name, words", [("map.jpg", "expected a name that ends in .png or .svg"), ("none/map.png", "mkdir -p none")]
)
def test_a_map_that_cannot_be_written_is_refused_first(call, here, monkeypatch, name, words):
    monkeypatch.setattr("omnidyn.model.robot_file.load_robot", None)  # would be a bug, exit 1
    code, out, err = call("deadzone", "axebot", "--map", name)
    assert (code, out) == (3, "")
    assert words in err


def test_a_current_limit_that_holds_the_robot_is_not_blamed_on_the_pattern(call, here):
    axebot = load_robot("axebot")
    weak = axebot.replace(name="weak", motor=axebot.motor.replace(current_limit=0.05))
    (here / "weak.toml").write_text(robot_to_toml(weak), encoding="utf-8")
    code, out, _ = call("deadzone", "weak.toml")
    assert code == 0
    assert "never   no voltage times (0, 1, -1) moves it" in out


def test_radii_may_differ_from_wheel_to_wheel(call, here):
    code, *_ = call(
        "init",
        "odd",
        "--azimuth",
        "60,180,300",
        "--wheel-radius",
        "0.03,0.03,0.034",
        "--robot-radius",
        "0.11,0.11,0.14",
        "--mass",
        "2.8",
    )
    assert code == 0
    robot = load_robot("odd.toml")
    assert robot.wheels.wheel_radius == (0.03, 0.03, 0.034)
    assert robot.wheels.robot_radius == (0.11, 0.11, 0.14)
    code, _, err = call(
        "init", "bad", "--azimuth", "60,180,300", "--wheel-radius", "3cm", "--robot-radius", "0.1", "--mass", "2.8"
    )
    assert code == 3
    assert "--wheel-radius: not a list of numbers; got 3cm" in err


@pytest.mark.parametrize("wheels", ["wheel_speed", "wheel_angle"])
def test_a_log_of_pose_and_wheels_shows_their_radius_too(call, here, wheels):
    """A pose at 20 Hz, wheels at 50 Hz, 3 ms apart: only the mass has to be given."""
    names = [f"{wheels[6] if wheels == 'wheel_angle' else 'w'}{k}" for k in (1, 2, 3)]
    true = plant(20.0)
    pose = Topic({name: true[name] for name in ("x", "y", "heading")}, 3e-3, 20.0)
    Logged.of([Topic({name: true[name] for name in names}), pose], 20.0).csv(here / "log.csv")
    code, out, err = call("init", "bot", "--log", "log.csv", "--mass", "10")
    assert (code, out) == (0, "bot.toml\n")
    assert f"from pose and {wheels}" in err
    assert "if the logged speeds are those of the wheels, behind the gear" in err
    robot = load_robot(here / "bot.toml")
    np.testing.assert_allclose(robot.wheels.azimuth_deg, (60.0, 180.0, 300.0), atol=0.5)
    assert robot.wheels.wheel_radius == pytest.approx(0.05, rel=0.01)
    assert robot.wheels.robot_radius == pytest.approx(0.2, rel=0.01)
    assert robot.priors["wheels.wheel_radius_m"].source == f"logs: pose and {wheels}"


# ---- counts at the motor, behind a gear --------------------------------------------------------------------

GEAR, TICKS, RADIUS, ARM = 5.0, 42, 0.0757, 0.36  # of a mecanum robot; ARM: half track + half wheelbase [m]


def mecanum_counts(path):
    """A drive of a mecanum robot: whole counts of its motors, and where it is. Rollers at 45 degrees, in an X.

    The law of textbooks, wheels forward positive: FL (vx - vy - A w)/r, FR (vx + vy + A w)/r, RL (vx + vy - A w)/r,
    RR (vx - vy + A w)/r; those on the left have a minus here, for a wheel counts counter-clockwise about the robot.
    """
    dt, turns, pose, rows = 1e-3, np.zeros(4), np.zeros(3), []
    for k in range(30_000):
        t = k * dt
        vx, vy, omega = 0.5 * np.sin(0.9 * t), 0.4 * np.sin(0.53 * t + 1.0), 0.7 * np.sin(0.37 * t)
        if k % 20 == 0:
            rows.append([t, *np.floor(turns * GEAR * TICKS), *pose])
        forward = np.array([vx - vy - ARM * omega, vx + vy + ARM * omega, vx + vy - ARM * omega, vx - vy + ARM * omega])
        turns += np.array([-1, 1, -1, 1]) * forward / RADIUS / (2.0 * np.pi) * dt
        c, s = np.cos(pose[2] + 0.5 * omega * dt), np.sin(pose[2] + 0.5 * omega * dt)
        pose += dt * np.array([c * vx - s * vy, s * vx + c * vy, omega])
    head = "t_s,a1,a2,a3,a4,x_m,y_m,heading_rad"
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.6f")


COUNTS = ("--mecanum", "--mass", "10", "--log", "log.csv", "--assume", "a=ticks/42@motor")


@pytest.fixture(scope="module")
def counts(tmp_path_factory):
    path = tmp_path_factory.mktemp("counts") / "log.csv"
    mecanum_counts(path)
    return path.read_bytes()


@pytest.fixture
def counted(here, counts):
    (here / "log.csv").write_bytes(counts)
    return here


def test_a_gear_that_is_given_stands_between_counts_at_the_motor_and_the_wheel(call, counted):
    """A radius of .0757 m was written as .0151 m, "measured"."""
    code, _, err = call("init", "bot", *COUNTS, "--gear-ratio", "5")
    assert code == 0
    assert "behind the gear of 5 that was given" in err
    assert "warning" not in err
    robot = load_robot(counted / "bot.toml")
    assert robot.wheels.wheel_radius == pytest.approx(RADIUS, rel=0.01)
    assert robot.wheels.robot_radius == pytest.approx(ARM, rel=0.01)
    assert robot.priors["wheels.wheel_radius_m"].origin == "measured"
    assert (robot.motor.gear_ratio, robot.priors["motor.gear_ratio"]) == (5.0, Prior(origin="given"))


def test_wheels_that_count_the_other_way_are_turned_and_said(call, counted):
    rows = np.loadtxt(counted / "log.csv", delimiter=",", skiprows=1) * [1, -1, 1, -1, 1, 1, 1, 1]
    head = "t_s,a1,a2,a3,a4,x_m,y_m,heading_rad"
    np.savetxt(counted / "log.csv", rows, delimiter=",", header=head, comments="", fmt="%.6f")
    code, _, err = call("init", "bot", *COUNTS, "--gear-ratio", "5")
    assert code == 0
    assert "wheels 1,3 count clockwise: turned; say --column a1=-NAME --column a3=-NAME elsewhere" in err
    robot = load_robot(counted / "bot.toml")
    assert robot.wheels.wheel_radius == pytest.approx(RADIUS, rel=0.01)
    assert robot.wheels.robot_radius == pytest.approx(ARM, rel=0.01)


def test_a_gear_beside_counts_of_nobody_knows_which_shaft_is_a_condition(call, counted):
    code, _, err = call("init", "bot", *COUNTS[:-1], "a=ticks/42", "--gear-ratio", "5")
    assert code == 0
    assert "if the logged speeds are those of the wheels, behind the gear; if they are those of the motors, add" in err


def test_without_a_gear_counts_at_the_motor_show_no_radius_but_with_one_they_show_the_gear(call, counted):
    code, _, err = call("init", "bot", *COUNTS)
    assert code == 2
    assert "without --gear-ratio the wheel radius is not in the logs" in err
    assert "--wheel-radius missing" in err
    code, _, err = call("init", "bot", *COUNTS, "--wheel-radius", "0.0757")
    assert code == 0
    robot = load_robot(counted / "bot.toml")
    assert robot.wheels.wheel_radius == 0.0757
    assert robot.motor.gear_ratio == pytest.approx(GEAR, rel=0.01)
    assert robot.priors["motor.gear_ratio"].origin == "measured"


@pytest.mark.parametrize(
    "unit, gear, radius, words",
    [
        ("ticks/42@motor", "5", "0.0757", ""),
        ("ticks/42", "5", "0.0757", ""),  # not said, and told by the gear
        ("ticks/210", "5", "0.0757", ""),  # of the wheel
        ("ticks/42@motor", "7", "0.0757", "logged speeds are 0.71"),
        ("ticks/42@motor", "5", "0.0379", "logged speeds are 0.5"),
        ("ticks/210@motor", "5", "0.0757", "logged speeds are 0.2"),
        ("ticks/42", "7", "0.0757", "expected 1, or 7 at the motor"),
    ],
)
def test_a_gear_that_logs_contradict_is_named_and_kept(call, counted, unit, gear, radius, words):
    known = ["--gear-ratio", gear, "--wheel-radius", radius]
    code, _, err = call("init", "bot", *COUNTS[:-1], f"a={unit}", *known)
    assert code == 0
    assert ("omnidyn: warning: " in err) == bool(words)
    assert words in err
    robot = load_robot(counted / "bot.toml")
    assert (robot.motor.gear_ratio, robot.wheels.wheel_radius) == (float(gear), float(radius))
    assert robot.priors["motor.gear_ratio"].origin == "given"
