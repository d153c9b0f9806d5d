"""Senders: robots that take the lines of `wire`, over standard output, UDP or a serial port."""

from __future__ import annotations

import os
import select
import socket
import sys
from collections.abc import Callable
from typing import Any

from omnidyn.driving.connection import Command, Measured
from omnidyn.driving.wire import MOST_BYTES, Lines, MeasuredLines, body, command_line, stop_line
from omnidyn.errors import InputError, MissingExtraError

STDOUT, UDP, SERIAL = "-", "udp:", "serial:"
BAUD = 115200


class LineConnection:
    """A robot behind lines of text. A `RobotConnection`.

    wheels: of the robot. opened: gives read (what came, b"" for nothing, at once), write and close.
    """

    def __init__(
        self, wheels: int, opened: Callable[[], tuple[Callable[[], bytes], Callable[[bytes], Any], Callable[[], Any]]]
    ) -> None:
        self._wheels, self._opened, self._session = wheels, opened, 0
        self._write: Callable[[bytes], Any] | None = None

    def open(self) -> None:
        """Open the line. Raises InputError where it cannot be opened."""
        read, self._write, self._end = self._opened()
        self._lines, self._measured = Lines(read), MeasuredLines(self._wheels)

    def send(self, command: Command) -> None:
        """A command as a line."""
        self._session = command.session
        self._written(command_line(command))

    def receive(self) -> list[Measured]:
        """What came; lines that hold no measurement are dropped."""
        found = (self._measured.of(body(data)) for data in self._lines.new())
        return [measured for measured in found if measured is not None]

    def stop(self) -> None:
        """Motors off; three times, for a line may be lost."""
        for _ in range(3):
            self._written(stop_line(self._session))

    def close(self) -> None:
        """Let go of the line."""
        if self._write is not None:
            self._write = None
            self._end()

    def _written(self, data: bytes) -> None:
        if self._write is not None:
            self._write(data)


def sender(place: str, wheels: int) -> LineConnection:
    """The robot at a place: "-" (standard output and input), "udp:HOST:PORT" or "serial:PORT", "serial:PORT:BAUD".

    Raises InputError for another place, MissingExtraError for a serial port without pyserial.
    """
    if place == STDOUT:
        return LineConnection(wheels, _open_streams)
    if place.startswith(UDP):
        host, _, port = place.removeprefix(UDP).rpartition(":")
        if not port.isdigit() or not 0 < int(port) < 65536:
            raise InputError("not an address", got=place, expected="udp:HOST:PORT, such as udp:192.168.4.1:9870")
        return LineConnection(wheels, lambda: _open_udp(host or "127.0.0.1", int(port)))
    if place.startswith(SERIAL):
        port, _, baud = place.removeprefix(SERIAL).rpartition(":")
        if not port or not baud.isdigit():
            port, baud = place.removeprefix(SERIAL), str(BAUD)
        import_serial()
        return LineConnection(wheels, lambda: _open_serial(port, int(baud)))
    raise InputError("not a robot to send to", got=place, expected="-, udp:HOST:PORT or serial:PORT")


def import_serial() -> Any:
    """The module of pyserial. Raises MissingExtraError without it."""
    try:
        import serial
    except ImportError:
        raise MissingExtraError(
            "a serial port needs pyserial", remedy='pip install "omnidyn[serial]"', where="serial"
        ) from None
    return serial


def _open_streams() -> tuple[Callable[[], bytes], Callable[[bytes], Any], Callable[[], Any]]:
    if sys.stdin is None or sys.stdout is None:
        raise InputError("standard input or output is closed", expected="measurements on one, commands on the other")
    source, target = sys.stdin.fileno(), sys.stdout.fileno()

    def read() -> bytes:
        return os.read(source, MOST_BYTES) if select.select([source], [], [], 0.0)[0] else b""

    def write(data: bytes) -> None:
        if select.select([], [target], [], 0.0)[1]:  # else nobody reads: the guard sees what comes of it
            os.write(target, data)

    return read, write, lambda: None


def _open_udp(host: str, port: int) -> tuple[Callable[[], bytes], Callable[[bytes], Any], Callable[[], Any]]:
    try:
        kind, address = next(
            (family, address) for family, _, _, _, address in socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
        )
        line = socket.socket(kind, socket.SOCK_DGRAM)
        line.connect(address)
    except OSError as error:
        raise InputError(
            "cannot send there", got=f"udp:{host}:{port}: {error.strerror or error}", expected="a robot of this network"
        ) from None
    line.setblocking(False)

    def read() -> bytes:
        try:
            return line.recv(MOST_BYTES) + b"\n"
        except (BlockingIOError, ConnectionRefusedError):  # nothing, or nobody listens yet
            return b""

    def write(data: bytes) -> None:
        try:
            line.send(data)
        except (BlockingIOError, ConnectionRefusedError):  # the guard sees what comes of it
            return

    return read, write, line.close


def _open_serial(port: str, baud: int) -> tuple[Callable[[], bytes], Callable[[bytes], Any], Callable[[], Any]]:
    serial = import_serial()
    try:
        line = serial.Serial(port, baud, timeout=0.0, write_timeout=0.1)
    except (OSError, ValueError) as error:  # SerialException is an OSError
        raise InputError(
            "cannot open the serial port", got=f"{port}: {error}", expected="a port of this machine"
        ) from None
    return lambda: line.read(MOST_BYTES), line.write, line.close
