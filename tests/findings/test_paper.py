"""The paper's own Table 1 through `check`: its w rows are energetically impossible for the robot of its Table 3."""

import numpy as np
import pytest

from omnidyn.findings.check import check
from omnidyn.logs.log import Log
from omnidyn.model.keys import EMF
from omnidyn.model.robot_file import load_robot
from omnidyn.paper.tables import TABLE_1, TABLE_3


@pytest.fixture(scope="module")
def table_1():
    """The twelve rows as a log: one row per steady point, in the order of the paper."""
    rows = [(row, axis) for axis in range(3) for row in TABLE_1[("x", "y", "yaw")[axis]]]
    voltage = np.array([row.voltage for row, _ in rows])
    twist = np.zeros((len(rows), 3))
    for k, (row, axis) in enumerate(rows):
        twist[k, axis] = row.speed
    return Log(np.arange(len(rows)) * 1.0, {"voltage": voltage, "twist": twist}, np.arange(len(rows)) + 2)


def test_the_w_rows_of_table_1_are_impossible(table_1):
    (energy,) = check(table_1, load_robot("axebot")).of("energy")
    # By hand, from Table 3: back-EMF K_v l w b/r of a robot that turns, against the voltage printed in the same row.
    emf = TABLE_3[EMF] * TABLE_3["motor.gear_ratio"] / TABLE_3["wheels.wheel_radius_m"]
    above = [row.speed * TABLE_3["wheels.robot_radius_m"] * emf > row.voltage[0] for row in TABLE_1["yaw"]]
    assert above == [False, True, True, True]
    assert energy.severity == "error"
    assert energy.rows == ((11, 13),)  # the last three of twelve rows, the first of them in line 2
    assert energy.count == 3


def test_nothing_else_of_table_1_is_called_wrong(table_1):
    verdict = check(table_1, load_robot("axebot"))
    assert {finding.code for finding in verdict.findings if finding.severity != "note"} == {"energy"}


def test_a_robot_radius_that_fits_makes_the_rows_possible(table_1):
    # EVIDENCE: b = 0.059 m repairs the w rows.
    axebot = load_robot("axebot")
    small = axebot.replace(wheels=axebot.wheels.replace(robot_radius=0.059))
    assert not check(table_1, small).of("energy")
