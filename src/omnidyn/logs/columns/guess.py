"""Guess which column is which component, from names and units. A doubtful column is not taken: it is named, with
the words that would settle it. What was guessed is always shown.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from omnidyn.errors import InputError, shortened
from omnidyn.logs.channels import TIME, place, si_suffix
from omnidyn.logs.column import MOTOR_SIDE, WHEEL_SIDE, Column
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.component import (
    BY_UNIT,
    DRIVES,
    component_of,
    component_of_parts,
    numbered_kind,
)
from omnidyn.logs.columns.frame_of import FRAMES
from omnidyn.logs.columns.guess_time import take_time
from omnidyn.logs.columns.guess_unit import doubt_of_rate, implausible, settle_side, take_sides, unit_of
from omnidyn.logs.columns.guessed import Doubt, Guess, doubt, first_word, floats, is_numeric, joined_doubts, letter_of
from omnidyn.logs.columns.mapping import SIDED, ColumnMap, component_channel, is_of_rim, quantity_of, unit_and_side
from omnidyn.logs.columns.names import BRACKETS, read_name
from omnidyn.logs.columns.wheel_numbers import BY_PLACES, proposed_wheels, wheel_numbers
from omnidyn.logs.table.table import Table
from omnidyn.model.robot import Robot
from omnidyn.statement import ERROR, WARNING, Statement
from omnidyn.units import COUNT, COUNT_RATE, Unit, known_unit, parse_unit
from omnidyn.units import DUTY as DUTY_UNIT
from omnidyn.units import SPEED as SPEED_UNIT
from omnidyn.units import TIME as TIME_UNIT
from omnidyn.units import VOLTAGE as VOLTAGE_UNIT

TIME_REMEDY = "say which column it is (`column` t=COLUMN:s), or how many rows a second: `rate` HZ"
SECONDS_OR_DATES = "write seconds, or dates such as 2026-11-20T10:00:00.125"

_LETTER = re.compile(r"([a-z])\d{1,3}")

_POWER = re.compile(r"(?!.*(?:duty|pwm|throttle)).*power.*", re.IGNORECASE | re.DOTALL)
_BESIDE_POWER = {words.CURRENT, words.VOLTAGE, words.RATE, words.ANGLE}
NOT_OF_A_MOTOR = frozenset({words.X, words.Y, "vx", "vy", words.YAW, words.SUPPLY, words.TIME})


def guess_columns(
    table: Table,
    robot: Robot | None = None,
    assume: Mapping[str, str] | None = None,
    taken: Mapping[str, str] | None = None,
) -> ColumnMap:
    """Guess the map of a table. robot: settles what a name leaves open (volts or duty, which side of the gear).

    assume: name of a column, what several are called but for their numbers ("enc" of enc1, enc2), or letter of a
    component ("u", "w1", "vx") -> unit, where the file gives none. A name that
    a units row or its own ending gives a unit needs none. With @motor or @wheel behind the unit, "ticks/48@motor", it
    says the side of the gear too. taken: column -> component, where the user says it
    himself: nothing is doubted of them. Raises InputError for an unknown unit in `assume`.
    """
    units = {name: text for name, text in (assume or {}).items() if name not in FRAMES}
    told = {column: unit_and_side(text) for name, text in units.items() for column in _meant(name, table.names)}
    assumed = {name: unit.text for name, (unit, _) in told.items()}
    found = Guess(robot=robot)
    names = [name for name in table.names if is_numeric(table.columns[name]) and name not in table.says]
    names = _without_measured_power(names)
    table = replace(table, units={**_units_of_letters(names, assumed, table.units), **table.units})
    _take_said(table, assumed, found)
    numbers = wheel_numbers(table, names, found)
    for name in names:
        _take(table, name, numbers, assumed, robot, found)
    _doubt_words(table, wheel_numbers(table, table.names, Guess()), found)
    _doubt_letters(names, found)
    if TIME not in found.columns:
        take_time(table, assumed, found)
    if set(numbers.values()) <= {1} and not any(said.component[1:2].isdigit() for said in table.says.values()):
        _take_bench(table, names, assumed, found)
    _ask_where_motion_differs(table, numbers, found)
    settle_side(table, robot, found)
    take_sides({name: side for name, (_, side) in told.items() if side}, found)
    found.doubts = [open_doubt for open_doubt in found.doubts if open_doubt.columns[0] not in (taken or {})]
    used = {column.name for column in found.columns.values()}
    unused = tuple(name for name in table.names if name not in used)
    ordered = dict(sorted(found.columns.items(), key=lambda item: _order(item[0])))
    idle = tuple(
        Doubt("assumption_unused", WARNING, "", {"assumption": f"{name}={unit}"}, units=())
        for name, unit in assumed.items()
        if not _is_used(
            name,
            table,
            (*found.columns, *(open_doubt.components[0] for open_doubt in found.doubts), *(taken or {}).values()),
        )
    )
    return ColumnMap(ordered, unused, (*joined_doubts(found.doubts), *idle), found.all_notes())


def _without_measured_power(names: list[str]) -> list[str]:
    """The names without those of a power, where others say what drives the motors; alone, a power is a duty (FTC)."""
    roles = {name: read_name(name).roles for name in names}
    powers = [name for name in names if _POWER.fullmatch(name) and not roles[name] & _BESIDE_POWER]
    drives = [name for name in names if roles[name] & {words.DUTY, words.VOLTAGE} and words.SUPPLY not in roles[name]]
    return names if set(drives) <= set(powers) else [name for name in names if name not in powers]


def _take_said(table: Table, assumed: Mapping[str, str], found: Guess) -> None:
    """Columns of which the format itself says what they are: the first of a kind is taken, where it can be that."""
    for name, said in table.says.items():
        given = assumed.get(name) or assumed.get(said.component) or assumed.get(letter_of(said.component))
        unit = given or table.units.get(name) or si_suffix(said.component or TIME).replace("_", "/")
        if said.why is not None:
            found.doubts.append(doubt(name, said.component, said.why.code, (), **said.why.numbers))
        elif said.component and said.component not in found.columns:
            if given or not (fast := doubt_of_rate(table, name, said.component, unit)):
                found.columns[said.component] = Column(name, unit)
            else:
                found.doubts.append(fast)


def _meant(name: str, names: Iterable[str]) -> list[str]:
    """The columns called so but for a number behind; the name itself where there are none, or it is a letter."""
    numbered = [each for each in names if re.fullmatch(re.escape(name) + r"[ _]?\d+", each)]
    return numbered if numbered and name not in names and not place(f"{name}1") else [name]


def _is_used(name: str, table: Table, components: Iterable[str]) -> bool:
    """Whether an assumed unit meets a column: by its name, or as a component or the letter of one."""
    known = {each for component in components for each in (component, letter_of(component))}
    # u stands for commands of motors in any unit: a duty is one that is no voltage.
    kin = {"u": "d", "d": "u"}
    return name in table.names or name in known or kin.get(name[:1], "") + name[1:] in known


def _units_of_letters(names: Sequence[str], assumed: Mapping[str, str], units: Mapping[str, str]) -> dict[str, str]:
    """Units of columns a1, a2, .. that are called like a component and nothing else, by what is assumed of a."""
    found = {}
    for name in names:
        match = _LETTER.fullmatch(name)
        text = assumed.get(match[1], "") if match and name not in units and name not in assumed else ""
        unit = known_unit(text) if text else None
        if match and unit is not None and BY_UNIT.get(unit.quantity) == match[1]:
            found[name] = text
    return found


def _order(component: str) -> tuple[int, str, int]:
    found = place(component)
    return (0, "", 0) if found is None else (1, found[0], found[1])


def _take(
    table: Table, name: str, numbers: Mapping[str, int], assumed: Mapping[str, str], robot: Robot | None, found: Guess
) -> None:
    """One column: which component it is, in which unit; or a doubt."""
    given = table.units.get(name, "")
    unit = known_unit(assumed[name]) if name in assumed else known_unit(given) if given else None
    parts = read_name(name)
    component = component_of(name, unit, numbers.get(name))
    if component is None:
        _doubt_brackets(name, numbers, found)
        return
    if component in found.columns:
        found.doubts.append(doubt(name, component, "component_taken", (), by=found.columns[component].name))
        return
    assumption = assumed.get(component) or assumed.get(component.rstrip("0123456789"))
    if assumption is not None:
        unit = parse_unit(assumption)
    unit = unit or parts.unit
    if unit is None and given and given not in ("-", "SI"):
        found.doubts.append(doubt(name, component, "unit_unknown", unit=given))
        return
    if unit is None:
        unit = unit_of(table, name, component, robot, found)
    if unit is not None:
        _enter(table, name, component, unit, name in assumed or assumption is not None, found)


def _doubt_words(table: Table, numbers: Mapping[str, int], found: Guess) -> None:
    """Columns that are called like a component, and whose cells begin like numbers but are none: 5.0V, 1.250.000."""
    for name in table.names:
        cells = table.columns[name]
        component = None if is_numeric(cells) else component_of(name, None, numbers.get(name))
        if component is not None and (cell := first_word(cells)).lstrip("+-.")[:1].isdigit():
            found.doubts.append(doubt(name, component, "cells_not_numbers", (), cell=cell))


def _doubt_brackets(name: str, numbers: Mapping[str, int], found: Guess) -> None:
    """A column that is called like a component, with an unknown unit in brackets behind: speed1 [pix/s]."""
    match = BRACKETS.fullmatch(name)
    component = component_of_parts(read_name(match[1]), None, numbers.get(name)) if match else None
    if match and component is not None:
        found.doubts.append(doubt(name, component, "unit_unknown", unit=match[2]))


def _doubt_letters(names: list[str], found: Guess) -> None:
    """V1, V2, ..: volts, or speeds of the rims? Nobody knows."""
    parts = {name: read_name(name) for name in names}
    mine = [
        name
        for name, read in parts.items()
        if read.number is not None and read.unit is None and read.roles == {words.LINEAR}
    ]
    if mine and "u1" not in found.columns:
        found.doubts += [doubt(name, f"u{parts[name].number}", "volts_or_speeds", (), first=mine[0]) for name in mine]


def _enter(table: Table, name: str, component: str, unit: Unit, said: bool, found: Guess) -> None:
    """Take a column, where its unit measures what the component is and its values may be so many of it.

    said: whether the user said the unit.
    """
    wanted, called = quantity_of(component), component
    if unit.quantity == DUTY_UNIT and wanted == VOLTAGE_UNIT and component != "supply":
        component = "d" + component[1:]
    elif unit.quantity == VOLTAGE_UNIT and wanted == DUTY_UNIT:
        component = "u" + component[1:]
    elif unit.quantity in (COUNT, COUNT_RATE):
        divided = "ticks/COUNTS_PER_TURN" + ("/s" if unit.quantity == COUNT_RATE else "")
        found.doubts.append(doubt(name, component, "counts_per_turn_unknown", (divided,)))
        return
    elif unit.quantity == SPEED_UNIT and is_of_rim(component, unit):
        _enter_rim(name, component, unit, found)
        return
    elif unit.quantity != wanted:
        if unit.quantity != TIME_UNIT or component not in ("x", "y", "heading"):  # x [s] is the axis of a picture
            found.doubts.append(doubt(name, component, "unit_of_other", unit=unit.text, quantity=wanted))
        return
    unlikely = implausible(component, unit, floats(table.columns[name]), said, found.robot)
    if unlikely is not None:
        found.doubts.append(replace(unlikely, columns=(name,), components=(called,)))
        return
    roles = read_name(name).roles
    side = MOTOR_SIDE if component_channel(component) in SIDED and words.MOTOR in roles else WHEEL_SIDE
    found.columns[component] = Column(name, unit.text, side)


def _enter_rim(name: str, component: str, unit: Unit, found: Guess) -> None:
    """Take a speed of a rim, where the radius is known that makes it one of the wheel."""
    if found.robot is None:
        found.doubts.append(doubt(name, component, "rim_without_robot", (), unit=unit.text))
        return
    found.columns[component] = Column(name, unit.text)
    found.note("speeds_of_rims", unit=unit.text)


def _take_bench(table: Table, names: list[str], assumed: Mapping[str, str], found: Guess) -> None:
    """A log of one motor, whose columns need no number: voltage, current, velocity, position.

    Several columns of one kind, such as left_speed and right_speed, are wheels, and nobody knows which is which.
    """
    alike: dict[str, list[str]] = {}
    numbered = {component for component in found.columns if component[1:2].isdigit()}
    settled = numbered | {
        open_doubt.components[0] for open_doubt in found.doubts if read_name(open_doubt.columns[0]).number is not None
    }
    body = found.columns.keys() - numbered - {TIME, "supply", "omega", "heading"}
    turning = {column.name for key, column in found.columns.items() if body and key in ("omega", "heading")}
    for name in names:
        component = _bench_component(table, name)
        if component and component not in settled and name not in turning:
            alike.setdefault(component, []).append(name)
    _drop_unspoken(alike)
    for component, mine in alike.items():
        if len(mine) > 1:
            _forget(mine, found)
            order = proposed_wheels(table, mine, found) if component == "w1" else ""
            first = "" if order else f"{component}={mine[0]}"
            found.doubts += [doubt(name, component, "wheel_unknown", (), order=order, first=first) for name in mine]
        elif mine and not body:
            _forget(mine, found)
            _take_single(table, mine[0], component, assumed, found)
    if any(component[1:2].isdigit() for component in found.columns.keys() - numbered):
        found.note("one_motor", numbered=len(numbered))


def _ask_where_motion_differs(table: Table, numbers: Mapping[str, int], found: Guess) -> None:
    """Take back wheels told by their places, where the motion of the body says that their order is another one."""
    placed = [name for name in numbers if read_name(name).place is not None]
    speeds = {key: column.name for key, column in found.columns.items() if re.fullmatch(r"w\d+", key)}
    mine = [name for name in speeds.values() if name in placed]
    order = proposed_wheels(table, mine, found) if mine else ""
    if order and order.replace("=-", "=") != ", ".join(f"{key}={name}" for key, name in sorted(speeds.items())):
        _forget(placed, found)
        found.notes = [note for note in found.notes if note.code != BY_PLACES]
        found.doubts += [doubt(name, "w1", "places_against_motion", (), order=order) for name in placed]


def _drop_unspoken(alike: dict[str, list[str]]) -> None:
    """Leave out voltages of what no word says to be a motor (logic_V), where a word says what drives it."""
    spoken = [name for key in ("u1", "d1") for name in alike.get(key, []) if read_name(name).roles & DRIVES]
    if spoken:
        for key in ("u1", "d1"):
            alike[key] = [name for name in alike.get(key, []) if name in spoken]


def _bench_component(table: Table, name: str) -> str:
    """The component of a motor that a name without a number says, "" where it says none."""
    parts = read_name(name)
    letter = numbered_kind(parts._replace(number=1), known_unit(table.units.get(name, "")))
    command = words.COMMAND in parts.roles
    if letter is None or parts.number is not None or parts.roles & NOT_OF_A_MOTOR or (command and letter in "ia"):
        return ""
    return f"{letter}1_cmd" if command and letter == "w" else f"{letter}1"


def _forget(names: list[str], found: Guess) -> None:
    """Take back what was said about some columns."""
    for component in [key for key, column in found.columns.items() if column.name in names]:
        del found.columns[component]
    found.doubts = [open_doubt for open_doubt in found.doubts if open_doubt.columns[0] not in names]
    for name in names:
        found.si.pop(name, None)


def _take_single(table: Table, name: str, component: str, assumed: Mapping[str, str], found: Guess) -> None:
    parts = read_name(name)
    text = assumed.get(name) or assumed.get(letter_of(component)) or table.units.get(name, "")
    unit = known_unit(text) or parts.unit
    unknown = text if text not in ("", "-", "SI") else (match[2] if (match := BRACKETS.fullmatch(name)) else "")
    if unit is None and unknown:
        found.doubts.append(doubt(name, component, "unit_unknown", unit=unknown))
        return
    unit = unit or unit_of(table, name, component, None, found)
    if unit is not None:
        said = name in assumed or letter_of(component) in assumed
        _enter(table, name, component, unit, said, found)


def refuse_doubtful(columns: ColumnMap, where: str) -> None:
    """Raises InputError where nothing tells the time: without it there is no log."""
    if TIME not in columns.columns:
        unclear = next((doubt for doubt in columns.doubts if TIME in doubt.components), None)
        why, remedy = "no column looks like a time", TIME_REMEDY
        if unclear is not None:
            why = shortened(str(Statement("time_unclear", ERROR, TIME, {"doubt": unclear})), 300)
            remedy = unclear.remedy_text if unclear.units else SECONDS_OR_DATES
        raise InputError(f"cannot tell the time of the rows: {why}", remedy=remedy, where=where)
