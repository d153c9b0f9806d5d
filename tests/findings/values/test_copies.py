"""One accumulator in two columns is named, whatever was logged of the motors; wheels that turn alike are not blamed."""

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.log import Log


def copied(values, of=0, into=1):
    values = values.copy()
    values[:, into] = values[:, of]
    return values


@pytest.mark.parametrize("channel", ["wheel_speed", "current"])
def test_a_copied_column_is_an_error_and_no_slip(log, robot, with_channels, channel):
    for model in (robot, None):
        verdict = check(with_channels(**{channel: copied(log.channels[channel])}), model)
        (finding,) = verdict.of("equal")
        letter = channel[0] if channel == "wheel_speed" else "i"
        assert (finding.subject, finding.severity) == (f"{letter}1 {letter}2", "error")
        assert "equal to the last digit in every row" in str(finding)
        assert not {"slip", "swapped", "dead"} & {other.code for other in verdict.findings}


def test_a_copied_accumulator_is_one_too(log, robot, with_channels):
    counts = np.round(np.cumsum(log.channels["wheel_speed"], axis=0) * 0.01 * 2000 / (2 * np.pi)) * 2 * np.pi / 2000
    verdict = check(with_channels(wheel_angle=copied(counts, 2, 0), wheel_speed=None), robot)
    (finding,) = verdict.of("equal")
    assert (finding.subject, finding.severity) == ("a1 a3", "error")
    assert not verdict.of("slip")


def test_noise_alone_says_that_one_is_a_copy(log, with_channels):
    verdict = check(
        with_channels(wheel_speed=copied(log.channels["wheel_speed"]), voltage=None, current=None, twist=None)
    )
    (finding,) = verdict.of("equal")
    assert finding.numbers["reason"] == "noise"


def test_wheels_that_turn_alike_without_noise_are_a_note(log, with_channels):
    speed = np.round(5.0 * np.sin(0.01 * np.arange(len(log))), 1)[:, None] * [1.0, 1.0, -1.0]
    voltage = 0.4 * speed
    verdict = check(with_channels(wheel_speed=speed, voltage=voltage, current=None, twist=None, pose=None))
    assert {finding.severity for finding in verdict.of("equal")} == {"note"}


@pytest.mark.parametrize("noise", [0.002, 0.01])
def test_wheels_of_a_robot_that_spins_are_no_copies_beside_a_camera(robot, noise):
    """Wheels of a robot that turns in place turn alike; a camera of 60 Hz scatters, and shows no other motion."""
    t, rng = np.arange(500) * 0.01, np.random.default_rng(0)
    heading = 3.5 * (1.0 - np.cos(2.0 * np.pi * t / 5.0))
    tick, turns = 2.0 * np.pi / 2048, robot.wheels.robot_radius / robot.wheels.wheel_radius
    angle = np.repeat(np.round(turns * heading / tick)[:, None] * tick, 3, axis=1)
    pose = np.column_stack([np.zeros(len(t)), np.zeros(len(t)), heading]) + rng.normal(0.0, noise, (len(t), 3))
    pose[np.diff(np.floor(t * 60.0), prepend=-1.0) == 0.0] = np.nan
    voltage = np.repeat(np.sign(np.sin(t))[:, None], 3, axis=1)
    channels = {"voltage": voltage, "wheel_angle": angle, "pose": pose}
    verdict = check(Log(t, channels, np.arange(len(t)) + 2, source="spin.csv"), robot)
    assert {finding.severity for finding in verdict.of("equal")} == {"note"}


def test_wheels_that_friction_holds_may_get_different_voltages():
    """A robot that a push to the side does not move, and that then turns in place: its wheels turned alike."""
    t = np.arange(800) * 0.01
    spins = t >= 4.0
    volts = np.where(spins[:, None], 8.0 * np.sin(t)[:, None], [1.0, -2.0, 1.0])
    tick = 2.0 * np.pi / 2048
    angle = np.where(spins, np.round(10.0 * (np.cos(4.0) - np.cos(t)) / tick) * tick, 0.0)[:, None] * np.ones(3)
    log = Log(t, {"voltage": volts, "wheel_angle": angle}, np.arange(len(t)) + 2, source="held.csv")
    assert {finding.severity for finding in check(log).of("equal")} == {"note"}
    moved = Log(t, {"voltage": volts * [1.0, -1.0, 0.3], "wheel_angle": angle}, log.lines, source="copied.csv")
    assert "error" in {finding.severity for finding in check(moved).of("equal")}


@pytest.mark.parametrize("with_pose", [False, True])
def test_wheels_of_a_robot_that_spins_are_no_copies_beside_different_voltages(robot, with_pose):
    """Motors that differ turn it in place, and friction holds it where the rest of their push would drive it."""
    t, rng = np.arange(800) * 0.01, np.random.default_rng(3)
    tick, turns = 2.0 * np.pi / 360, robot.wheels.robot_radius / robot.wheels.wheel_radius
    heading = 3.5 * (1.0 - np.cos(2.0 * np.pi * t / 5.0))
    angle = np.floor(turns * heading / tick)[:, None] * tick * np.ones(3)
    voltage = np.sin(2.0 * np.pi * t / 5.0)[:, None] * [5.0, 6.5, 3.5]
    pose = np.column_stack([np.zeros((len(t), 2)), heading]) + rng.normal(0.0, 0.002, (len(t), 3))
    channels = {"voltage": voltage, "wheel_angle": angle} | ({"pose": pose} if with_pose else {})
    spun = Log(t, channels, np.arange(len(t)) + 2, source="spin.csv")
    assert {finding.severity for finding in check(spun, robot).of("equal")} == {"note"}


def test_one_counter_in_all_columns_of_a_robot_that_drives_about_is_an_error(log, robot, with_channels):
    speed = log.channels["wheel_speed"][:, :1] * np.ones(3)
    voltage = log.channels["voltage"]
    volts = voltage - 0.5 * voltage.mean(axis=1, keepdims=True)  # less of it turns the robot in place
    verdict = check(with_channels(wheel_speed=speed, voltage=volts, pose=None, twist=None, current=None), robot)
    assert [finding.severity for finding in verdict.of("equal")] == ["error"] * 3
    assert {finding.numbers["reason"] for finding in verdict.of("equal")} == {"voltage"}


def test_a_clean_log_has_no_copies(log, robot):
    assert not check(log, robot).of("equal")
