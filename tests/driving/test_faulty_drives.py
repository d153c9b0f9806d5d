"""A robot that misbehaves gets no command after a stop; a healthy one drives to the end. No second passes: the clock is
simulated."""

import numpy as np
import pytest

from omnidyn import sample
from omnidyn.driving.clock import SimulatedClock
from omnidyn.driving.drive import drive
from omnidyn.driving.guard import Limits
from omnidyn.driving.program import DriveProgram
from omnidyn.driving.simulated import FAULTS, Fault, SimulatedRobot
from tests.support.faulty_drives import DT, axebot_program, driven, random_fault, with_battery

DEAD_MAN = 0.25
OFF = {f"friction.axes.{kind}[{axis}]": (0.7, 1.3) for kind in ("viscous", "coulomb") for axis in range(3)}
OFF["motor.resistance_ohm"] = (0.7, 1.3)

PROGRAM = axebot_program()


def robots(count):
    return list(sample(PROGRAM.robot, count, 1, factors=OFF))


def check_faults(count):
    """No motor gets anything later than the dead-man time after the last command that was sent."""
    rng, drawn = np.random.default_rng(2), robots(20)
    drives = [driven(PROGRAM, drawn[k % 20], rng, random_fault(rng, PROGRAM.seconds)) for k in range(count)]
    assert {each.kind for each in drives} == set(FAULTS)
    assert max(each.after for each in drives) <= DEAD_MAN
    stopped = [each for each in drives if each.record.stopped is not None]
    assert len(stopped) > 0.85 * count
    for each in stopped:
        sent = np.asarray(each.record.run.voltage) if each.record.run is not None else np.zeros(0)
        assert len(sent) == 0 or each.record.rows < len(PROGRAM.inputs)


def check_healthy(count):
    """Robots 30 % off, with all sensors and lines of up to 30 ms, drive all of it."""
    rng = np.random.default_rng(3)
    drives = [driven(PROGRAM, robot, rng).record for robot in robots(count)]
    assert [str(record.verdict) for record in drives if not record.is_complete] == []


def test_no_command_after_a_stop():
    check_faults(30)


def test_healthy_robots_drive_to_the_end():
    check_healthy(12)


@pytest.mark.long
def test_no_command_after_a_stop_of_a_thousand_faults():
    check_faults(1000)


@pytest.mark.long
def test_fifty_of_fifty_healthy_robots_drive_to_the_end():
    check_healthy(50)


@pytest.mark.parametrize(
    "fault, codes",
    [
        (Fault("deaf", 1.0), {"drive_late"}),
        (Fault("mute", 1.0), {"drive_silent"}),
        (Fault("late", 1.0, 0.6), {"drive_late", "drive_silent"}),
        (Fault("reset", 1.0), {"drive_silent", "drive_reset"}),
        (Fault("clock", 1.0, 2.0), {"drive_clock"}),
        (Fault("clock", 1.0, -2.0), {"drive_clock"}),
        (Fault("halts", 0.1), {"drive_stuck"}),
        (Fault("reversed", 0.0, 0.0, 1), {"drive_wrong_way"}),
        (Fault("stuck", 0.0, 0.0, 1), {"drive_stuck"}),
        (Fault("supply", 1.0, 7.0), {"drive_supply"}),
        (Fault("pushed", 1.0, 30.0), {"drive_border", "drive_wrong_way", "drive_stuck"}),
    ],
    ids=lambda value: value.kind if isinstance(value, Fault) else "",
)
def test_each_fault_is_named(fault, codes):
    clock = SimulatedClock()
    noise = {"wheel_angle": np.full(3, 0.003)}
    robot = SimulatedRobot(with_battery(PROGRAM.robot), noise, clock=clock, rate=1.0 / DT, faults=[fault])
    record = drive(PROGRAM, robot, clock=clock, limits=Limits(supply=9.0))
    assert record.stopped is not None
    assert record.stopped.code in codes
    assert str(record.verdict)
    assert record.stopped.remedy_text


def test_a_wheel_that_spins_while_the_body_stands_is_slip():
    clock = SimulatedClock()
    noise = {"wheel_speed": np.full(3, 0.05), "pose": np.full(3, 0.001)}

    class OnIce(SimulatedRobot):
        def receive(self):
            return [
                one._replace(channels={**one.channels, "pose": np.zeros(3)}) if one.t > 0.2 else one
                for one in super().receive()
            ]

    record = drive(PROGRAM, OnIce(PROGRAM.robot, noise, clock=clock, rate=1.0 / DT), clock=clock)
    assert record.stopped is not None
    assert record.stopped.code == "drive_slip"


def test_nobody_answers():
    clock = SimulatedClock()
    robot = SimulatedRobot(PROGRAM.robot, {"twist": np.full(3, 0.01)}, clock=clock, faults=[Fault("mute", 0.0)])
    record = drive(PROGRAM, robot, clock=clock)
    assert record.stopped is not None
    assert (record.stopped.code, record.run, record.rows) == ("drive_no_answer", None, 0)


def test_a_slow_line_is_refused_before_anything_moves():
    clock = SimulatedClock()
    robot = SimulatedRobot(PROGRAM.robot, {"twist": np.full(3, 0.01)}, clock=clock, rate=1.0 / DT, delay=0.1)
    record = drive(PROGRAM, robot, clock=clock)
    assert record.stopped is not None
    assert record.stopped.code == "drive_slow_line"
    assert robot.last_driven == -np.inf


def test_a_broken_line_and_a_hand_stop_keep_the_log():
    for error, code in ((OSError(5, "gone"), "drive_line_broke"), (KeyboardInterrupt(), "drive_by_hand")):
        clock = SimulatedClock()

        class Breaks(SimulatedRobot):
            def send(self, command, error=error):
                if self.clock.now() > 2.0:
                    raise error
                super().send(command)

        robot = Breaks(PROGRAM.robot, {"twist": np.full(3, 0.01)}, clock=clock, rate=1.0 / DT)
        record = drive(PROGRAM, robot, clock=clock)
        assert record.stopped is not None
        assert record.run is not None
        assert (record.stopped.code, len(record.run)) == (code, pytest.approx(84, abs=4))
        clock.sleep_until(clock.now() + 2.0)
        robot.receive()
        assert robot.last_driven - record.stopped_at <= DEAD_MAN


@pytest.mark.parametrize("seed", range(4))
def test_the_noise_of_a_camera_is_no_slip(seed):
    robot = PROGRAM.robot
    rows = np.concatenate([np.zeros((60, 3)), 0.4 * PROGRAM.inputs])
    noise = {"wheel_angle": (2.0 * np.pi / 2048.0,) * 3, "pose": (0.006, 0.006, 0.005)}
    record = drive(DriveProgram(robot, DT, rows), SimulatedRobot(robot, noise, seed=seed))
    assert record.stopped is None, record.verdict


def slow_ramps(top, seconds):
    """Ramps along each axis, both ways, as a plan begins; then steps of nearly all volts."""
    count = round(seconds / DT)
    up = np.concatenate([np.linspace(0.0, top, count), np.linspace(top, 0.0, count)])
    rows = [np.zeros((10, 3))]
    for shape in (up, np.full(25, 5.5)):
        for pattern in ([0.0, 1.0, -1.0], [-1.0, 0.5, 0.5], [1.0, 1.0, 1.0]):
            leg = np.concatenate([np.outer(shape, pattern), np.zeros((20, 3))])
            rows += [leg, -leg]
    return DriveProgram(PROGRAM.robot, DT, np.concatenate(rows), (30.0, 30.0))


@pytest.mark.parametrize("wheel", range(3))
def test_a_stuck_wheel_is_seen_on_a_slow_ramp_before_the_fast_steps(wheel):
    """1.6 s went by behind half a radian before, and 25 s where the first ramps are lower."""
    program = slow_ramps(2.5, 3.0)
    turned = DT * np.cumsum(np.abs(program.predicted.wheel_speed[:, wheel]))
    robot = SimulatedRobot(
        PROGRAM.robot, {"wheel_angle": np.full(3, 0.003)}, rate=1.0 / DT, faults=[Fault("stuck", 0.0, 0.0, wheel)]
    )
    record = drive(program, robot)
    assert record.stopped is not None
    assert (record.stopped.code, record.stopped.numbers["wheel"]) == ("drive_stuck", wheel + 1)
    assert record.rows * DT - DT * np.argmax(turned > 0.5) < 1.2


def test_healthy_robots_drive_slow_ramps_to_the_end(draws):
    for k, robot in enumerate(robots(draws(6))):
        for program in (slow_ramps(1.5, 2.0), slow_ramps(2.5, 3.0)):
            simulated = SimulatedRobot(robot, {"wheel_speed": np.full(3, 0.1)}, rate=1.0 / DT, seed=k)
            record = drive(program, simulated)
            assert record.is_complete, record.verdict
