"""Which column of a file is which component of a log, in which unit; saved as TOML, set with --column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

WHEEL_SIDE, MOTOR_SIDE = "wheel", "motor"


@dataclass(frozen=True)
class Column:
    """One column as a component.

    name: of the column in the file. unit: as units.py writes it. side: "motor" for a speed or an angle before the
    gear, "wheel" behind it. invert: the column has the opposite sign. unsigned: it holds |value|. latency: how late it
    was recorded [s]; its times are moved back by so much.
    """

    name: str
    unit: str
    side: str = WHEEL_SIDE
    invert: bool = False
    unsigned: bool = False
    latency: float = 0.0


@dataclass(frozen=True)
class ColumnMap:
    """Component ("t", "u1", "vx_cmd", ...) -> Column. unused: columns that nobody took. notes: what was guessed."""

    columns: Mapping[str, Column] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
