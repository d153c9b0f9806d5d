"""Units and scales of positions and speeds: a third channel says which of the two is wrong."""

from dataclasses import replace

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.column import Column
from omnidyn.logs.columns.mapping import ColumnMap
from tests.findings.redundant import ROBOT, recorded

DEGREES = 180.0 / np.pi


def above_notes(verdict):
    return [(finding.code, finding.subject) for finding in verdict.findings if finding.severity != "note"]


def in_degrees(twist):
    return twist * [1.0, 1.0, DEGREES]


def alone(twist):
    return twist * [np.nan, np.nan, DEGREES]


@pytest.mark.parametrize("without", [(), ("pose",), ("wheel_speed",), ("pose", "twist_command")])
def test_a_gyroscope_in_degrees_is_blamed_and_nothing_else(without):
    verdict = check(recorded(twist=in_degrees, **dict.fromkeys(without)), ROBOT)
    assert above_notes(verdict) == [("unit", "omega")]
    assert "deg/s read as rad/s" in str(verdict.of("unit")[0])


def test_a_gyroscope_in_degrees_beside_wheels_alone():
    log = recorded(twist=alone, pose=None, twist_command=None)
    assert above_notes(check(log, ROBOT)) == [("unit", "omega")]
    # Where the wheels were read in deg/s, and the gyroscope was right, these are blamed.
    columns = {"omega": Column("gz", "rad/s"), **{f"w{k}": Column(f"w{k}", "deg/s") for k in (1, 2, 3)}}
    wrong = recorded(
        twist=lambda twist: twist * [np.nan, np.nan, 1.0],
        pose=None,
        twist_command=None,
        wheel_speed=lambda speed: speed * DEGREES,
    )
    wrong = replace(wrong, columns=ColumnMap({**columns, "w1": Column("w1", "rad/s")}))
    assert above_notes(check(wrong, ROBOT)) == [("unit", "w1 w2 w3")]


@pytest.mark.parametrize("without", [(), ("wheel_speed",)])
def test_a_heading_in_degrees_is_blamed_where_the_rest_agrees(without):
    log = recorded(pose=lambda pose: pose * [1.0, 1.0, DEGREES], **dict.fromkeys(without))
    assert above_notes(check(log, ROBOT)) == [("unit", "heading")]


def test_a_path_in_millimetres_is_blamed():
    log = recorded(pose=lambda pose: pose * [1e3, 1e3, 1.0])
    assert above_notes(check(log, ROBOT)) == [("unit", "x y")]


def test_speeds_and_positions_that_agree_on_another_time_blame_the_time():
    log = recorded()
    verdict = check(replace(log, t=1.5 * log.t), ROBOT)
    assert above_notes(verdict)[0] == ("time_unit", "t")


@pytest.mark.parametrize("factor", [1.05, 0.9])
def test_a_gyroscope_of_another_scale_is_blamed_by_the_wheels(factor):
    verdict = check(recorded(twist=lambda twist: twist * [1.0, 1.0, factor]), ROBOT)
    assert above_notes(verdict) == [("scale", "omega")]
    verdict = check(recorded(pose=lambda pose: pose * [1.0, 1.0, factor]), ROBOT)
    assert ("scale", "heading") in above_notes(verdict)


def test_angles_with_wrong_counts_per_turn_are_one_cause():
    log = recorded()
    angle = 1.25 * np.cumsum(log.channels["wheel_speed"], axis=0) * 0.02
    verdict = check(replace(log, channels={**log.channels, "wheel_angle": angle}), ROBOT)
    assert above_notes(verdict) == [("scale", "a1 a2 a3")]
    speed = log.channels["wheel_speed"] * 60.0 / (2.0 * np.pi)
    verdict = check(replace(log, channels={**log.channels, "wheel_angle": angle / 1.25, "wheel_speed": speed}), ROBOT)
    assert above_notes(verdict) == [("unit", "w1 w2 w3")]
