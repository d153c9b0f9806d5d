"""Tables of the steady speeds of motors, one row per point, without a time: CSV `input,speed[,motor]`.

The input is told by its column: `voltage_V`, `duty` (0 to 1), `duty_%`, `pwm_%`, `current_A`, or `input` in
whatever units it has. The speed is in rad/s, or `speed_rpm`, `rpm`. motor: counted from 1; all rows are one motor
without it.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.statement import Statement

# column -> (kind, unit, size of one in that unit)
_INPUTS: dict[str, tuple[str, str, float]] = {
    "input": ("input", "units", 1.0),
    "voltage": ("voltage", "V", 1.0),
    "voltage_v": ("voltage", "V", 1.0),
    "input_v": ("voltage", "V", 1.0),
    "u_v": ("voltage", "V", 1.0),
    "u1_v": ("voltage", "V", 1.0),
    "duty": ("duty", "%", 100.0),
    "duty_%": ("duty", "%", 1.0),
    "pwm_%": ("duty", "%", 1.0),
    "input_%": ("duty", "%", 1.0),
    "d1_duty": ("duty", "%", 100.0),
    "input_duty": ("duty", "%", 100.0),
    "current": ("current", "A", 1.0),
    "current_a": ("current", "A", 1.0),
    "input_a": ("current", "A", 1.0),
}
_RPM = 2.0 * math.pi / 60.0
_SPEEDS = {"speed": 1.0, "speed_rad_s": 1.0, "w_rad_s": 1.0, "w1_rad_s": 1.0, "rpm": _RPM, "speed_rpm": _RPM}
# Of a column `input`, by a row of units
_UNITS = {"V": "input_v", "%": "input_%", "A": "input_a", "duty": "input_duty"}
_SPEED_UNITS = {"rad/s": 1.0, "SI": 1.0, "rpm": _RPM}
MOTOR = "motor"
MOST_DUTY = 1.0
LOG_ROWS, LOG_STEP = 200, 0.1  # more rows, closer to each other (of the spread of all), are samples in time ..
SWEEPS, SURELY_LOG = 2, 1000  # .. where the input turns more often than up and down once, or rows are so many


@dataclass(frozen=True, eq=False)
class MotorTable:
    """Points at steady speed. put_in [unit], speed [rad/s], motor: its number from 0; shape (points,).

    kind, unit: of the input. run: the stretch of a log to which a point belongs, None of a table, whose rows have no
    order. source, sha256, notes: where it comes from.
    """

    put_in: FloatArray
    speed: FloatArray
    motor: IntArray
    kind: str
    unit: str
    run: IntArray | None = None
    source: str = ""
    sha256: str = ""
    notes: tuple[Statement | str, ...] = ()

    def __post_init__(self) -> None:
        lengths = {len(self.put_in), len(self.speed), len(self.motor)}
        if len(lengths) > 1:
            raise InputError(
                "columns of different lengths", got=sorted(lengths), expected="one point a row", where=self.source
            )

    def __len__(self) -> int:
        return len(self.speed)


def is_motor_table(names: Iterable[str]) -> bool:
    """Whether a table is one of inputs and steady speeds, told by the names of its columns: no time, nothing else."""
    lower = [_bare(name) for name in names]
    kinds = [sum(name in kind_names for name in lower) for kind_names in (_INPUTS, _SPEEDS, (MOTOR,))]
    return kinds[:2] == [1, 1] and sum(kinds) == len(lower) and len(lower) > 1


def _bare(name: str) -> str:
    """A name in small letters; "speed [rpm]" and "speed (rpm)" are speed_rpm."""
    words = name.strip().lower().replace("[", " ").replace("(", " ").replace("]", " ").replace(")", " ")
    return re.sub(r"_(?:pct|percent)$", "_%", "_".join(words.replace("/", "_").split()))


def read_motor_table(path: str | os.PathLike) -> MotorTable:
    """Read a table `input,speed[,motor]`. Raises InputError with file, line and column for what cannot be used."""
    table = read_table(path)
    columns = {_bare(name): name for name in table.names}
    if not is_motor_table(table.names):
        raise InputError(
            "not a table of motors",
            got=", ".join(table.names),
            expected="input,speed[,motor]",
            remedy="name the columns so, or voltage_V, duty_%, speed_rpm",
            where=table.source,
        )
    input_name = next(name for name in columns if name in _INPUTS)
    kind, unit, size = _INPUTS[
        _UNITS.get(table.units.get(columns[input_name], ""), input_name) if input_name == "input" else input_name
    ]
    put_in, notes = table.measured(columns[input_name]) * size, table.notes
    if unit == "%" and size == 100.0 and np.abs(put_in).max(initial=0.0) > 100.0 * MOST_DUTY:
        put_in, notes = put_in / size, (*notes, f"{columns[input_name]} goes beyond 1: it was read as percent")
    fast = next(name for name in columns if name in _SPEEDS)
    speed = table.measured(columns[fast]) * _speed_size(table, columns[fast], fast)
    motor = _motors(table, columns[MOTOR]) if MOTOR in columns else np.zeros(len(speed), dtype=np.int64)
    _refuse_log(put_in, speed, motor, table.source)
    rows = f"{len(speed)} rows without a time are taken as points at steady speed; of a log, give its `rate`"
    notes = (rows, *notes)
    return MotorTable(put_in, speed, motor, kind, unit, source=table.source, sha256=table.sha256, notes=notes)


def _refuse_log(put_in: FloatArray, speed: FloatArray, motor: IntArray, source: str) -> None:
    """Raises InputError where rows follow each other as samples in time do: many, close, under an input that swings."""
    steps, spread = np.abs(np.diff(speed)), float(np.std(speed))
    turns = np.diff(put_in)
    swings = int((np.diff(np.sign(turns[turns != 0.0])) != 0.0).sum())
    dense = len(speed) >= LOG_ROWS and float(np.median(steps)) < LOG_STEP * spread
    if dense and (swings > SWEEPS or len(speed) >= SURELY_LOG) and not motor.any():
        raise InputError(
            "a log without a time, and no table of steady points",
            got=f"{len(speed)} rows that follow each other",
            expected="a row for each steady point",
            remedy="say how many rows a second: `rate` HZ",
            where=source,
        )


def _speed_size(table: FileTable, name: str, bare: str) -> float:
    """rad/s in one unit of the column."""
    unit = table.units.get(name, "")
    if bare != "speed" or not unit:
        return _SPEEDS[bare]
    if unit not in _SPEED_UNITS:
        raise InputError(
            "the row of units names another unit",
            got=unit,
            expected="rad/s or rpm",
            remedy="convert the column",
            where=f"{table.source}, column {name}",
        )
    return _SPEED_UNITS[unit]


def _motors(table: FileTable, name: str) -> IntArray:
    """Numbers from 0."""
    numbers = table.measured(name)
    bad_rows = np.flatnonzero((numbers < 1.0) | (numbers != np.round(numbers)) | (numbers > 1000.0))
    if bad_rows.size:
        raise table.fault(int(bad_rows[0]), name, "no number of a motor", float(numbers[bad_rows[0]]), "1, 2, 3, ...")
    return numbers.astype(np.int64) - 1
