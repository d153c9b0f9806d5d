"""Limits, supply, currents without sign, energy, what became of commands, and what is excited."""

import numpy as np
import pytest

from omnidyn import Run, load_robot, simulate
from omnidyn import check as check_run
from omnidyn.findings.check import check, check_blocks
from omnidyn.logs.log import Log
from omnidyn.model.robot import Prior
from tests.support.axebot_logs import excitation


def test_saturation_and_its_share(log, robot, with_channels):
    voltage = log.channels["voltage"].copy()
    voltage[500:540, 1] = 6.0  # the limit of the AxeBot
    (finding,) = check(with_channels(voltage=voltage, current=None), robot).of("saturation")
    assert finding.subject == "u2"
    assert finding.rows == ((502, 541),)
    assert finding.numbers["share"] == pytest.approx(40 / len(log))


def test_full_duty_needs_no_robot(log, with_channels):
    duty = log.channels["voltage"] / 6.0
    duty[100:150, 0] = -1.0
    (finding,) = check(with_channels(voltage=None, duty=duty)).of("saturation")
    assert finding.subject == "d1"


def test_a_battery_that_sags(log, robot, with_channels):
    rng = np.random.default_rng(0)
    supply = 12.0 + 0.02 * rng.normal(size=len(log))
    assert not check(with_channels(supply=supply), robot).of("sag")
    supply[900:1000] *= 0.94
    (finding,) = check(with_channels(supply=supply), robot).of("sag")
    assert finding.numbers["drop"] == pytest.approx(0.06, abs=0.01)
    ((first, last),) = finding.rows
    assert abs(first - 902) < 12
    assert abs(last - 1001) < 12


def test_a_duty_without_a_supply_is_noted(log, with_channels):
    assert check(with_channels(voltage=None, duty=log.channels["voltage"] / 6.0)).of("no_supply")


def test_currents_without_a_sign(log, robot, with_channels, grave):
    verdict = check(with_channels(current=np.abs(log.channels["current"])), robot)
    assert verdict.of("unsigned")[0].severity == "error"
    assert "inverted" not in grave(verdict)


def test_a_robot_that_never_moved(robot):
    n, rng = 1000, np.random.default_rng(0)
    voltage = np.tile([0.0, 0.3, -0.3], (n, 1))
    channels = {
        "voltage": voltage,
        "wheel_speed": np.zeros((n, 3)),
        "current": voltage / 1.69 + 0.01 * rng.normal(size=(n, 3)),
    }
    verdict = check(Log(np.arange(n) * 0.01, channels, np.arange(n) + 2), robot)
    assert verdict.of("never_moved")[0].severity == "error"
    assert not verdict.of("blocked")


def test_a_robot_that_stands_still_is_not_in_motion():
    """Noise is no motion, and what rounding leaves of a constant is no step of a sensor."""
    n = 1000
    t, lines = np.arange(n) * 0.02, np.arange(n) + 2
    for seed in range(6):
        rng = np.random.default_rng(seed)
        noise = {"wheel_speed": 0.05 * rng.normal(size=(n, 4)), "pose": 0.001 * rng.normal(size=(n, 3))}
        verdict = check(Log(t, noise, lines))
        assert verdict.of("never_moved")
        assert verdict.excitation["moving"] == 0.0
    left = 5.7e-14 * rng.integers(-1, 2, (n, 4))
    verdict = check(Log(t, {"wheel_speed": left, "pose": np.zeros((n, 3))}, lines))
    assert verdict.of("never_moved")
    assert not verdict.of("quantised")


def test_a_blocked_robot(log, robot, with_channels):
    names = ("voltage", "wheel_speed", "twist", "current")
    voltage, speed, twist, current = (log.channels[name].copy() for name in names)
    held = slice(800, 950)
    voltage[held] = [0.0, 4.0, -4.0]
    speed[held], twist[held] = 0.0, 0.0
    current[held] = voltage[held] / 1.69
    verdict = check(with_channels(voltage=voltage, wheel_speed=speed, twist=twist, current=current, pose=None), robot)
    (finding,) = verdict.of("blocked")
    ((first, last),) = finding.rows
    assert abs(first - 802) < 12
    assert abs(last - 951) < 12


def test_a_dead_zone_is_no_blockade(log, robot, with_channels):
    voltage, speed, twist = (log.channels[name].copy() for name in ("voltage", "wheel_speed", "twist"))
    voltage[800:950] = [0.0, 0.5, -0.5]  # breakaway is at 0.8 V
    speed[800:950], twist[800:950] = 0.0, 0.0
    verdict = check(with_channels(voltage=voltage, wheel_speed=speed, twist=twist, current=None, pose=None), robot)
    assert not verdict.of("blocked")


def test_a_speed_that_is_not_reached(with_channels, log):
    rng = np.random.default_rng(0)
    command = np.repeat(rng.uniform(-10.0, 10.0, size=(20, 3)), 100, axis=0)
    speed = 0.86 * command + 0.2 * rng.normal(size=command.shape)
    droop = Log(np.arange(2000) * 0.01, {"wheel_speed_command": command, "wheel_speed": speed}, np.arange(2000) + 2)
    (finding,) = check(droop).of("droop")
    assert finding.numbers["ratio"] == pytest.approx(0.86, abs=0.005)


def test_what_a_straight_run_cannot_tell(robot):
    n, rng = 1500, np.random.default_rng(0)
    twist = np.column_stack([np.full(n, 0.5), np.zeros(n), np.zeros(n)]) + 0.005 * rng.normal(size=(n, 3))
    verdict = check(Log(np.arange(n) * 0.01, {"twist": twist}, np.arange(n) + 2), robot)
    assert {finding.subject for finding in verdict.of("not_excited")} == {"y", "yaw"}
    assert [finding.subject for finding in verdict.of("one_way")] == ["x"]
    assert verdict.of("one_speed")
    assert verdict.excitation["x"] == pytest.approx(0.5, rel=0.01)
    assert verdict.excitation["directions"] == 1


def test_excitation_of_blocks_is_that_of_the_whole(log, robot):
    whole = check(log, robot)
    parts = check_blocks((log.rows(slice(k, k + 500)) for k in range(0, len(log), 500)), robot)
    assert parts.excitation["x"] == pytest.approx(whole.excitation["x"], rel=0.15)
    assert parts.excitation["time_s"] == pytest.approx(whole.excitation["time_s"], rel=0.01)
    assert not [finding for finding in parts.findings if finding.severity != "note"]


def test_a_fault_in_one_block_is_found_with_its_lines(log, robot, with_channels):
    speed = log.channels["wheel_speed"].copy()
    speed[:, [0, 1]] = speed[:, [1, 0]]
    broken = with_channels(wheel_speed=speed)
    (finding,) = check_blocks((broken.rows(slice(k, k + 500)) for k in range(0, len(log), 500)), robot).of("swapped")
    assert finding.subject == "w1 w2"
    assert "blocks of the log" in str(finding)


def test_guesses_of_a_robot_file_are_no_evidence_against_a_log(log, robot):
    """The back-EMF of a made-up motor is above the voltage: fatal for a data sheet, a hint for a guess."""
    strong = robot.replace(motor=robot.motor.replace(emf_constant=2.0 * robot.motor.emf_constant))
    (finding,) = check(log, strong).of("energy")
    assert finding.severity == "error"
    guess = strong.replace(priors={"motor.emf_constant_Vs_rad": Prior(origin="guess")})
    (finding,) = check(log, guess).of("energy")
    assert finding.severity == "warning"
    assert "motor.emf_constant_Vs_rad of the robot file is only guessed" in str(finding)


@pytest.mark.parametrize("late", [0.1, 0.2, 0.5])
def test_the_latency_that_a_robot_file_says_takes_no_energy(late):
    """A voltage that acts later brakes later; with a latency that the file has not, the rows are impossible."""
    robot = load_robot("axebot")
    run = simulate(robot, excitation(20.0, seed=1), 0.01)
    noise = np.random.default_rng(0).standard_normal(run.twist.shape) * 0.01
    twist = np.roll(run.twist, round(late / 0.01), axis=0) + noise
    log = Run(t=run.t, voltage=run.voltage, twist=twist)
    later = robot.replace(drive=robot.drive.replace(latency=late))
    assert not [finding for finding in check_run(log, later).findings if finding.severity == "error"]
    (finding,) = (f for f in check_run(log, robot).findings if f.severity == "error")
    assert finding.code == "energy"
    assert "how late a voltage acts" in finding.remedy_text


def test_an_input_that_outruns_the_rows(log, with_channels):
    voltage = log.channels["voltage"].copy()
    half = len(log) // 2
    voltage[half:, 0] = 3.0 * (-1.0) ** np.arange(len(log) - half)
    (finding,) = check(with_channels(voltage=voltage)).of("too_fast")
    assert finding.subject == "u1"
    assert finding.numbers["share"] == pytest.approx(0.5, abs=0.05)
    assert not check(log).of("too_fast")


# Whether the robot moves at all, behind noise and beside columns that were guessed


def slow_motion(noise, speed=12.0, rate=1000.0, seconds=8.0, seed=0, **more):
    rng, n = np.random.default_rng(seed), round(rate * seconds)
    t = np.arange(n) / rate
    turning = np.where((t > 2.0) & (t < 5.0), speed, 0.0)
    channels = {"wheel_speed": turning[:, None] + noise * rng.normal(size=(n, 1)), "duty": 0.3 * (turning > 0)[:, None]}
    return Log(t, channels | {name: values(t) for name, values in more.items()}, np.arange(n) + 2)


@pytest.mark.parametrize("seed", range(3))
def test_a_motion_behind_noise_is_one(seed):
    """65 rad/s of noise around 12: plain in a mean over 1.5 s."""
    assert not check(slow_motion(65.0, seed=seed)).of("never_moved")
    assert not check(slow_motion(65.0, -12.0, seed=seed)).of("never_moved")


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("noise", [0.5, 65.0])
def test_noise_alone_is_no_motion(noise, seed):
    assert check(slow_motion(noise, 0.0, seed=seed)).of("never_moved")


def test_an_encoder_that_flickers_between_two_counts_is_at_rest():
    rng, n = np.random.default_rng(0), 4000
    flicker = np.diff(rng.integers(0, 2, n + 1)) * 40.0
    assert check(Log(np.arange(n) * 1e-3, {"wheel_speed": flicker[:, None]}, np.arange(n) + 2)).of("never_moved")


def test_a_pose_that_moves_is_a_robot_that_moves():
    """A force of 0 to 5 N that was guessed as the angle of a wheel hardly turns it."""
    log = slow_motion(0.5, 0.0, pose=lambda t: np.column_stack([0.2 * t, np.sin(t), 0.0 * t]))
    assert not check(log).of("never_moved")
    resting = slow_motion(
        0.5, 0.0, pose=lambda t: 0.002 * np.random.default_rng(0).normal(size=(len(t), 3)) + [1.0, 2.0, 0.5]
    )
    assert check(resting).of("never_moved")
