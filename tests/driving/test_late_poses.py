"""Poses that come late, and seldom, as [sensors] of a robot file tells: the simulated robot has them, the guard bears
them."""

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.drive import drive
from omnidyn.driving.simulated import PUSHED, Fault, SimulatedRobot
from omnidyn.model.log_effects import Sensors
from tests.support.faulty_drives import axebot_program

PROGRAM = axebot_program()
NOISE = {"wheel_speed": np.full(3, 1e-6), "pose": np.full(3, 1e-9)}


def late_drive(delay, rate, hz, area=PROGRAM.area, faults=()):
    """A program for a robot with such poses, and that robot."""
    robot = PROGRAM.robot.replace(sensors=Sensors(pose_delay=delay, pose_rate=rate))
    program = omnidyn.DriveProgram(robot, PROGRAM.dt, PROGRAM.inputs, area)
    return program, SimulatedRobot(robot, NOISE, rate=hz, faults=faults)


@pytest.mark.parametrize(("delay", "rate"), [(0.0, None), (0.08, None), (0.08, 20.0), (0.15, 30.0)])
def test_a_pose_is_that_of_so_long_ago(delay, rate):
    record = drive(*late_drive(delay, rate, 100.0))
    assert record.is_complete, record.verdict
    log = record.run
    exact = omnidyn.simulate(PROGRAM.robot, PROGRAM.inputs.repeat(20, axis=0), PROGRAM.dt / 20)
    kept = np.isfinite(log.pose[:, 0]) & (log.t < PROGRAM.seconds)
    ages = log.t[kept] - delay
    if rate:
        greeting = 0.32  # [s] before the first row, on the clock of the robot: begun at 0, by which its camera looks
        ages = np.floor((ages + greeting) * rate + 1e-6) / rate - greeting
    for axis, near in enumerate((2e-4, 2e-4, 3e-3)):  # straight between ticks of 10 ms: a h^2 / 8
        seen = np.interp(ages, exact.t, exact.pose[:, axis])
        np.testing.assert_allclose(log.pose[kept, axis], seen, atol=near)
    if rate:
        assert np.diff(log.t[kept]).min() > 0.7 / rate


@pytest.mark.parametrize("delay", [0.1, 0.3])
def test_late_poses_are_no_slip_and_a_robot_that_is_pushed_slips_still(delay):
    assert drive(*late_drive(delay, 25.0, 50.0)).is_complete
    pushed = drive(*late_drive(delay, 25.0, 50.0, (30.0, 30.0), [Fault(PUSHED, 1.0, 40.0)]))
    assert pushed.stopped is not None


def test_the_border_is_seen_in_time_where_poses_are_late():
    ends = []
    for delay in (0.0, 0.1):
        record = drive(*late_drive(delay, 50.0, 50.0, (0.9, 3.0)))
        assert record.stopped.code == "drive_border"
        still = np.concatenate([PROGRAM.inputs[: record.rows], np.zeros((50, 3))])
        ends.append(omnidyn.simulate(PROGRAM.robot, still, PROGRAM.dt).pose[-1, 0])
    assert max(ends) < 0.45
