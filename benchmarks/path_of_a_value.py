"""The path of a value through the package: which functions hold it on its way from a call to its result.

python -m benchmarks path_of_a_value

of a voltage, from `omnidyn.simulate(robot, voltage, dt)` to the Run; of a cell of a CSV file, from
`omnidyn.read_log(path, robot)` to the Run.

A function holds a value if the value is one of its arguments or local variables, or what it returns. Code that numba
compiled is not seen: a kernel counts with the function that calls it, as a comprehension does.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import numpy as np

import omnidyn
from benchmarks.table import Table
from tests.house.test_import_direction import FLOORS

PACKAGE = Path(omnidyn.__file__).parent
Holds = Callable[[Any], bool]
GOAL_STAYS, GOAL_CLIMBS = 8, 1  # of a voltage
GOAL_STAYS_OF_CELL, GOAL_CLIMBS_OF_CELL = 45, 5
DIGITS = 3.0123456789  # that nothing else has: a copy of an array is found too
_COMPREHENSION = re.compile(r"\.<(?:locals|listcomp|genexpr|dictcomp|setcomp)>")


class Place(NamedTuple):
    """A function: its file below the package, and its name there."""

    file: str
    function: str

    @property
    def room(self) -> str:
        """The folder of a file; a file at the top of the package is a room of its own."""
        folder, _, name = self.file.rpartition("/")
        return folder or name.removesuffix(".py")

    @property
    def floor(self) -> int:
        """The lower the number, the higher the floor; what is no floor, as `__init__`, is the ground."""
        first = self.room.split("/")[0]
        return FLOORS.index(first) if first in FLOORS else len(FLOORS)


@dataclass
class Trail:
    """Where a value was, each function and each pair of functions once, in the order of time.

    stays: functions that held it. calls: (caller, called), both of which held it. returns: (called, caller), where
    what came back held it.
    """

    stays: list[Place] = field(default_factory=list)
    calls: list[tuple[Place, Place]] = field(default_factory=list)
    returns: list[tuple[Place, Place]] = field(default_factory=list)

    @property
    def rooms(self) -> list[str]:
        """Folders of the functions."""
        return list(dict.fromkeys(place.room for place in self.stays))

    @property
    def climbs(self) -> list[tuple[Place, Place]]:
        """Calls into a room of a floor that stands above the caller's."""
        return [(caller, called) for caller, called in self.calls if called.floor < caller.floor]


def shows_number(number: float, text: str) -> Holds:
    """Whether a value is a number, a text that has its digits, or an array or a list that has it as an item.

    Take a number whose digits nothing else has.
    """
    raw = text.encode()

    def holds(value: Any) -> bool:
        if isinstance(value, float):
            return value == number
        if isinstance(value, str):
            return text in value
        if isinstance(value, bytes | bytearray):
            return raw in value
        if isinstance(value, np.ndarray):
            if value.dtype.kind == "S":
                return bool(np.any(value == raw))
            return value.dtype.kind == "f" and bool(np.any(value == number))
        return isinstance(value, list | tuple) and any(isinstance(part, float | str) and holds(part) for part in value)

    return holds


def trail(call: Callable[[], Any], holds: Holds, package: Path = PACKAGE) -> Trail:
    """The path of a value during a call."""
    root = str(package) + "/"
    visits: list[tuple[Place, Place | None, bool, bool]] = []  # place, caller, held, returned

    def look(frame: FrameType, event: str, argument: Any) -> None:
        if event == "return" and frame.f_code.co_filename.startswith(root):
            returned = holds(argument)
            held = returned or any(holds(value) for value in frame.f_locals.values())
            visits.append((_place(frame, root), _caller(frame, root), held, returned))

    sys.setprofile(look)
    try:
        call()
    finally:
        sys.setprofile(None)
    found = {place for place, _, held, _ in visits if held}
    pairs = [(caller, place, held, back) for place, caller, held, back in visits if caller in found]
    return Trail(
        stays=list(dict.fromkeys(place for place, _, held, _ in visits if held)),
        calls=list(dict.fromkeys((caller, place) for caller, place, held, _ in pairs if held and caller)),
        returns=list(dict.fromkeys((place, caller) for caller, place, _, back in pairs if back and caller)),
    )


def _place(frame: FrameType, root: str) -> Place:
    return Place(frame.f_code.co_filename.removeprefix(root), _COMPREHENSION.sub("", frame.f_code.co_qualname))


def _caller(frame: FrameType, root: str) -> Place | None:
    """The function of the package that a frame was called from."""
    above = frame.f_back
    while above is not None and not above.f_code.co_filename.startswith(root):
        above = above.f_back
    return None if above is None else _place(above, root)


def path_of_a_voltage() -> Trail:
    """From `omnidyn.simulate` to the Run: the paper's robot, voltages within its limits."""
    robot = omnidyn.load_robot("axebot")
    voltage = np.full((10, robot.wheels.count), DIGITS)
    omnidyn.simulate(robot, voltage, 0.01)  # imports, kernels
    return trail(lambda: omnidyn.simulate(robot, voltage, 0.01), shows_number(DIGITS, f"{DIGITS}"))


def path_of_a_cell() -> Trail:
    """From `omnidyn.read_log` of a CSV file to the Run: a voltage in one row of a simulated log."""
    robot = omnidyn.load_robot("axebot")
    voltage = 2.0 + 0.1 * np.sin(np.arange(300.0))[:, None] * np.arange(1.0, robot.wheels.count + 1.0)
    voltage[11, 0] = DIGITS
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        omnidyn.write_run(omnidyn.simulate(robot, voltage, 0.01), path)
        omnidyn.read_log(path, robot)  # imports
        return trail(lambda: omnidyn.read_log(path, robot), shows_number(DIGITS, f"{DIGITS}"))


def as_row(table: Table, name: str, path: Trail, stays: int, climbs: int) -> None:
    """One row of the table, and the functions as notes."""
    table.add(
        what=name,
        stays=len(path.stays),
        rooms=len(path.rooms),
        climbs=len(path.climbs),
        returns=len(path.returns),
        goal=f"at most {stays} stays, {climbs} climbs",
        met=len(path.stays) <= stays and len(path.climbs) <= climbs,
    )
    table.notes += [f"{name}: {place.file}: {place.function}" for place in path.stays]


def measure() -> Table:
    """The paths of a voltage and of a cell."""
    table = Table("the path of a value", ["what", "stays", "rooms", "climbs", "returns"])
    as_row(table, "voltage", path_of_a_voltage(), GOAL_STAYS, GOAL_CLIMBS)
    as_row(table, "cell", path_of_a_cell(), GOAL_STAYS_OF_CELL, GOAL_CLIMBS_OF_CELL)
    return table
