"""Dead, stuck, quantised, spiky and missing channels."""

import numpy as np
import pytest

from omnidyn import load_robot, simulate
from omnidyn.logs.check import check
from omnidyn.logs.check.robust import quantum, white_noise
from omnidyn.logs.log import Log


def test_a_clean_log_says_nothing_above_a_note(log, robot, grave):
    assert grave(check(log, robot)) == set()
    assert grave(check(log)) == set()


@pytest.mark.parametrize("channel, letter", [("wheel_speed", "w"), ("current", "i")])
def test_a_flat_line_is_dead(log, robot, with_channels, grave, channel, letter):
    values = log.channels[channel].copy()
    values[:, 1] = 0.0
    verdict = check(with_channels(**{channel: values}), robot)
    assert [finding.where for finding in verdict.of("dead")] == [f"{letter}2"]
    assert grave(verdict) == {"dead"}


def test_a_sensor_that_is_noise_only_is_dead(log, robot, with_channels, grave):
    values = log.channels["wheel_speed"].copy()
    values[:, 2] = 0.3 * np.random.default_rng(0).normal(size=len(values))
    verdict = check(with_channels(wheel_speed=values), robot)
    assert [finding.where for finding in verdict.of("dead")] == ["w3"]
    assert grave(verdict) == {"dead"}


def test_a_wheel_that_should_stand_is_not_dead(log, robot, with_channels):
    # Straight ahead, wheel 1 of the AxeBot has nothing to do: sin 180 deg is 0.
    from tests.logs.check.conftest import clean_log

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
    assert finding.where == "w1"
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
    assert (finding.where, finding.count) == ("w2", 2)
    assert finding.rows == ((335, 335), (1446, 1446))
    assert finding.numbers["farthest"] == 400.0
    assert grave(check(with_channels(wheel_speed=values), robot)) == {"spike"}


def test_missing_values_are_counted(log, robot, with_channels):
    values = log.channels["current"].copy()
    values[100:150, 0] = np.nan
    (finding,) = check(with_channels(current=values), robot).of("missing")
    assert (finding.level, finding.where, finding.count) == ("note", "i1", 50)


def test_a_slow_wheel_that_reads_zero(robot, log, with_channels):
    command = np.tile([3.0, 3.0, 0.2], (len(log), 1))
    rng = np.random.default_rng(0)
    speed = np.round((0.9 * command + 0.2 * rng.normal(size=command.shape)) / 0.5) * 0.5
    others = dict.fromkeys(("voltage", "current", "twist", "pose"))
    broken = with_channels(wheel_speed_command=command, wheel_speed=speed, **others)
    (finding,) = check(broken).of("reads_zero")
    assert finding.where == "w3"
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
    assert (finding.where, finding.rows) == ("i2", ((252, 252),))
