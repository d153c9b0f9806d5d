"""What a drive does not take is refused before anything is sent."""

import numpy as np
import pytest

import omnidyn
from omnidyn.driving.connection import Command, Measured
from omnidyn.driving.drive import drive
from omnidyn.driving.guard import DriveGuard, Limits
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.recording import DriveRecording
from omnidyn.driving.resume import rest_of
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.driving.wire import MeasuredLines, body, line
from omnidyn.errors import InputError
from tests.support.faulty_drives import axebot_program, with_battery
from tests.support.wire_robot import command_of

ROBOT = omnidyn.load_robot("axebot")
ROWS = np.array([[0.0, 3.0, -3.0]] * 20 + [[0.0] * 3] * 10)


@pytest.mark.parametrize("name", ["dead_man", "silence"])
@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0, -1.0, 1e-9, 1e9, "1", True])
def test_a_time_after_which_nothing_would_stop_it_is_refused(name, value):
    with pytest.raises(InputError, match=f"{name}: out of range"):
        Limits(**{name: value})


@pytest.mark.parametrize("value", [np.nan, np.inf, -3.0])
def test_a_least_supply_that_is_no_voltage_is_refused(value):
    with pytest.raises(InputError, match="not a voltage"):
        Limits(supply=value)


def test_a_least_supply_of_zero_is_zero():
    guard = DriveGuard(DriveProgram(with_battery(ROBOT), 0.02, ROWS), Limits(supply=0.0), 0.0)
    guard.take(0.0, 0.0, Measured(0.0, 1, 1, {"supply": np.array([1.0])}))
    assert guard.fault(0.0) is None


@pytest.mark.parametrize("size", [0.0, -1.0, np.nan, np.inf, 1e300])
def test_a_room_that_is_none_is_refused(size):
    with pytest.raises(InputError, match="wrong room"):
        DriveProgram(ROBOT, 0.02, ROWS, (size, 3.0))


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, np.inf])
def test_a_row_without_a_length_is_refused(dt):
    with pytest.raises(InputError, match="wrong length of a row"):
        DriveProgram(ROBOT, dt, ROWS)


def test_a_program_that_moves_nothing_is_refused():
    with pytest.raises(InputError, match="nothing to drive"):
        DriveProgram(ROBOT, 0.02, np.zeros((9, 3)))


def test_a_duty_beyond_the_supply_is_refused():
    robot = ROBOT.replace(drive=ROBOT.drive.replace(kind="duty", supply=12.0))
    with pytest.raises(InputError, match="a duty beyond the supply; got 3"):
        DriveProgram(robot, 0.02, ROWS)


def test_volts_beyond_the_limit_of_a_motor_are_refused():
    rows = ROWS.copy()
    rows[3] = (0.0, 5.0, -6.5)
    with pytest.raises(
        InputError, match=r"volts beyond the limit of the motor; got 6\.5 V at wheel 3; expected .* 6 V"
    ):
        DriveProgram(ROBOT, 0.02, rows)
    one_weaker = ROBOT.replace(motor=ROBOT.motor.replace(voltage_limit=(6.0, 2.0, 6.0)))
    with pytest.raises(InputError, match=r"got 3 V at wheel 2; expected at most 2 V.*; take smaller volts"):
        DriveProgram(one_weaker, 0.02, ROWS)
    assert DriveProgram(ROBOT, 0.02, 2.0 * ROWS).legs  # 6 V itself


def test_rows_that_are_longer_than_a_command_acts_are_refused():
    program = DriveProgram(ROBOT, 0.2, ROWS)
    with pytest.raises(InputError, match="rows are longer than a command acts"):
        drive(program, SimulatedRobot(ROBOT))
    assert drive(program, SimulatedRobot(ROBOT, rate=5.0), limits=Limits(1.0, 1.0)).rows > 0


def test_rows_of_seconds_are_driven():
    program = DriveProgram(ROBOT, 3.0, [[0.0, 0.2, -0.2], [0.0, 0.0, 0.0]], (30.0, 30.0))
    assert drive(program, SimulatedRobot(ROBOT), limits=Limits(10.0, 10.0)).run is not None


def test_a_log_without_inputs_is_refused_and_one_of_no_time_leaves_all():
    program = axebot_program()
    with pytest.raises(InputError, match="a log without inputs"):
        rest_of(program, [omnidyn.Run(t=[0.0, 0.1], voltage=np.full((2, 3), np.nan), twist=np.zeros((2, 3)))])
    assert rest_of(program, [omnidyn.Run(t=[0.0], voltage=np.zeros((1, 3)), twist=np.zeros((1, 3)))]) is program


def test_a_supply_that_was_never_a_number_is_recorded():
    recording = DriveRecording(3)
    for k in range(3):
        recording.measured(0.1 * k, Measured(0.1 * k, 1, k, {"supply": np.array([np.nan])}))
        recording.sent(0.1 * k, Command(1, k, 0.1 * k, 0.1, (0.1, 0.1, 0.1)))
    run = recording.run("duty", "test")
    assert run is not None
    assert np.isnan(np.asarray(run.supply)).all()


@pytest.mark.parametrize("value", [np.inf, -np.inf, 1e300])
def test_a_number_that_no_sensor_gives_is_missing_and_costs_no_log(value):
    recording = DriveRecording(3)
    for k in range(3):
        speeds = np.array([1.0, value if k == 1 else 2.0, 3.0])
        recording.measured(0.1 * k, Measured(0.1 * k, 1, k, {"wheel_speed": speeds}))
        recording.sent(0.1 * k, Command(1, k, 0.1 * k, 0.1, (0.1, 0.1, 0.1)))
    run = recording.run("duty", "test")
    assert run is not None
    assert np.isnan(run.wheel_speed).tolist() == [[False] * 3, [False, True, False], [False] * 3]


@pytest.mark.parametrize("micros", ["9" * 400, "-5", str(2**32)])
def test_a_time_beyond_32_bits_is_no_line(micros):
    assert MeasuredLines(3).of(body(line(f"M,{micros},1,1,a1_rad=0"))) is None
    assert command_of(body(line(f"C,1,1,{micros},125000,0,0,0"))) is None
