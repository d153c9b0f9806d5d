"""An error in the middle of a drive stops the motors and keeps the log of what was driven; it is told, and not lost."""

import re
from typing import Any

import numpy as np
import pytest

from omnidyn.driving.clock import SimulatedClock
from omnidyn.driving.drive import drive
from omnidyn.driving.guard import DriveGuard
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.errors import InputError, Terminated
from tests.support.faulty_drives import DT, axebot_program

PROGRAM = axebot_program()
NOISE = {"twist": np.full(3, 0.01)}
ROWS = 40  # that are sent before something fails


def robot_and_clock(robot_type=SimulatedRobot):
    clock = SimulatedClock()
    return robot_type(PROGRAM.robot, NOISE, clock=clock, rate=1.0 / DT), clock


def fails_at(rows, error):
    def look(moment):
        if moment.rows >= rows:
            raise error

    return look


def check_kept(record, robot, clock, error_type):
    """The log reaches to the error, the error is there, and the motors are off."""
    assert not record.is_complete
    assert record.rows == pytest.approx(ROWS, abs=2)
    assert record.run is not None
    assert len(record.run) == pytest.approx(ROWS, abs=4)
    assert np.isfinite(record.run.twist[5:]).all()
    assert isinstance(record.error, error_type)
    assert record.stopped is not None
    assert record.stopped.remedy_text
    clock.sleep_until(clock.now() + 2.0)
    robot.receive()
    assert robot.last_driven - record.stopped_at <= 0.25


def test_an_error_of_who_looks_on_keeps_the_log():
    robot, clock = robot_and_clock()
    record = drive(PROGRAM, robot, clock=clock, follow=fails_at(ROWS, ValueError("no such plot")))
    check_kept(record, robot, clock, ValueError)
    assert "`follow` failed: got ValueError: no such plot; expected" in str(record.verdict)


@pytest.mark.parametrize("name", ["held", "progress"])
def test_an_error_of_another_function_keeps_the_log(name):
    robot, clock = robot_and_clock()

    def fail(*report):
        if clock.now() > (ROWS - 1) * DT + 0.3:
            raise ZeroDivisionError
        return True

    functions: dict[str, Any] = {name: fail}
    record = drive(PROGRAM, robot, clock=clock, **functions)
    assert f"`{name}` failed: got ZeroDivisionError" in str(record.verdict)
    assert record.run is not None
    assert len(record.run) > ROWS - 5


def test_an_error_of_who_looks_on_after_the_last_row_keeps_the_log():
    robot, clock = robot_and_clock()
    seen = []

    def look(moment):
        seen.append(moment.rows)
        if seen.count(len(PROGRAM.inputs)) == 2:  # after the last row, and at the end
            raise ValueError

    record = drive(PROGRAM, robot, clock=clock, follow=look)
    assert record.rows == len(PROGRAM.inputs)
    assert record.run is not None
    assert record.stopped is not None
    assert len(record.run) > len(PROGRAM.inputs)
    assert record.stopped.code == "drive_call_failed"


def test_an_error_of_the_guard_keeps_the_log(monkeypatch):
    robot, clock = robot_and_clock()
    fault = DriveGuard.fault

    def fail(guard, now):
        if now > ROWS * DT + 0.3:
            raise IndexError("of the guard")
        return fault(guard, now)

    monkeypatch.setattr(DriveGuard, "fault", fail)
    record = drive(PROGRAM, robot, clock=clock)
    check_kept(record, robot, clock, IndexError)
    assert "IndexError: of the guard" in str(record.verdict)


def test_a_program_that_is_told_to_end_keeps_the_log():
    robot, clock = robot_and_clock()
    record = drive(PROGRAM, robot, clock=clock, follow=fails_at(ROWS, Terminated()))
    check_kept(record, robot, clock, Terminated)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"twist": np.zeros(2)}, r"twist: a wrong shape; got \(2,\); expected \(3,\)"),
        ({"speed": np.zeros(3)}, "no such channel; got speed; expected voltage, "),
        ({"t": np.nan}, "not a time; got nan"),
    ],
)
def test_a_measurement_that_no_log_can_hold_keeps_those_before(wrong, message):
    class Wrong(SimulatedRobot):
        def receive(self) -> Any:
            came = super().receive()
            if self.clock.now() < ROWS * DT + 0.3:
                return came
            if "t" in wrong:
                return [one._replace(**wrong) for one in came]
            return [one._replace(channels=wrong) for one in came]

    robot, clock = robot_and_clock(Wrong)
    record = drive(PROGRAM, robot, clock=clock)
    check_kept(record, robot, clock, InputError)
    assert re.search(message, str(record.error))


def test_an_error_of_a_connection_that_does_not_stop_is_told_and_it_is_still_closed():
    closed = []

    class Stays(SimulatedRobot):
        def stop(self):
            raise RuntimeError("no stop")

        def close(self):
            closed.append(True)

    robot, clock = robot_and_clock(Stays)
    record = drive(PROGRAM, robot, clock=clock)
    assert closed
    assert record.run is not None
    assert "no stop" in str(record.stopped)


def test_an_error_before_anything_was_driven_is_raised():
    class Nowhere(SimulatedRobot):
        def open(self):
            raise InputError("no robot", got="a cable", expected="a robot")

    robot, clock = robot_and_clock(Nowhere)
    with pytest.raises(InputError, match="no robot"):
        drive(PROGRAM, robot, clock=clock)
    robot, clock = robot_and_clock()
    with pytest.raises(ValueError, match="at once"):
        drive(PROGRAM, robot, clock=clock, follow=fails_at(0, ValueError("at once")))
