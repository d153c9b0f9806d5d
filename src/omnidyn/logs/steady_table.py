"""Steady tables: one row per point at constant speed, as in Table 1 of the paper. CSV `axis,speed,force`.

Optional columns: `speed_std,force_std`; `u1_V,u2_V,...` and `i1_A,i2_A,...`, against which the forces are checked.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError
from omnidyn.logs.readers.read_table import read_table
from omnidyn.logs.table.table import FileTable
from omnidyn.model.frames import AXES
from omnidyn.statement import Statement

ALIASES = {"v": "x", "v_n": "y", "vn": "y", "w": "yaw", "omega": "yaw"}  # the paper's letters
FORCE_SOURCES = ("table", "current", "voltage")

MAX_SPEED, MAX_FORCE = 1e4, 1e6  # beyond any robot: a unit is wrong
MIN_STD = 1e-9

# Units that a row of units may give, per axis. Another unit is refused, not converted.
_UNITS = {
    "axis": {"x": {"-"}, "y": {"-"}, "yaw": {"-"}},
    "speed": {"x": {"m/s", "SI"}, "y": {"m/s", "SI"}, "yaw": {"rad/s", "SI"}},
    "force": {"x": {"N", "SI"}, "y": {"N", "SI"}, "yaw": {"N m", "N·m", "N⋅m", "N*m", "Nm", "N.m", "SI"}},
}


@dataclass(frozen=True, eq=False)
class SteadyTable:
    """Points at constant speed: what the friction balances there. What `identify` takes for logs.

    axis: "x", "y" or "yaw" of each point (v, v_n and w are taken for them). Shape (points,); one word for all will do.
    speed: along or about that axis [m/s or rad/s]. force: what drives it there [N or N m]. Shape (points,).
    speed_std, force_std: standard deviations, same units; speed_std needs force_std.
    twist: the whole twist [m/s, m/s, rad/s], shape (points, 3); None means that only `axis` moves.
    voltage [V], current [A]: of the motors, shape (points, wheels), None where not known; NaN where missing.
    force_from: "table" (measured, or said so), "current", eqs (7)-(10), or "voltage", eq (11).
    source, sha256, notes: where it comes from. lines: line of each row in the file, for messages.
    Raises InputError when a shape or a number is wrong; the message names the row, the first being row 0.
    """

    axis: Sequence[str]
    speed: FloatArray
    force: FloatArray
    speed_std: FloatArray | None = None
    force_std: FloatArray | None = None
    twist: FloatArray | None = None
    voltage: FloatArray | None = None
    current: FloatArray | None = None
    force_from: str = "table"
    source: str = ""
    sha256: str = ""
    notes: tuple[Statement | str, ...] = ()
    lines: IntArray | None = None

    def __post_init__(self) -> None:
        _set(self, "speed", _array("speed", self.speed, 1))
        count = len(self.speed)
        _set(self, "axis", self._axes(count))
        for name in ("force", "speed_std", "force_std", "twist", "voltage", "current"):
            if getattr(self, name) is not None:
                dimensions = 2 if name in ("twist", "voltage", "current") else 1
                _set(self, name, _array(name, getattr(self, name), dimensions, count))
        if not count:
            raise InputError("no rows", got="0 samples", expected="at least one point", where=self.source)
        self._check_numbers()

    def _axes(self, count: int) -> tuple[str, ...]:
        names = [self.axis] * count if isinstance(self.axis, str) else [str(name) for name in self.axis]
        if len(names) != count:
            raise InputError("wrong shape", got=f"{len(names)} axes", expected=f"{count}, one per speed", where="axis")
        return tuple(self._axis(k, name) for k, name in enumerate(names))

    def _axis(self, row: int, name: str) -> str:
        axis = ALIASES.get(name.lower(), name.lower())
        if axis not in AXES:
            raise InputError(
                "no such axis", got=name, expected="x, y or yaw (or v, v_n, w)", where=self.place(row, "axis")
            )
        return axis

    def _check_numbers(self) -> None:
        self._refuse("speed", ~(np.abs(self.speed) <= MAX_SPEED), f"a finite number up to {MAX_SPEED:g} m/s or rad/s")
        self._refuse("force", ~(np.abs(self.force) <= MAX_FORCE), f"a finite number up to {MAX_FORCE:g} N or N m")
        if self.force_std is not None:
            bad_rows = ~((self.force_std >= MIN_STD) & (self.force_std <= MAX_FORCE))
            self._refuse("force_std", bad_rows, f"a number from {MIN_STD:g} to {MAX_FORCE:g}")
        if self.speed_std is not None:
            self._refuse(
                "speed_std", ~((self.speed_std >= 0.0) & (self.speed_std <= MAX_SPEED)), "a number, 0 or above"
            )
            if self.force_std is None:
                raise InputError("speed_std without force_std", expected="both, or force_std alone", where=self.source)
        if self.force_from not in FORCE_SOURCES:
            raise InputError("unknown origin of the force", got=self.force_from, expected=", ".join(FORCE_SOURCES))

    def _refuse(self, name: str, bad_rows: BoolArray, expected: str) -> None:
        for row in np.flatnonzero(bad_rows)[:1]:
            got = float(getattr(self, name)[row])
            raise InputError("number out of range", got=got, expected=expected, where=self.place(int(row), name))

    def place(self, row: int, column: str = "") -> str:
        """Where a row stands, for messages: file:line, or row k."""
        location = f"row {row}" if self.lines is None else f"{self.source}:{self.lines[row]}"
        return f"{location}, column {column}" if column else location

    def __len__(self) -> int:
        return len(self.speed)

    @property
    def axis_index(self) -> IntArray:
        """0, 1, 2 for x, y, yaw. Shape (points,)."""
        return np.array([AXES.index(name) for name in self.axis], dtype=np.int64)

    @property
    def twists(self) -> FloatArray:
        """The twist of each point [m/s, m/s, rad/s]. Shape (points, 3)."""
        if self.twist is not None:
            return self.twist
        twist = np.zeros((len(self), 3))
        twist[np.arange(len(self)), self.axis_index] = self.speed
        return twist

    def replace(self, **changes: Any) -> SteadyTable:
        """The same points with some fields changed, checked again."""
        return replace(self, **changes)


def read_steady_table(path: str | os.PathLike) -> SteadyTable:
    """Read a steady table: CSV `axis,speed,force[,speed_std,force_std][,u1_V,...][,i1_A,...]`, axis = x | y | yaw.

    Speeds in m/s and rad/s, forces in N and N m. The paper's letters v, v_n, w are taken, with a note.
    Raises InputError with file, line and column for what cannot be used.
    """
    table = read_table(path)
    optional = ["speed_std", "force_std", *_numbered(table, "u", "V"), *_numbered(table, "i", "A")]
    table.check_names(["axis", "speed", "force"], optional)
    words = table.text("axis", "x, y or yaw")
    _check_units(table, words)
    steady = SteadyTable(
        axis=words,
        speed=table.measured("speed"),
        force=table.measured("force"),
        speed_std=table.measured("speed_std") if "speed_std" in table.names else None,
        force_std=table.measured("force_std") if "force_std" in table.names else None,
        voltage=_per_wheel(table, "u", "V"),
        current=_per_wheel(table, "i", "A"),
        source=table.source,
        sha256=table.sha256,
        lines=table.lines,
    )
    return steady.replace(notes=(*table.notes, *_alias_notes(words)))


def _numbered(table: FileTable, letter: str, unit: str) -> list[str]:
    """u1_V, u2_V, ... as far as the table has any; a gap in the numbers makes the rest unknown columns."""
    count = sum(bool(re.fullmatch(rf"{letter}[1-9]\d*_{unit}", name)) for name in table.names)
    return [f"{letter}{k + 1}_{unit}" for k in range(count)]


def _per_wheel(table: FileTable, letter: str, unit: str) -> FloatArray | None:
    names = _numbered(table, letter, unit)
    return np.stack([table.measured(name, missing=True) for name in names], axis=1) if names else None


def _alias_notes(words: Sequence[str]) -> list[str]:
    aliases = [word for word in ALIASES if word in {word.lower() for word in words}]
    return [f"axis {word} was read as {ALIASES[word]}" for word in aliases]


def _check_units(table: FileTable, words: Sequence[str]) -> None:
    """A row of units must say what is expected for the axes in the table."""
    axes = {ALIASES.get(word.lower(), word.lower()) for word in words} & set(AXES)
    for name, unit in table.units.items():
        ending = {name.rpartition("_")[2]}  # u1_V
        per_axis = _UNITS.get(name.removesuffix("_std"), {axis: ending for axis in AXES})
        expected = set().union(*(per_axis[axis] for axis in axes)) if axes else {unit}
        if unit not in expected:
            raise InputError(
                "the row of units names another unit",
                got=unit,
                expected=" or ".join(sorted(expected)),
                remedy="convert the column",
                where=f"{table.source}, column {name}",
            )


def _set(table: SteadyTable, name: str, value: Any) -> None:
    object.__setattr__(table, name, value)


def _array(name: str, value: ArrayLike, dimensions: int, count: int | None = None) -> FloatArray:
    """A read-only float64 copy of the right shape."""
    try:
        array = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError("not numbers", got=value, expected="an array of numbers", where=name) from None
    shape = {1: "(points,)", 2: "(points, 3)" if name == "twist" else "(points, wheels)"}[dimensions]
    bad_shape = array.ndim != dimensions or (name == "twist" and array.shape[-1] != 3)
    if bad_shape or (count is not None and len(array) != count):
        expected = shape if count is None else f"{shape} with {count} points"
        raise InputError("wrong shape", got=array.shape, expected=expected, where=name)
    array.flags.writeable = False
    return array
