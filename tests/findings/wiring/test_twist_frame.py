"""Twist, pose, command and wheels in frames that do not agree: one cause, and the right one."""

import numpy as np
import pytest

from omnidyn.findings.check import check
from tests.findings.redundant import ROBOT, driven, recorded

WHEELS, NO_WHEELS = {}, {"wheel_speed": None}


def above_notes(verdict):
    return [(finding.code, finding.subject) for finding in verdict.findings if finding.severity != "note"]


def turn(values, degrees):
    plane = (values[:, 0] + 1j * values[:, 1]) * np.exp(1j * np.radians(degrees))
    return np.column_stack([plane.real, plane.imag, values[:, 2]])


def in_room(values):
    room = driven()[-1]
    return np.column_stack([room.real, room.imag, values[:, 2]])


@pytest.mark.parametrize("robot", [ROBOT, None])
@pytest.mark.parametrize("without", [(), ("wheel_speed",), ("wheel_speed", "twist_command"), ("twist",), ("pose",)])
def test_nothing_is_said_where_all_agree(robot, without):
    assert above_notes(check(recorded(**dict.fromkeys(without)), robot)) == []


@pytest.mark.parametrize("robot, others", [(ROBOT, WHEELS), (None, WHEELS), (ROBOT, NO_WHEELS), (None, NO_WHEELS)])
def test_a_twist_in_the_frame_of_the_room(robot, others):
    verdict = check(recorded(twist=in_room, **others), robot)
    assert above_notes(verdict) == [("twist_frame", "vx vy")]
    (finding,) = verdict.of("twist_frame")
    assert finding.severity == "error"
    assert "twist=room" in finding.remedy_text
    assert finding.numbers["likeness"] > 0.98


@pytest.mark.parametrize("degrees", [8.0, -12.0, 40.0, 90.0, -150.0])
@pytest.mark.parametrize("others", [WHEELS, NO_WHEELS, {"twist": None, "wheel_speed": None}])
@pytest.mark.some(5)
def test_a_marker_that_is_mounted_at_an_angle(degrees, others):
    log = recorded(pose=lambda pose: pose + np.array([0.0, 0.0, np.radians(degrees)]), **others)
    for robot in (ROBOT, None) if "wheel_speed" in others else (ROBOT,):
        verdict = check(log, robot)
        assert above_notes(verdict) == [("marker_angle", "heading")]
        (finding,) = verdict.of("marker_angle")
        assert finding.numbers["angle_deg"] == pytest.approx(degrees, abs=1.5)
        assert "assume` marker=" in finding.remedy_text


@pytest.mark.parametrize("degrees", [8.0, -30.0])
def test_a_marker_at_an_angle_against_the_wheels_alone(degrees):
    log = recorded(pose=lambda pose: pose + np.array([0.0, 0.0, np.radians(degrees)]), twist=None, twist_command=None)
    (finding,) = [each for each in check(log, ROBOT).findings if each.severity != "note"]
    assert finding.numbers["angle_deg"] == pytest.approx(degrees, abs=1.5)
    assert f"marker={finding.numbers['angle_deg']:.1f}deg" in finding.remedy_text


@pytest.mark.parametrize("degrees", [10.0, -60.0])
def test_a_sensor_of_the_twist_that_is_mounted_at_an_angle(degrees):
    verdict = check(recorded(twist=lambda twist: turn(twist, degrees)), ROBOT)
    assert above_notes(verdict) == [("twist_frame", "vx vy")]
    assert verdict.of("twist_frame")[0].numbers["angle_deg"] == pytest.approx(degrees, abs=1.5)


def test_a_mirrored_odometry_is_one_cause():
    log = recorded(pose=lambda pose: pose * [1, -1, -1], twist=lambda twist: twist * [1, -1, -1], twist_command=None)
    verdict = check(log, ROBOT)
    assert above_notes(verdict) == [("inverted", "vy omega y heading")]
    # Mirrored the other way round, x and heading are.
    log = recorded(pose=lambda pose: pose * [-1, 1, -1], twist=lambda twist: twist * [-1, 1, -1], twist_command=None)
    assert above_notes(check(log, ROBOT)) == [("inverted", "vx omega x heading")]


@pytest.mark.parametrize("signs, where", [((1, -1, -1), "y heading"), ((1, -1, 1), "y"), ((1, 1, -1), "heading")])
@pytest.mark.parametrize("others", [WHEELS, NO_WHEELS])
def test_a_mirrored_pose_beside_a_right_twist(signs, where, others):
    verdict = check(recorded(pose=lambda pose: pose * signs, **others), ROBOT)
    assert above_notes(verdict) == [("pose_frame", where)]


@pytest.mark.parametrize("others", [WHEELS, NO_WHEELS])
def test_an_inverted_gyroscope_is_no_time_in_another_unit(others):
    verdict = check(recorded(twist=lambda twist: twist * [1, 1, -1], **others), ROBOT)
    assert [code for code, _ in above_notes(verdict)] == ["inverted"]
    assert "omega" in verdict.of("inverted")[0].subject


def test_wheels_that_slip_sideways_are_one_cause():
    verdict = check(recorded(slip_y=0.8), ROBOT)
    assert above_notes(verdict) == [("axis_ratio", "y")]
    assert verdict.of("axis_ratio")[0].numbers["ratio"] == pytest.approx(0.8, abs=0.005)
