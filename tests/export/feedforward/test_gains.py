"""kS, kV, kA: what they say is what the robot does, by WPILib's own feed-forward; standard errors by drawing."""

import csv
import io
import re
import runpy
import shutil
import subprocess

import numpy as np
import pytest

import omnidyn
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.export.feedforward.gains import axis_gains, gains
from omnidyn.export.feedforward.gains_csv import gains_csv
from omnidyn.export.feedforward.road_runner import road_runner
from omnidyn.export.feedforward.wpilib import wpilib
from omnidyn.model.deadzone import axis_patterns
from omnidyn.model.first_guess import first_guess
from omnidyn.model.keys import Key
from omnidyn.model.known.told import with_correlation
from omnidyn.model.motor import no_load_speed
from omnidyn.model.robot import Prior
from omnidyn.model.wheels import wheel_speed
from tests.support.exported import exact_robot

ROBOT = omnidyn.load_robot("axebot")


def test_the_numbers_of_the_paper():
    """Table 3 by hand: p = l K_t/(R r) x 2 sin 60 [N/V] along x; D = 2.2 ... ; no other source."""
    push = 19 * 0.0059 / (1.69 * 0.035) * np.array([2 * 0.75**0.5, 1.5, 0.3])
    emf = (19 * 0.0059) ** 2 / (1.69 * 0.035**2) * np.array([1.5, 1.5, 0.03])
    expected = np.array([[2.2, 1.5, 0.099], np.array([0.94, 0.96, 0.01]) + emf, [1.5, 1.5, 0.025]]).T / push[:, None]
    np.testing.assert_allclose(axis_gains(ROBOT), expected, rtol=1e-12)


@pytest.mark.parametrize("robot", [ROBOT, *(exact_robot(seed) for seed in (0, 1, 4, 5, 6, 8))], ids=lambda r: r.name)
@pytest.mark.parametrize("axis", range(3))
def test_wpilib_drives_the_robot_from_speed_to_speed(robot, axis):
    """What SimpleMotorFeedforward asks for to get from v to v + dv in a period does just that."""
    controller = pytest.importorskip("wpimath.controller")
    dt, pattern = 0.02, axis_patterns(robot)[axis]
    found = gains(robot)
    feedforward = controller.SimpleMotorFeedforwardMeters(*found.value[axis].tolist(), dt)
    top = (6.0 - found.value[axis, 0]) / found.value[axis, 1]
    for v, goal in ((0.3, 0.3), (0.3, 0.32), (0.5, 0.45), (-0.4, -0.41)):
        volts = feedforward.calculate(v * top, goal * top)
        start = np.zeros(3)
        start[axis] = v * top
        run = omnidyn.simulate(robot, [pattern * volts], dt, twist=start)
        assert run.twist is not None
        expected = np.zeros(3)
        expected[axis] = goal * top
        np.testing.assert_allclose(run.twist[-1], expected, rtol=0, atol=1e-9 * top)


@pytest.mark.parametrize("name", ["robotino", "mecanum"])
@pytest.mark.parametrize("axis", range(3))
def test_other_shapes_of_friction_settle_where_the_gains_say(name, axis):
    robot = omnidyn.load_robot(name)
    pattern, (ks, kv, _) = axis_patterns(robot)[axis], axis_gains(robot)[axis]
    u = 0.8 * float(np.max(robot.motor.voltage_limit))
    run = omnidyn.simulate(robot.replace(drive=type(robot.drive)()), np.tile(u * pattern, (400, 1)), 0.02)
    if (u - ks) / kv > 0 and robot.motor.current_limit is None:
        assert run.twist is not None
        assert run.twist[-1, axis] == pytest.approx((u - ks) / kv, rel=2e-3)


def test_a_wheel_alone_gets_the_volts_that_the_axes_give_it():
    found, v = gains(ROBOT), np.array([0.7, -0.4, 3.0])
    for axis in range(3):
        volts = found.pattern[axis] * (found.value[axis, 0] * np.sign(v[axis]) + found.value[axis, 1] * v[axis])
        w = ROBOT.wheels.wrench_matrix[axis] * v[axis] / 0.035
        own = found.wheel[axis, :, 0] * np.sign(w) + found.wheel[axis, :, 1] * w
        turning = np.isfinite(own)
        np.testing.assert_allclose(own[turning], volts[turning], rtol=1e-12)
        assert not volts[~turning].any()
        # At no load the back-EMF is all there is.
        assert np.nanmax(found.wheel[axis, :, 1]) > 1.0 / no_load_speed(ROBOT.motor, np.ones(3)).max()


def known():
    stds = {"friction.axes.coulomb[0]": 0.1, "friction.axes.viscous[0]": 0.1, "body.mass_kg": 0.05}
    robot = ROBOT.replace(priors={key: Prior(std=std, origin="measured") for key, std in stds.items()})
    return with_correlation(robot, ["friction.axes.coulomb[0]", "friction.axes.viscous[0]"], [[1.0, -0.8], [-0.8, 1.0]])


def test_standard_errors_are_those_of_drawn_robots():
    robot, rng = known(), np.random.default_rng(3)
    found = gains(robot).std
    keys = ["friction.axes.coulomb[0]", "friction.axes.viscous[0]", "body.mass_kg"]
    cov = np.array([[0.01, -0.008, 0], [-0.008, 0.01, 0], [0, 0, 0.0025]])
    draws = []
    for change in rng.multivariate_normal(np.zeros(3), cov, 2000):
        one = robot
        for key, step in zip(keys, change, strict=True):
            one = Key.parse(key).set(one, Key.parse(key).get(robot) + step, checked=False)
        draws.append(axis_gains(one))
    np.testing.assert_allclose(np.std(draws, axis=0), found, rtol=0.06, atol=1e-12)
    assert np.isnan(gains(ROBOT).std).all()


def test_the_snippets_hold_the_same_numbers(tmp_path):
    robot = known()
    found = gains(robot)
    wpilib(robot).write(tmp_path / "w")
    python = runpy.run_path(str(tmp_path / "w" / "robot_gains.py"))
    assert python["X_KS"] == found.value[0, 0]
    assert python["WHEEL2_ON_YAW_KV"] == found.wheel[2, 1, 1]
    np.testing.assert_array_equal(python["PATTERN"], found.pattern)
    table = [line for line in gains_csv(robot).text.splitlines() if not line.startswith("#")]
    read = {(row["place"], row["gain"]): row for row in csv.DictReader(io.StringIO("\n".join(table)))}
    assert float(read["x", "kS"]["value"]) == found.value[0, 0]
    assert float(read["x", "kS"]["std"]) == found.std[0, 0]
    assert read["x", "kA"]["unit"] == "V s^2/m"
    road = road_runner(robot).text
    assert f"public double kV = {float(found.value[0, 1]) * 0.0254!r}; // +-" in road


@pytest.mark.parametrize("name", ["axebot", '*/ "x" \\', "\u202eevil??/"])
def test_java_and_cpp_compile(tmp_path, name):
    wpilib(ROBOT.replace(name=name)).write(tmp_path / "w")
    folder = tmp_path / "w"
    if shutil.which("g++"):
        (folder / "use.cpp").write_text('#include "robot_gains.h"\nstatic_assert(robot_gains::X_KS > 0.0);')
        subprocess.run(
            ["g++", "-std=c++17", "-Wall", "-Wextra", "-Werror", "-fsyntax-only", "use.cpp"], cwd=folder, check=True
        )
    if shutil.which("javac") and name == "axebot":  # seconds
        subprocess.run(["javac", "-encoding", "UTF-8", "RobotGains.java"], cwd=folder, check=True)


@pytest.mark.parametrize("name", ["mecanum", "four-wheel"])
def test_per_tick_they_are_what_road_runner_drives_with(name):
    """Its MecanumKinematics (inverse, version 1.0) and MotorFeedforward, on our simulation, which settles there."""
    robot, n = omnidyn.load_robot(name), 537.7
    twist = np.array([0.4, -0.3, 2.0])
    if name == "four-wheel":
        azimuth = (45.0, -45.0, 135.0, -135.0)  # of an X-drive: front left, front right, rear left, rear right
        robot = robot.replace(wheels=robot.wheels.replace(azimuth_deg=azimuth))
    text = road_runner(robot, ticks_per_turn=n).text
    found = {key: float(value) for key, value in re.findall(r"public double (\w+) = ([^;]+);", text)}
    lateral = found["inPerTick"] / found["lateralInPerTick"]
    track = found["inPerTick"] * found["trackWidthTicks"]
    x, y, turn = twist[0] / 0.0254, twist[1] / 0.0254 * lateral, twist[2] * track  # inches
    wheels = np.array([x - y - turn, x + y + turn, x + y - turn, x - y + turn])  # left front, right, left rear, right
    forward = np.array([-1.0, 1.0, -1.0, 1.0])  # a motor that drives forward, in our sense
    ticks = wheel_speed(robot.wheels, twist) * forward * n / (2.0 * np.pi)
    np.testing.assert_allclose(wheels / found["inPerTick"], ticks, rtol=1e-12)
    rate = 0.4 / 0.0254 / found["inPerTick"]
    volts = (found["kS"] + found["kV"] * rate) * forward
    run = omnidyn.simulate(robot, np.tile(volts, (400, 1)), 0.02)
    np.testing.assert_allclose(run.twist[-1], [0.4, 0.0, 0.0], atol=1e-3)
    first = omnidyn.simulate(
        robot, [volts + found["kA"] * forward * 10.0 / 0.0254 / found["inPerTick"]], 1e-5, twist=run.twist[-1]
    )
    assert (first.twist[-1, 0] - 0.4) / 1e-5 == pytest.approx(10.0, rel=1e-3)


def test_gains_of_wheels_per_tick():
    per_rad, per_tick = (list(csv.DictReader(gains_csv(ROBOT, n).text.splitlines()[1:])) for n in (None, 360.0))
    for row, other in zip(per_rad, per_tick, strict=True):
        in_ticks = row["place"].startswith("wheel") and row["gain"] != "kS"
        assert float(other["value"]) == pytest.approx(float(row["value"]) * (np.pi / 180.0 if in_ticks else 1.0))
        assert other["unit"] == (row["unit"].replace("rad", "tick") if in_ticks else row["unit"])
    with pytest.raises(InputError, match="not a number of ticks in a turn of a wheel; got 0"):
        gains_csv(ROBOT, 0.0)
    with pytest.raises(UnsupportedError, match=r"do not turn alike.*got 3 wheels.*gains of each wheel"):
        road_runner(ROBOT, ticks_per_turn=360.0)


@pytest.mark.parametrize("make", [wpilib, road_runner])
def test_a_robot_whose_friction_is_a_guess_is_refused(make):
    wheels = omnidyn.load_robot("mecanum").wheels
    robot = first_guess("new", wheels, 7.5)
    with pytest.raises(InputError, match=r"gains are guesses.*coulomb.*omnidyn identify.*`force_guess`"):
        make(robot)
    made = make(robot, force_guess=True)
    assert all("GUESSES, not measured" in text.partition("kS = ")[0] for text in made.files.values())
    assert "GUESSES" in made.notes[0]
    friction = {key: Prior(std=0.1, origin="identified") for key in robot.priors if key.startswith("friction.")}
    fitted = robot.replace(priors={**robot.priors, **friction})
    assert not any("GUESSES" in text for text in make(fitted).files.values())


def test_what_gains_cannot_say_is_said():
    robot = omnidyn.load_robot("robotino")
    made = wpilib(robot, force_guess=True)
    assert made.missing
    for words in made.missing:
        assert all(words in text for text in made.files.values())
