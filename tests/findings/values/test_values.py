"""Dead, stuck, quantised, spiky and missing channels."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from omnidyn import load_robot, simulate
from omnidyn.findings.check import check
from omnidyn.findings.signal.robust import quantum, white_noise
from omnidyn.logs.log import Log


def test_a_clean_log_says_nothing_above_a_note(log, robot, grave):
    assert grave(check(log, robot)) == set()
    assert grave(check(log)) == set()


@pytest.mark.parametrize("channel, letter", [("wheel_speed", "w"), ("current", "i")])
def test_a_flat_line_is_dead(log, robot, with_channels, grave, channel, letter):
    values = log.channels[channel].copy()
    values[:, 1] = 0.0
    verdict = check(with_channels(**{channel: values}), robot)
    assert [finding.subject for finding in verdict.of("dead")] == [f"{letter}2"]
    assert grave(verdict) == {"dead"}


def test_a_current_that_was_given_no_sign_is_not_dead(log, robot, with_channels, grave):
    """Unsigned currents get 0 for a sign where a wheel is commanded to stand, as one is in each main direction."""
    command, current = log.channels["wheel_speed"].copy(), np.abs(log.channels["current"])
    command[:, 1] = 0.0
    signed = replace(
        with_channels(wheel_speed_command=command, current=current * np.sign(command)), current_unsigned=True
    )
    assert check(signed, robot).of("dead") == ()
    dead = replace(
        with_channels(wheel_speed_command=log.channels["wheel_speed"], current=current * np.sign(command)),
        current_unsigned=True,
    )
    assert [finding.subject for finding in check(dead, robot).of("dead")] == ["i2"]


def test_a_sensor_that_is_noise_only_is_dead(log, robot, with_channels, grave):
    values = log.channels["wheel_speed"].copy()
    values[:, 2] = 0.3 * np.random.default_rng(0).normal(size=len(values))
    verdict = check(with_channels(wheel_speed=values), robot)
    assert [finding.subject for finding in verdict.of("dead")] == ["w3"]
    assert grave(verdict) == {"dead"}


def test_a_wheel_that_should_stand_is_not_dead(log, robot, with_channels):
    # Straight ahead, wheel 1 of the AxeBot has nothing to do: sin 180 deg is 0.
    from tests.support.pushed_logs import clean_log

    straight = clean_log(robot, seed=3)
    n = len(straight)
    zero = np.zeros(n)
    speed = np.abs(np.sin(straight.t))
    twist = np.column_stack([speed, zero, zero])
    from omnidyn.model.wheels import wheel_speed

    rng = np.random.default_rng(0)
    turning = wheel_speed(robot.wheels, twist)
    turning[:, 1:] += 0.05 * rng.normal(size=(n, 2))
    broken = with_channels(straight, twist=twist, wheel_speed=turning, voltage=None, current=None, pose=None)
    assert not check(broken, robot).of("dead")


def test_a_stuck_encoder_is_found_with_its_rows(log, robot, with_channels, grave):
    values = log.channels["wheel_speed"].copy()
    start = 700 + int(np.argmax(np.abs(values[700:800, 0])))
    values[start : start + 90, 0] = values[start, 0]
    verdict = check(with_channels(wheel_speed=values), robot)
    (finding,) = verdict.of("stuck")
    assert finding.subject == "w1"
    assert finding.rows == ((start + 2, start + 91),)
    assert grave(verdict) == {"stuck"}
    assert check(with_channels(wheel_speed=values)).of("stuck")  # chance alone, without a robot


def test_rest_is_not_stuck(log, robot, with_channels):
    channels = {name: values.copy() for name, values in log.channels.items()}
    channels["wheel_speed"][:50] = 0.0  # the half second at rest, as an encoder gives it
    assert not check(with_channels(**channels), robot).of("stuck")


@pytest.mark.parametrize("step", [0.05, 0.5, 2.38])
def test_the_step_of_a_sensor(step):
    rng = np.random.default_rng(0)
    values = np.round((20.0 * np.sin(np.arange(3000) / 50) + rng.normal(size=3000)) / step) * step
    assert quantum(values) == pytest.approx(step)
    rounded = np.round(values + 1e-4 * rng.integers(-1, 2, size=3000), 4)  # printed with four digits
    assert quantum(rounded) == pytest.approx(step, rel=1e-3)


def test_a_continuous_channel_has_no_step():
    assert quantum(np.random.default_rng(0).normal(size=5000)) == 0.0


def test_noise_is_told_from_motion():
    t = np.arange(20000) * 0.01
    noisy = 5.0 * np.sin(t) + 0.1 * np.random.default_rng(0).normal(size=len(t))
    assert white_noise(noisy) == pytest.approx(0.1, rel=0.03)


def test_single_wild_values_are_spikes(log, robot, with_channels, grave):
    values = log.channels["wheel_speed"].copy()
    values[[333, 1444], 1] = 400.0, -381.0
    (finding,) = check(with_channels(wheel_speed=values), robot).of("spike")
    assert (finding.subject, finding.count) == ("w2", 2)
    assert finding.rows == ((335, 335), (1446, 1446))
    assert finding.numbers["farthest"] == 400.0
    assert grave(check(with_channels(wheel_speed=values), robot)) == {"spike"}


def test_missing_values_are_counted(log, robot, with_channels):
    values = log.channels["current"].copy()
    values[100:150, 0] = np.nan
    (finding,) = check(with_channels(current=values), robot).of("missing")
    assert (finding.severity, finding.subject, finding.count) == ("note", "i1", 50)


def test_components_that_miss_the_same_rows_are_one_finding(log, with_channels):
    values = log.channels["wheel_speed"].copy()
    values[100:150] = np.nan
    values[300:310, 2] = np.nan
    both, third = sorted(check(with_channels(wheel_speed=values)).of("missing"), key=lambda one: one.count)
    assert (both.subject, both.count, third.subject, third.count) == ("w1 w2", 50, "w3", 60)
    assert "of w1 and w2 are missing" in str(both)
    assert "of w3 is missing" in str(third)


def test_a_sensor_that_is_out_for_long_is_missing_and_no_other_fault(log, robot, with_channels, grave):
    """A line across 27 % of the rows was taken for a speed, and its energy for impossible."""
    values = log.channels["wheel_speed"].copy()
    out = slice(len(log) // 3, len(log) // 3 + round(0.27 * len(log)))
    values[out, 1] = np.nan
    broken = with_channels(wheel_speed=values)
    (finding,) = check(broken, robot).of("missing")
    assert (finding.subject, finding.count) == ("w2", out.stop - out.start)
    assert grave(check(broken, robot)) == {"missing"}


@pytest.mark.parametrize("missing", [None, 0, 1])
def test_a_slow_wheel_that_reads_zero(robot, log, with_channels, missing):
    """Against its own command, whichever other wheel was not logged."""
    command = np.tile([3.0, 3.0, 0.2], (len(log), 1))
    rng = np.random.default_rng(0)
    speed = np.round((0.9 * command + 0.2 * rng.normal(size=command.shape)) / 0.5) * 0.5
    if missing is not None:
        speed[:, missing] = np.nan
    others = dict.fromkeys(("voltage", "current", "twist", "pose"))
    broken = with_channels(wheel_speed_command=command, wheel_speed=speed, **others)
    (finding,) = check(broken).of("reads_zero")
    assert finding.subject == "w3"
    assert finding.numbers["step"] == pytest.approx(0.5)


def test_kicks_of_a_current_recorded_now_and_then_are_no_spikes():
    """Currents five times rarer than the rest, a kick of 30 ms after every command: seen once or never."""
    robot = load_robot("axebot")
    levels = np.random.default_rng(3).uniform(-5.0, 5.0, (25, 3)).repeat(100, axis=0)
    run = simulate(robot, levels, 0.01)
    current = np.full((len(run), 3), np.nan)
    current[::5] = run.current[::5] + 0.01 * np.random.default_rng(4).normal(size=run.current[::5].shape)
    log = Log(run.t, {"voltage": run.voltage, "current": current}, np.arange(len(run)) + 2)
    assert not check(log, robot).of("spike")
    current[250, 1] += 40.0 * np.nanstd(current[:, 1])
    (finding,) = check(log, robot).of("spike")
    assert (finding.subject, finding.rows) == ("i2", ((252, 252),))


def _wheels(rng, seconds):
    """Times, drives and speeds of three wheels that follow them."""
    t = np.arange(0.0, seconds, 0.02)
    drive = np.repeat(rng.uniform(-1.0, 1.0, (len(t) // 40 + 1, 3)), 40, axis=0)[: len(t)]
    return t, drive, _following(drive)


def _following(drive):
    """Each wheel is driven by all motors, through the floor."""
    return np.asarray(lfilter([0.15], [1.0, -0.85], 10.0 * drive @ (np.eye(3) - 0.25), axis=0))


def _recorded(t, drive, speed):
    return Log(t, {"voltage": 12.0 * drive, "wheel_speed": speed}, np.arange(len(t)) + 2)


def test_a_wheel_that_its_voltage_leaves_is_stuck_and_its_neighbours_are_not():
    """Steps so coarse that repeats are nothing special: only what drives the wheels can tell."""
    rng = np.random.default_rng(5)
    t, drive, speed = _wheels(rng, 30.0)
    coarse = np.round(speed / 0.8) * 0.8
    assert not check(_recorded(t, drive, coarse)).of("stuck")
    moved = [a for a in range(400, 1000) if abs(speed[a + 15, 1] - speed[a, 1]) > 6.0 and coarse[a, 1] != 0.0]
    for a in moved[::40]:
        broken = coarse.copy()
        broken[a : a + 25, 1] = broken[a, 1]  # half a second
        (finding,) = check(_recorded(t, drive, broken)).of("stuck")
        assert finding.subject == "w2"
        assert finding.rows[0][0] <= a + 2 + 1 < a + 25 <= finding.rows[-1][1]


def test_a_wheel_held_by_the_others_while_its_voltage_changes_is_not_stuck():
    """Its motor gives more and the others take it away: the voltage changes, the speed keeps its step."""
    rng = np.random.default_rng(6)
    t, drive, _ = _wheels(rng, 30.0)
    for a in range(200, 1400, 300):
        drive[a : a + 40] = drive[a - 1]
        drive[a + 15 : a + 40, 1] = drive[a - 1, 1] + 0.6  # 0.75 * 0.6 = 0.25 * (0.9 + 0.9)
        drive[a + 15 : a + 40, 0] = drive[a - 1, 0] + 0.9
        drive[a + 15 : a + 40, 2] = drive[a - 1, 2] + 0.9
    coarse = np.round(_following(drive) / 0.8) * 0.8
    assert not check(_recorded(t, drive, coarse)).of("stuck")


def test_a_channel_that_never_repeats_is_stuck_after_a_few_rows():
    rng = np.random.default_rng(7)
    t, drive, speed = _wheels(rng, 30.0)
    noisy = speed + 0.02 * rng.normal(size=speed.shape)
    noisy[700:708, 0] = noisy[700, 0]
    (finding,) = check(_recorded(t, drive, noisy)).of("stuck")
    assert (finding.subject, finding.rows) == ("w1", ((702, 709),))


def test_a_simulated_speed_that_settles_is_not_stuck():
    """Without noise a speed comes to rest at a value, and repeats it to the last digit."""
    t = np.arange(0.0, 10.0, 0.02)
    share = np.where(t < 5.0, 1.0 - np.exp(-t / 0.02), -1.0 + 2.0 * np.exp(-(t - 5.0) / 0.02))
    speed = np.outer(share, [8.0, -5.0, 3.0])
    drive = np.where(t < 5.0, 0.5, -0.5)[:, None] * [1.0, -0.7, 0.4]
    assert not check(_recorded(t, drive, speed)).of("stuck")


# ---- a heading that was held ----------------------------------------------------------------------------


def straight_log(robot, wobble):
    """Forward and back; `wobble` [V] turns the robot a little to and fro at 3 Hz."""
    t = np.arange(2000) * 0.01
    voltage = np.zeros((2000, 3))
    voltage[:, 1] = 3.5 * np.sign(np.sin(2.0 * np.pi * t / 4.0))
    voltage[:, 2] = -voltage[:, 1]
    run = simulate(robot, voltage + wobble * np.sin(6.0 * np.pi * t)[:, None], 0.01, tol=None)
    channels = {name: getattr(run, name) for name in ("voltage", "wheel_speed", "twist", "pose")}
    return Log(run.t, channels, np.arange(len(run)) + 2, source="run.csv")


@pytest.mark.parametrize("wobble", [0.0, 0.8, 1.5])
@pytest.mark.parametrize("gyro", [True, False])
def test_a_heading_that_was_held_is_not_dead(robot, with_channels, wobble, gyro):
    log = straight_log(robot, wobble)
    pose = np.full_like(log.channels["pose"], np.nan)
    assert np.ptp(log.channels["pose"][:, 2]) < 0.25
    pose[:, 2] = 0.25  # a compass in steps of a quarter, to which the robot is held
    twist = log.channels["twist"] * [np.nan, np.nan, 1.0] + [0.0, 0.0, 0.01] if gyro else None
    verdict = check(with_channels(log, pose=pose, twist=twist), robot)
    assert not verdict.of("dead")


def test_a_heading_that_was_not_recorded_is_dead_still(robot, with_channels):
    turning = exact_turn(robot)
    pose = np.full_like(turning.channels["pose"], np.nan)
    pose[:, 2] = 0.25
    for twist in (turning.channels["twist"], None):
        (finding,) = check(with_channels(turning, pose=pose, twist=twist), robot).of("dead")
        assert finding.subject == "heading"


def exact_turn(robot):
    run = simulate(robot, np.tile([3.0, 3.0, 3.0], (1000, 1)), 0.01, tol=None)
    channels = {name: getattr(run, name) for name in ("voltage", "wheel_speed", "twist", "pose")}
    return Log(run.t, channels, np.arange(len(run)) + 2, source="run.csv")
