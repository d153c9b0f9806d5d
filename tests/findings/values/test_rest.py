"""Rest needs no exact zero: a filter leaves a residue."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.log import Log
from omnidyn.logs.read_log import recorded_log
from omnidyn.statistics import moving
from tests.support.cases import case


def resting(residue, seconds=120.0, dt=0.1):
    """A robot that drives and stands in turn; its odometry says `residue` while it stands."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, seconds, dt)
    command = np.where((t % 40.0) < 25.0, 0.7, 0.0)
    speed, turn = np.zeros_like(t), np.zeros_like(t)
    for k in range(1, len(t)):
        speed[k] = speed[k - 1] + 0.3 * (command[k] - speed[k - 1])
        turn[k] = turn[k - 1] + 0.3 * (0.15 * np.sin(t[k] / 3.0) * (command[k] > 0.0) - turn[k - 1])
    drives = speed > 0.02
    speed, turn = speed * drives, turn * drives
    heading = np.cumsum(turn) * dt
    pose = np.column_stack([np.cumsum(speed * np.cos(heading)), np.cumsum(speed * np.sin(heading)), heading / dt]) * dt
    vx = np.where(drives, speed + 0.003 * rng.normal(size=len(t)), residue)
    omega = np.where(drives, turn + 0.004 * rng.normal(size=len(t)), 1e-3 * residue)
    twist = np.column_stack([vx, 0.0 * vx, omega])
    return Log(t, {"pose": pose, "twist": twist}, np.arange(len(t)) + 2)


@pytest.mark.parametrize("residue", [0.0, 2e-15, -1e-9, 5e-4])
def test_a_robot_that_stands_is_not_stuck(residue):
    assert not check(resting(residue)).of("stuck")


def test_a_robot_that_is_said_to_drive_on_is():
    assert check(resting(0.05)).of("stuck")  # twenty times its noise, to the last digit, for 15 s


def test_the_residue_of_a_filter_is_not_stuck():
    verdict = check(recorded_log(case("logs/still_called_stuck/rest.csv")))
    assert not verdict.of("stuck")
    assert not [finding for finding in verdict.findings if finding.severity != "note"]


def test_an_encoder_that_reads_a_residue_reads_zero(log, robot, with_channels):
    step = 0.5 * float(np.quantile(np.abs(log.channels["wheel_speed"]), 0.5))
    speed = step * np.trunc(log.channels["wheel_speed"] / step)
    found = [
        check(replace(log, channels={**log.channels, "wheel_speed": each}), robot).of("reads_zero")
        for each in (speed, np.where(speed == 0.0, 1e-12, speed))
    ]
    assert [each.numbers for each in found[0]] == [each.numbers for each in found[1]]


def test_what_moves_is_more_than_a_millionth_of_the_largest():
    assert moving(np.array([0.0, 1e-9, -0.5, np.nan, 1.0])).tolist() == [False, False, True, False, True]
    assert not moving(np.zeros(3)).any()
