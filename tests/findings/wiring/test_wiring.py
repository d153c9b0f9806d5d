"""Every order and every sign of the wheels is put in and named."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.findings.wiring.orders import Wiring, wirings
from omnidyn.model.robot_file import load_robot
from tests.findings.redundant import ROBOT, recorded
from tests.support.pushed_logs import clean_log
from tests.support.random_logs import clean

SOME = [
    ((1, 0, 2), (1, 1, 1)),
    ((0, 2, 1), (1, 1, 1)),
    ((2, 0, 1), (1, 1, 1)),
    ((0, 1, 2), (1, -1, 1)),
    ((0, 1, 2), (-1, -1, 1)),
    ((2, 1, 0), (1, 1, -1)),
]


def names_of(order, sign, letter="w"):
    return {f"{letter}{k + 1}" for k, (j, s) in enumerate(zip(order, sign, strict=True)) if k != j or s < 0}


def test_all_orders_and_signs_are_tried():
    signs = product((1.0, -1.0), repeat=3)
    assert {(w.order, w.sign) for w in wirings(3)} == set(product(permutations(range(3)), signs))
    assert next(wirings(4)) == Wiring((0, 1, 2, 3), (1.0, 1.0, 1.0, 1.0))


def test_a_wiring_puts_right_what_it_describes():
    values = np.array([[1.0, 2.0, 3.0]])
    wiring = Wiring((2, 0, 1), (1.0, -1.0, 1.0))
    np.testing.assert_array_equal(wiring.applied(values), [[3.0, -1.0, 2.0]])
    np.testing.assert_array_equal(values @ wiring.matrix.T, wiring.applied(values))


@pytest.mark.parametrize("order, sign", SOME)
@pytest.mark.parametrize("channel, letter", [("wheel_speed", "w"), ("voltage", "u"), ("current", "i")])
@pytest.mark.some(7)
def test_columns_in_the_wrong_place_are_named(log, robot, with_channels, grave, order, sign, channel, letter):
    broken = with_channels(**{channel: log.channels[channel][:, order] * sign})
    verdict = check(broken, robot)
    found = [finding for finding in verdict.findings if finding.code in ("swapped", "inverted")]
    assert len(found) == 1
    assert set(found[0].subject.split()) == names_of(order, sign, letter)
    assert found[0].severity == "error"
    assert grave(verdict) == {found[0].code}  # nothing that follows from it


def test_a_whole_motor_in_the_wrong_place_is_told_from_its_encoder(log, robot, with_channels, grave):
    order = [1, 0, 2]
    broken = with_channels(**{name: log.channels[name][:, order] for name in ("voltage", "current", "wheel_speed")})
    (finding,) = check(broken, robot).of("swapped")
    assert "the whole motor" in str(finding)
    assert "w1 and w2 are exchanged" in str(finding)
    assert grave(check(broken, robot)) == {"swapped"}


def test_wheels_of_four_against_each_other_without_any_floor(four_wheel, with_channels):
    base = clean_log(four_wheel, seed=5)
    speed = base.channels["wheel_speed"] * [1.0, -1.0, 1.0, 1.0]
    alone = with_channels(base, wheel_speed=speed, voltage=None, current=None, twist=None, pose=None)
    (finding,) = check(alone, four_wheel).of("inverted")
    assert finding.subject == "w2"  # the other explanation turns the three others about
    assert "what the wheels must agree on" in str(finding)


def test_an_axis_with_the_opposite_sign(log, robot, with_channels, grave):
    verdict = check(with_channels(twist=log.channels["twist"] * [1.0, 1.0, -1.0], pose=None), robot)
    assert [finding.subject for finding in verdict.of("inverted")] == ["omega"]
    assert grave(verdict) == {"inverted"}


def test_an_axis_that_looks_like_two_exchanged_wheels(log, robot, with_channels):
    # Wheels 2 and 3 of the AxeBot mirror each other: exchanging them is turning vx about.
    (finding,) = check(with_channels(twist=log.channels["twist"] * [-1.0, 1.0, 1.0], pose=None), robot).of("swapped")
    assert "w2 and w3 are exchanged" in str(finding)
    assert "vx has the opposite sign" in str(finding)


def test_a_heading_alone_that_runs_the_other_way(log, robot, with_channels):
    pose = np.full_like(log.channels["pose"], np.nan)
    pose[:, 2] = -log.channels["pose"][:, 2]
    (finding,) = check(with_channels(pose=pose, twist=None), robot).of("inverted")
    assert finding.subject == "heading"
    assert "counter-clockwise" in str(finding)


def test_a_pose_in_a_frame_of_its_own(log, robot, with_channels, grave):
    turn = np.exp(1j * np.radians(40.0)) * (log.channels["pose"][:, :2] @ [1.0, 1j])
    pose = np.column_stack([turn.real, turn.imag, log.channels["pose"][:, 2]])
    verdict = check(with_channels(pose=pose, twist=None), robot)
    (finding,) = verdict.of("pose_frame")
    assert finding.numbers["angle_deg"] == pytest.approx(40.0, abs=1.0)
    assert grave(verdict) == {"pose_frame"}


def test_what_the_log_cannot_tell_apart_is_said(robot, with_channels):
    # On the spot all wheels do the same: exchanging two changes nothing, and nothing is claimed.
    base = clean_log(robot, seed=2)
    n = len(base)
    omega = 3.0 * np.sin(np.arange(n) / 60.0)
    rng = np.random.default_rng(0)
    speed = np.outer(omega, np.full(3, 0.1 / 0.035)) + 0.02 * rng.normal(size=(n, 3))
    twist = np.column_stack([np.zeros(n), np.zeros(n), omega]) + 0.01 * rng.normal(size=(n, 3))
    turning = with_channels(base, wheel_speed=speed[:, [1, 0, 2]], twist=twist, voltage=None, current=None, pose=None)
    assert not check(turning, robot).has_errors


def test_a_robot_with_another_number_of_wheels_is_said(log):
    (finding,) = check(log, load_robot("four-wheel")).of("wheel_count")
    assert "3 wheels" in str(finding)


@pytest.mark.parametrize("seed", [1, 4, 7])
@pytest.mark.parametrize(("order", "sign", "code"), [((1, 0), 1.0, "swapped"), ((0, 1), -1.0, "inverted")])
def test_two_wheels_exchanged_or_one_turned_about_in_rpm_are_both_said(seed, order, sign, code):
    """Speeds 9.55 times too large are no excuse: order, sign and unit are each told, and nothing else."""
    log, robot, _ = clean(seed)
    speed = log.channels["wheel_speed"][:, [*order, *range(2, robot.wheels.count)]] * 60.0 / (2.0 * np.pi)
    speed[:, 0] *= sign
    verdict = check(replace(log, channels={**log.channels, "wheel_speed": speed}), robot)
    grave = {finding.code: finding for finding in verdict.findings if finding.severity != "note"}
    assert set(grave) == {code, "unit"}
    assert grave[code].subject == ("w1 w2" if code == "swapped" else "w1")
    assert "whole motor" not in str(grave[code])
    assert "rpm read as rad/s" in str(grave["unit"])


def test_a_gyroscope_beside_a_pose_hides_no_exchanged_wheels():
    """The pose tells all three axes; a gyroscope alone cannot tell wheels apart that turn the robot alike."""
    log = recorded(
        twist=lambda twist: np.column_stack([np.full((len(twist), 2), np.nan), twist[:, 2]]), twist_command=None
    )
    verdict = check(log, ROBOT)
    assert not verdict.has_errors
    assert verdict.excitation["x"] == pytest.approx(0.3, abs=0.1)
    speed = log.channels["wheel_speed"][:, [2, 1, 0]]
    (finding,) = check(replace(log, channels={**log.channels, "wheel_speed": speed}), ROBOT).of("swapped")
    assert finding.subject == "w1 w3"
