"""Lines of text, and robots behind them: UDP on this machine, standard output, a serial port that is a pseudo-terminal.

The clock is simulated: each step of the drive lets the robot at the other end take what was sent, so nothing waits.
"""

import os
import select
import socket
import string
import sys
import types

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from omnidyn.driving import senders
from omnidyn.driving.clock import SimulatedClock
from omnidyn.driving.connection import Command, Measured
from omnidyn.driving.drive import drive
from omnidyn.driving.senders import sender
from omnidyn.driving.simulated import SimulatedRobot
from omnidyn.driving.wire import Lines, MeasuredLines, body, command_line, line, stop_line
from omnidyn.errors import InputError, MissingExtraError
from tests.support.faulty_drives import DT, axebot_program
from tests.support.wire_robot import command_of, measured_line

PROGRAM = axebot_program()
COMMAND = Command(7, 3, 1.25, 0.125, (1.5, -2.25, 0.0))


def test_a_command_as_the_documentation_has_it():
    assert command_line(COMMAND) == b"C,7,3,1250000,125000,1.5,-2.25,0*77\n"
    assert command_of(body(command_line(COMMAND))) == COMMAND
    assert stop_line(7) == b"S,7*48\n"
    nmea = "GPGLL,5300.97914,N,00259.98174,E,125926,A"  # a printed example of this check, which GPS receivers have
    assert line(nmea).endswith(b"*28\n")


def test_a_measurement_comes_back():
    measured = Measured(1.5, 7, 3, {"wheel_speed": np.array([1.0, -2.0, 0.5]), "supply": np.array([11.9])})
    text = measured_line(measured)
    assert b"w1_rad_s=1,w2_rad_s=-2,w3_rad_s=0.5,supply_V=11.9" in text
    found = MeasuredLines(3).of(body(text))
    assert found is not None
    assert found[:3] == measured[:3]
    np.testing.assert_array_equal(found.channels["wheel_speed"], measured.channels["wheel_speed"])
    assert found.channels["supply"].tolist() == [11.9]


def test_a_clock_of_microseconds_that_begins_again_goes_on():
    lines = MeasuredLines(3)
    times = [
        lines.of(body(line(f"M,{micros % 2**32},1,1"))) for micros in (2**32 - 100, 2**32 + 100, 2**32 + 2_000_000_000)
    ]
    assert [round(one.t * 1e6) for one in times if one] == [2**32 - 100, 2**32 + 100, 2**32 + 2_000_000_000]


@given(st.integers(0, 34), st.sampled_from(string.printable))
def test_one_wrong_letter_is_no_command(place, letter):
    text = bytearray(command_line(COMMAND))
    if chr(text[place]) == letter or place >= len(text) - 1:
        return
    text[place] = ord(letter)
    found = command_of(body(bytes(text)))
    assert found is None or found == COMMAND  # a small digit is one too


def test_lines_from_any_pieces():
    data, pieces = command_line(COMMAND) * 3, []
    for size in (1, 7, 40, 1000):
        pieces += [data[:size], b""]
        data = data[size:]
    queue = iter(pieces)
    lines = Lines(lambda: next(queue, b""))
    assert [command_of(body(one)) for _ in range(4) for one in lines.new()] == [COMMAND] * 3


class FarRobot:
    """A simulated robot at the other end of a line: `pump` lets it take and say all it can by now."""

    def __init__(self, read, write):
        self.clock = PumpedClock(self.pump)
        noise = {"wheel_speed": np.full(3, 0.05), "pose": np.full(3, 0.002)}
        self.robot = SimulatedRobot(PROGRAM.robot, noise, clock=self.clock, rate=1.0 / DT)
        self.lines, self.write, self.stops = Lines(read), write, 0
        self.robot.open()

    def pump(self):
        for data in self.lines.new():
            fields = body(data)
            command = command_of(fields)
            if command is not None:
                self.robot.send(command)
            elif fields is not None and fields[0] == "S":
                self.robot.stop()
                self.stops += 1
        for measured in self.robot.receive():
            self.write(measured_line(measured))


class PumpedClock(SimulatedClock):
    """Before time goes on, and when it has, the other end does what it can."""

    def __init__(self, pump):
        super().__init__()
        self.pump = pump

    def sleep_until(self, due):
        self.pump()
        super().sleep_until(due)
        self.pump()


def of_pipe(number):
    return lambda: os.read(number, 1 << 16) if select.select([number], [], [], 0.0)[0] else b""


def check(place, far):
    record = drive(PROGRAM, sender(place, 3), clock=far.clock)
    far.pump()
    assert record.is_complete, str(record.verdict)
    assert record.run is not None
    np.testing.assert_allclose(np.asarray(record.run.pose)[-1], PROGRAM.predicted.pose[-1], atol=0.05)
    assert far.stops == 3


def test_over_udp():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot:
        robot.bind(("127.0.0.1", 0))
        robot.setblocking(False)
        whom = [None]

        def read():
            try:
                data, whom[0] = robot.recvfrom(1 << 16)
            except BlockingIOError:
                return b""
            return data

        check(f"udp:127.0.0.1:{robot.getsockname()[1]}", FarRobot(read, lambda data: robot.sendto(data, whom[0])))


def test_over_standard_output(monkeypatch):
    (from_robot, to_drive), (from_drive, to_robot) = os.pipe(), os.pipe()
    try:
        monkeypatch.setattr(sys, "stdin", types.SimpleNamespace(fileno=lambda: from_robot))
        monkeypatch.setattr(sys, "stdout", types.SimpleNamespace(fileno=lambda: to_robot))
        check("-", FarRobot(of_pipe(from_drive), lambda data: os.write(to_drive, data)))
    finally:
        for number in (from_robot, to_drive, from_drive, to_robot):
            os.close(number)


@pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals on this system")
def test_over_a_serial_port():
    pytest.importorskip("serial", reason="pyserial is not installed")
    master, slave = os.openpty()
    try:
        check(f"serial:{os.ttyname(slave)}", FarRobot(of_pipe(master), lambda data: os.write(master, data)))
    finally:
        os.close(master)
        os.close(slave)


def test_a_serial_port_without_pyserial_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "serial", None)
    with pytest.raises(MissingExtraError, match=r'pip install "omnidyn\[serial\]"'):
        sender("serial:/dev/ttyUSB0", 3)


def test_a_serial_port_that_is_not_there(monkeypatch):
    def no_port(*_, **__):
        raise OSError(2, "no such port")

    monkeypatch.setitem(sys.modules, "serial", types.SimpleNamespace(Serial=no_port))
    with pytest.raises(InputError, match="cannot open the serial port"):
        sender("serial:/dev/nothing:9600", 3).open()


@pytest.mark.parametrize("place", ["tcp:x:1", "udp:host", "udp:host:0", "", "serial"])
def test_other_places_are_refused(place):
    with pytest.raises(InputError, match="expected"):
        sender(place, 3)


def test_closed_streams_are_said(monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(InputError, match="standard input or output is closed"):
        senders.sender("-", 3).open()


def test_a_stream_without_an_end_is_left_for_the_next_time():
    lines = Lines(lambda: b"\0" * 1000)
    assert lines.new() == lines.new() == []
    pieces = iter([b"one\ntw", b"o\n", b""])
    assert Lines(lambda: next(pieces)).new() == [b"one", b"two"]


@pytest.mark.skipif(sys.platform == "win32", reason="a pipe of Windows cannot be asked")
def test_a_standard_output_that_nobody_reads_is_not_waited_for(monkeypatch):
    (nothing, source), (reader, target) = os.pipe(), os.pipe()
    monkeypatch.setattr(sys, "stdin", types.SimpleNamespace(fileno=lambda: nothing))
    monkeypatch.setattr(sys, "stdout", types.SimpleNamespace(fileno=lambda: target))
    robot = sender("-", 3)
    robot.open()
    try:
        for _ in range(5000):  # more than a pipe holds
            robot.send(COMMAND)
        robot.close()
        assert os.read(reader, 1 << 20).count(b"\n") < 5000
    finally:
        for end in (nothing, source, reader, target):
            os.close(end)
