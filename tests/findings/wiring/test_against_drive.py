"""Axes of a twist against the voltages: simulated logs of random robots without any speed of a wheel."""

from dataclasses import replace

import numpy as np
import pytest

import omnidyn
from omnidyn.findings.check import check_log
from omnidyn.findings.remedies import remedied
from omnidyn.logs.read_log import LogOptions, recorded_log
from omnidyn.statement import ERROR
from tests.support.pages import write_log
from tests.support.random_logs import AXES, plain, random_scene


def recorded(seed):
    """A clean log of voltages or duty and a twist, and its robot."""
    draws = np.random.default_rng([seed, 77])
    scene = replace(random_scene(draws), floor="twist", has_speed=False, has_current=False, seconds=15.0)
    return plain(draws, scene), scene.robot


@pytest.mark.parametrize("seed", range(12))
def test_each_axis_that_is_turned_is_named_and_no_clean_log_is(seed):
    log, robot = recorded(seed)
    assert not [finding for finding in check_log(log, robot).findings if finding.code == "inverted"]
    k = seed % 3
    turned = log.channels["twist"] * np.where(np.arange(3) == k, -1.0, 1.0)
    wrong = replace(log, channels={**log.channels, "twist": turned})
    (found,) = (finding for finding in check_log(wrong, robot).findings if finding.severity == ERROR)
    assert (found.code, found.subject) == ("inverted", AXES[k])
    assert "the voltages drive" in str(found)
    assert "in the mapping" in found.remedy_text


def test_the_remedy_reads_the_log_with_the_other_sign(tmp_path):
    def turn(twist):
        twist[:, 1] *= -1.0

    robot = omnidyn.load_robot("axebot")
    right = recorded_log(write_log(tmp_path / "right.csv"), robot, LogOptions())
    log = recorded_log(write_log(tmp_path / "log.csv", change=turn), robot, LogOptions())
    (found,) = (finding for finding in check_log(log, robot).findings if finding.severity == ERROR)
    mended = recorded_log(tmp_path / "log.csv", robot, remedied(found, LogOptions(), log.columns))
    np.testing.assert_array_equal(mended.channels["twist"], right.channels["twist"])
    assert not check_log(mended, robot).has_errors


def test_a_few_windows_are_no_evidence():
    log, robot = recorded(3)
    wrong = replace(log, channels={**log.channels, "twist": -log.channels["twist"]})
    short = wrong.rows(slice(0, int(np.searchsorted(log.t, log.t[0] + 2.0))))
    assert not [finding for finding in check_log(short, robot).findings if finding.code == "inverted"]


@pytest.mark.parametrize("share", [0.0, 0.05])
def test_an_axis_that_is_not_driven_says_nothing(share):
    """Whatever else moves it: a step of a wheel, a slope, a gyroscope that is mounted askew."""
    draws = np.random.default_rng(0)
    voltage = np.repeat(draws.uniform(-5.0, 5.0, (60, 1)), 20, axis=0) * [-2.0 * share, 1.0 + share, share - 1.0]
    run = omnidyn.simulate(omnidyn.load_robot("axebot"), voltage, 0.01)
    twist = run.twist + draws.standard_normal(run.twist.shape) * 0.01 - [0.0, 0.2, 0.0] * np.sign(run.twist[:, :1])
    log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist)
    assert not [f for f in omnidyn.check(log, omnidyn.load_robot("axebot")).findings if f.code == "inverted"]


@pytest.mark.parametrize(("frequency", "late"), [(1.0, 0.3), (2.0, 0.1), (2.0, 0.2), (3.0, 0.1)])
def test_a_voltage_that_goes_to_and_fro_and_acts_late_turns_no_axis(frequency, late):
    """Half a turn of phase is no sign: what is late is not inverted."""
    robot, draws = omnidyn.load_robot("axebot"), np.random.default_rng(0)
    swing = 6.0 * np.sin(2.0 * np.pi * frequency * np.arange(0.0, 20.0, 0.01))
    run = omnidyn.simulate(robot, np.outer(swing, [0.5, 1.0, -0.7]), 0.01)
    twist = np.roll(run.twist, round(late / 0.01), axis=0) + draws.standard_normal(run.twist.shape) * 0.01
    log = omnidyn.Run(t=run.t, voltage=run.voltage, twist=twist)
    assert not [f for f in omnidyn.check(log, robot).findings if f.code == "inverted"]


def test_motors_in_another_order_are_not_mended_by_the_sign_of_an_axis():
    log, robot = recorded(1)
    drive = next(name for name in ("voltage", "duty") if log.channels.get(name) is not None)
    wrong = replace(log, channels={**log.channels, drive: np.roll(log.channels[drive], 1, axis=1)})
    (found,) = (finding for finding in check_log(wrong, robot).findings if finding.severity == ERROR)
    assert (found.code, found.subject) == ("inverted", "vy")
    assert "the motors are in another order, or have another sign" in str(found)
    assert "(`column`)" in found.remedy_text
    assert remedied(found, LogOptions(), log.columns) is None


def test_voltages_that_all_have_the_opposite_sign_are_named_beside_the_axes():
    log, robot = recorded(3)
    turned = replace(log, channels={**log.channels, "twist": -log.channels["twist"]})
    (found,) = (finding for finding in check_log(turned, robot).findings if finding.code == "inverted")
    assert found.subject == "vx vy omega"
    assert "or the voltages have it" in str(found)
    assert "these columns" in found.remedy_text
