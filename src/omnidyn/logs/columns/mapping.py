"""Which column of a file is which component of a log, in which unit; saved as TOML, set with --column."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from omnidyn.errors import InputError
from omnidyn.files import MAX_TOML_BYTES, parse_toml, read_text, write_atomic
from omnidyn.logs.channels import TIME, place, si_suffix
from omnidyn.logs.column import MOTOR_SIDE, WHEEL_SIDE, Column
from omnidyn.logs.columns.doubts import Doubt
from omnidyn.model.robot_file import toml_literal
from omnidyn.model.wheels import MAX_WHEELS
from omnidyn.sensors import BEHIND_GEAR
from omnidyn.statement import Statement
from omnidyn.units import ANGLE, CURRENT, DUTY, FORCE, LENGTH, SPEED, TURN_RATE, VOLTAGE, Unit, parse_unit
from omnidyn.units import TIME as TIME_QUANTITY

FRAMED = ("vx", "vy", "vx_cmd", "vy_cmd", "heading")
SCHEMA = 1

_QUANTITIES = {
    "s": TIME_QUANTITY,
    "V": VOLTAGE,
    "duty": DUTY,
    "A": CURRENT,
    "rad": ANGLE,
    "rad_s": TURN_RATE,
    "m": LENGTH,
    "m_s": SPEED,
    "N": FORCE,
}
_RIM = {TURN_RATE: SPEED, ANGLE: LENGTH}  # what a wheel does -> what its rim does
_JOINT = re.compile(r"(?:.*?joint_states/)(.+)/(?:velocity|position)", re.DOTALL)
_SPEC = re.compile(r"(?P<invert>-)?(?P<name>.+?)(?::(?P<unit>[^:@]*))?(?:@(?P<side>wheel|motor))?", re.DOTALL)


@dataclass(frozen=True)
class ColumnMap:
    """Component ("t", "u1", "vx_cmd", ...) -> Column.

    unused: columns that nobody took. doubts: columns that were not taken because something was not sure, and what
    settles it. notes: what was decided.
    Raises InputError for a name that is no component, or a unit of another quantity.
    """

    columns: Mapping[str, Column] = field(default_factory=dict)
    unused: tuple[str, ...] = ()
    doubts: tuple[Doubt, ...] = ()
    notes: tuple[Statement, ...] = ()

    def __post_init__(self) -> None:
        for component, column in self.columns.items():
            check_quantity(component, parse_unit(column.unit))
            if column.side == MOTOR_SIDE and (component_channel(component) not in BEHIND_GEAR or column.of_rim):
                reason = "what is in metres is of the rim, behind the gear" if column.of_rim else ""
                raise InputError(
                    reason or "only speeds and angles of wheels have a motor side",
                    got=f"{component}: {column}",
                    expected="side wheel",
                )
            if column.frame and component not in FRAMED:
                raise InputError(
                    "only a heading and velocities of the robot have a frame",
                    got=f"{component}: {column}",
                    expected=f"no frame, or one of {', '.join(FRAMED)}",
                )

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints of the wheels as joint states name them, in the order of the wheels; () where these do not say."""
        for letter in ("w", "a"):
            wheels = (f"{letter}{k + 1}" for k in range(MAX_WHEELS))
            names = [_JOINT.fullmatch(self.columns[wheel].name) for wheel in wheels if wheel in self.columns]
            joints = tuple(match[1] for match in names if match)
            if joints and len(joints) == len(names):
                return joints
        return ()

    def with_columns(self, overrides: Mapping[str, Column]) -> ColumnMap:
        """The same with some columns set, and no longer unused."""
        names = {column.name for column in overrides.values()}
        columns = {name: column for name, column in self.columns.items() if column.name not in names}
        unused = tuple(name for name in self.unused if name not in names)
        doubts = tuple(doubt for doubt in self.doubts if not doubt.columns or not names.issuperset(doubt.columns))
        return replace(self, columns={**columns, **overrides}, unused=unused, doubts=doubts)

    @property
    def passed_over(self) -> tuple[str, ...]:
        """Columns that nobody took and no doubt names."""
        doubted = {name for doubt in self.doubts for name in doubt.columns}
        return tuple(name for name in self.unused if name not in doubted)

    def lines(self) -> list[str]:
        """The map for people, a line per channel: "wheel_speed: w1 <- m1vel [rad/s at the motor], ..."."""
        groups: dict[str, list[str]] = {}
        for component, column in self.columns.items():
            groups.setdefault(component_channel(component), []).append(f"{component} <- {column}")
        return [f"{channel}: {', '.join(parts)}" for channel, parts in groups.items()]


def component_channel(component: str) -> str:
    """The channel of a component, "time" for t. Raises InputError for a name that is no component."""
    if component == TIME:
        return "time"
    location = place(component)
    if location is None:
        raise InputError(
            "unknown channel",
            got=component,
            expected="t, u1.., d1.., i1.., a1.., w1.., w1_cmd.., vx, vy, omega, vx_cmd.., x, y, heading, supply or f1",
        )
    return location[0]


def quantity_of(component: str) -> str:
    """What a component measures, in the words of units.py."""
    component_channel(component)
    return _QUANTITIES[si_suffix(component)]


def check_quantity(component: str, unit: Unit) -> None:
    """Raises InputError where a unit measures something else than the component; a wheel may have that of its rim."""
    quantity = quantity_of(component)
    if unit.quantity != quantity and not is_of_rim(component, unit):
        remedy = "say how many make a turn: ticks/2000" if unit.quantity == "count" else ""
        raise InputError(
            f"{component} cannot have this unit",
            got=f"{unit.text} ({unit.quantity})",
            expected=f"a {quantity}",
            remedy=remedy,
        )


def is_of_rim(component: str, unit: Unit) -> bool:
    """Whether a speed of a wheel is given in m/s, or its angle in m: that of its rim."""
    return component_channel(component) in BEHIND_GEAR and _RIM.get(quantity_of(component)) == unit.quantity


def parse_column(text: str, names: Sequence[str] = ()) -> tuple[str, Column]:
    """COMPONENT=[-]COLUMN[:UNIT[@motor|@wheel]], as --column takes it: "u1=motor_1_volts:V", "w2=-m2vel:rpm@motor".

    names: of the columns of the file; a column whose own name holds a colon is found by them. Without a unit the
    component's SI unit is meant. Raises InputError.
    """
    component, equals, rest = text.partition("=")
    component = component.strip()
    if not equals or not rest.strip():
        raise InputError(
            "cannot read the mapping", got=text, expected="CHANNEL=COLUMN:UNIT, such as u1=motor_1_volts:V"
        )
    quantity = quantity_of(component)
    match = _SPEC.fullmatch(rest.strip())
    assert match is not None
    name, unit, side, invert = match["name"].strip(), match["unit"], match["side"], bool(match["invert"])
    if rest.strip() in names:
        name, unit, side, invert = rest.strip(), None, None, False
    if unit is None or not unit.strip():
        unit = next(suffix for suffix, measure in _QUANTITIES.items() if measure == quantity).replace("_", "/")
    return component, Column(name, unit.strip(), side or WHEEL_SIDE, invert)


def unit_and_side(text: str) -> tuple[Unit, str]:
    """UNIT[@motor|@wheel], as --assume takes it: "ticks/48@motor"; the side is "" where none is said.

    Raises InputError for an unknown unit or side.
    """
    unit, at, side = text.partition("@")
    if at and side.strip() not in (MOTOR_SIDE, WHEEL_SIDE):
        raise InputError("unknown side of the gear", got=text, expected="@motor or @wheel", where="assume")
    return parse_unit(unit), side.strip()


def save_map(columns: ColumnMap, path: str | os.PathLike, force: bool = False) -> Path:
    """Write a map as TOML; `load_map` reads it back equal. Raises InputError as `write_atomic` does."""
    return write_atomic(path, map_to_toml(columns), force)


def map_to_toml(columns: ColumnMap) -> str:
    """The map as TOML, one table per component."""
    lines = ["# Columns of a log: which is what, and in which unit. For --map.", f"schema = {SCHEMA}"]
    for component, column in columns.columns.items():
        keys = {"column": column.name, "unit": column.unit}
        keys |= {"side": column.side} if column.side != WHEEL_SIDE else {}
        keys |= {"invert": True} if column.invert else {}
        keys |= {"latency_s": float(column.latency)} if column.latency else {}
        keys |= {"frame": column.frame} if column.frame else {}
        lines += ["", f"[{component}]", *(f"{key} = {toml_literal(value)}" for key, value in keys.items())]
    return "\n".join(lines) + "\n"


_KEYS = {"column": str, "unit": str, "side": str, "invert": bool, "latency_s": (int, float), "frame": str}


def load_map(path: str | os.PathLike) -> ColumnMap:
    """Read a map from TOML. Raises InputError with file and table for what it cannot take."""
    tables = parse_toml(read_text(path, MAX_TOML_BYTES), str(path))
    schema = tables.pop("schema", SCHEMA)
    if schema != SCHEMA:
        raise InputError("unknown schema", got=schema, expected=f"schema = {SCHEMA}", where=str(path))
    columns = {}
    for component, table in tables.items():
        try:
            component_channel(component)
            columns[component] = _column_of(table)
        except InputError as error:
            raise error.at(f"{path}: [{component}]") from None
    try:
        return ColumnMap(columns)
    except InputError as error:
        raise error.at(str(path)) from None


def _column_of(table: Any) -> Column:
    if not isinstance(table, dict) or "column" not in table or "unit" not in table:
        raise InputError("a column is not described", got=table, expected='column = "NAME" and unit = "UNIT"')
    for key, value in table.items():
        if key not in _KEYS:
            raise InputError("unknown key", got=key, expected=", ".join(_KEYS))
        if not isinstance(value, _KEYS[key]) or (key == "latency_s" and isinstance(value, bool)):
            raise InputError(f"{key} has the wrong type", got=value, expected="text, true or false, or a number")
    latency = float(table.get("latency_s", 0.0))
    side, invert = table.get("side", WHEEL_SIDE), table.get("invert", False)
    return Column(table["column"], table["unit"], side, invert, latency, table.get("frame", ""))
