"""The robot's end of a line: commands read from lines, measurements written as lines."""

import math

from omnidyn.driving.connection import Command
from omnidyn.driving.wire import COMMAND, MEASURED, MICROS, WRAP, line
from omnidyn.logs.run_file import columns_of


def command_of(fields):
    """The command in the fields of a line; None where it holds none."""
    if fields is None or fields[0] != COMMAND or len(fields) < 6:
        return None
    try:
        session, number, sent, hold = map(int, fields[1:5])
        inputs = tuple(map(float, fields[5:]))
    except ValueError:
        return None
    if not all(map(math.isfinite, inputs)) or not (0 <= sent < WRAP and 0 <= hold < WRAP):
        return None
    return Command(session, number, sent / MICROS, hold / MICROS, inputs)


def measured_line(measured):
    """A measurement as a line."""
    cells = [
        f"{name}={value:.7g}"
        for channel, values in measured.channels.items()
        for name, value in zip(columns_of(channel, len(values)), values.tolist(), strict=True)
    ]
    micros = round(measured.t * MICROS) % WRAP
    return line(",".join([MEASURED, str(micros), str(measured.session), str(measured.number), *cells]))
