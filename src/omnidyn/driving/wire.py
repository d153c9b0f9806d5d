r"""Commands and measurements as lines of text, which a terminal shows and a microcontroller reads.

    C,SESSION,NUMBER,SENT_US,HOLD_US,INPUT,..*HH      a command: times in microseconds of the sender's clock
    S,SESSION*HH                                      motors off
    M,T_US,SESSION,NUMBER,COLUMN=VALUE,..*HH          a measurement: columns as in a run file, w1_rad_s=1.5

HH are two hexadecimal digits: all characters before the star, combined by exclusive or. A line with others is dropped.
Times are whole numbers below 2^32, which begin again at 0 there.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import reduce

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.connection import Command, Measured
from omnidyn.logs.run_file import columns_of
from omnidyn.sensors import CHANNELS, WHEEL

MICROS, WRAP = 1e6, 1 << 32
LONGEST = 2000  # characters of a line
MOST_BYTES = 1 << 16  # that are read at once: a stream without an end is left for the next time
COMMAND, STOP, MEASURED = "C", "S", "M"


def line(text: str) -> bytes:
    """A line with its check."""
    return f"{text}*{_check(text)}\n".encode("ascii")


def body(data: bytes) -> list[str] | None:
    """The fields of a line; None for one that did not arrive whole."""
    text, star, check = data.decode("ascii", errors="replace").strip().rpartition("*")
    return text.split(",") if star and check.upper() == _check(text) else None


def _check(text: str) -> str:
    return f"{reduce(lambda total, letter: total ^ ord(letter), text, 0) & 0xFF:02X}"


def command_line(command: Command) -> bytes:
    """A command as a line."""
    inputs = ",".join(f"{value:.7g}" for value in command.inputs)
    times = f"{round(command.sent * MICROS) % WRAP},{round(command.hold * MICROS)}"
    return line(f"{COMMAND},{command.session},{command.number},{times},{inputs}")


def stop_line(session: int) -> bytes:
    """Motors off, as a line."""
    return line(f"{STOP},{session}")


class MeasuredLines:
    """Measurements from lines. A clock that begins again at 2^32 us goes on; columns are brought into channels."""

    def __init__(self, wheels: int) -> None:
        self._columns: Mapping[str, list[str]] = {
            channel: columns_of(channel, wheels if kind == WHEEL else 1) for channel, kind in CHANNELS.items()
        }
        self._before: int | None = None
        self._turns = 0

    def of(self, fields: list[str] | None) -> Measured | None:
        """The measurement in the fields of a line; None where it holds none."""
        if fields is None or fields[0] != MEASURED or len(fields) < 4:
            return None
        try:
            micros, session, number = map(int, fields[1:4])
            if not 0 <= micros < WRAP:
                return None
            cells = {name: float(value) for name, _, value in (cell.partition("=") for cell in fields[4:])}
        except ValueError:
            return None
        if self._before is not None and self._before - micros > WRAP // 2:
            self._turns += 1
        self._before = micros
        channels: dict[str, FloatArray] = {
            channel: np.array([cells[name] for name in names])
            for channel, names in self._columns.items()
            if all(name in cells for name in names)
        }
        return Measured((micros + self._turns * WRAP) / MICROS, session, number, channels)


class Lines:
    """Whole lines from pieces of a stream."""

    def __init__(self, read: Callable[[], bytes]) -> None:
        self._read, self._rest = read, b""

    def new(self) -> list[bytes]:
        """Those that are complete by now."""
        complete, read = list[bytes](), 0
        while read < MOST_BYTES and (data := self._read()):
            read += len(data)
            *lines, rest = (self._rest + data).split(b"\n")
            complete += lines
            self._rest = rest[-LONGEST:]
        return complete
