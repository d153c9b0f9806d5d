"""Guess which column is which component, from names and units. A doubtful column is not taken: it is named, with
the words that would settle it. What was guessed is always shown.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
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
from omnidyn.logs.columns.doubts import Doubt, doubt, joined_doubts, letter_of
from omnidyn.logs.columns.frame_of import FRAMES
from omnidyn.logs.columns.guess_side import note_sides_by_name, settle_side, take_sides
from omnidyn.logs.columns.guess_time import take_time
from omnidyn.logs.columns.guess_unit import doubt_of_rate, implausible, unit_of, voltage_limit
from omnidyn.logs.columns.guessed import Guess, first_word, floats, is_numeric
from omnidyn.logs.columns.mapping import ColumnMap, component_channel, is_of_rim, quantity_of, unit_and_side
from omnidyn.logs.columns.names import AGAIN, BRACKETS, read_name
from omnidyn.logs.columns.plausible import beyond_range
from omnidyn.logs.columns.unnamed_families import unnamed_families, volts_or_speeds
from omnidyn.logs.columns.wheel_numbers import BY_PLACES, wheel_numbers
from omnidyn.logs.columns.wheels_by_motion import proposed_wheels
from omnidyn.logs.table.table import FileTable
from omnidyn.model.robot import Robot
from omnidyn.sensors import BEHIND_GEAR
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
    table: FileTable,
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
    declared = {column: unit_and_side(text) for name, text in units.items() for column in _meant(name, table.names)}
    assumed = {name: unit.text for name, (unit, _) in declared.items()}
    guess = Guess(robot=robot)
    names = [name for name in table.names if is_numeric(table.columns[name]) and name not in table.says]
    names = _without_measured_power(names)
    table = replace(table, units={**_units_of_letters(names, assumed, table.units), **table.units})
    _take_said(table, assumed, guess)
    numbers = wheel_numbers(table, names, guess, assumed)
    for name in names:
        _take(table, name, numbers, assumed, robot, guess)
    _doubt_words(table, wheel_numbers(table, table.names, Guess()), guess)
    if "u1" not in guess.columns:
        guess.doubts += volts_or_speeds(names)
    if TIME not in guess.columns:
        take_time(table, assumed, guess)
    if set(numbers.values()) <= {1} and not any(
        declaration.component[1:2].isdigit() for declaration in table.says.values()
    ):
        _take_bench(table, names, assumed, guess)
    _ask_where_motion_differs(table, numbers, guess)
    settle_side(table, robot, guess)
    take_sides({name: side for name, (_, side) in declared.items() if side}, guess)
    note_sides_by_name({name for name, (_, side) in declared.items() if not side}, guess)
    _refuse_twins(table, guess, taken or {})
    guess.doubts = [open_doubt for open_doubt in guess.doubts if open_doubt.columns[0] not in (taken or {})]
    used_names = {column.name for column in guess.columns.values()}
    unused = tuple(name for name in table.names if name not in used_names)
    ordered = dict(sorted(guess.columns.items(), key=lambda item: _order(item[0])))
    idle = tuple(
        Doubt("assumption_unused", WARNING, "", {"assumption": f"{name}={unit}"}, units=())
        for name, unit in assumed.items()
        if not _is_used(
            name,
            table,
            (*guess.columns, *(open_doubt.components[0] for open_doubt in guess.doubts), *(taken or {}).values()),
        )
    )
    doubts = (*joined_doubts(guess.doubts), *_unnamed(table, names, guess, taken or {}), *idle)
    return ColumnMap(ordered, unused, doubts, guess.all_notes())


def _unnamed(table: FileTable, names: Iterable[str], guess: Guess, taken: Mapping[str, str]) -> list[Doubt]:
    """The doubts about columns that nobody took or doubted, and whose names and units say nothing."""
    used_names = {*(column.name for column in guess.columns.values()), *taken}
    used_names |= {name for open_doubt in guess.doubts for name in open_doubt.columns}
    unknown = [name for name in names if name not in used_names and not (read_name(name).unit or table.units.get(name))]
    components = {component for open_doubt in guess.doubts for component in open_doubt.components}
    return unnamed_families(unknown, {*guess.columns, *components, *taken.values()}, guess.robot)


def _without_measured_power(names: list[str]) -> list[str]:
    """The names without those of a power, where others say what drives the motors; alone, a power is a duty (FTC)."""
    roles = {name: read_name(name).roles for name in names}
    powers = [name for name in names if _POWER.fullmatch(name) and not roles[name] & _BESIDE_POWER]
    drives = [name for name in names if roles[name] & {words.DUTY, words.VOLTAGE} and words.SUPPLY not in roles[name]]
    return names if set(drives) <= set(powers) else [name for name in names if name not in powers]


def _take_said(table: FileTable, assumed: Mapping[str, str], guess: Guess) -> None:
    """Columns of which the format itself says what they are: the first of a kind is taken, where it can be that."""
    for name, declaration in table.says.items():
        declared_unit = (
            assumed.get(name) or assumed.get(declaration.component) or assumed.get(letter_of(declaration.component))
        )
        unit = declared_unit or table.units.get(name) or si_suffix(declaration.component or TIME).replace("_", "/")
        if declaration.why is not None:
            guess.doubts.append(doubt(name, declaration.component, declaration.why.code, (), **declaration.why.numbers))
        elif declaration.component and declaration.component not in guess.columns:
            unlikely = None if declared_unit else _unlikely(table, name, declaration.component, unit, guess.robot)
            if unlikely is None:
                guess.columns[declaration.component] = Column(name, unit)
            else:
                guess.doubts.append(unlikely)


def _unlikely(table: FileTable, name: str, component: str, unit: str, robot: Robot | None) -> Doubt | None:
    """The doubt about a column whose values are not what the format says that they are; None where they can be."""
    if place(component) is None or isinstance(table.columns[name], tuple):
        return None
    fast = doubt_of_rate(table, name, component, unit)
    of_range = beyond_range(component, parse_unit(unit), floats(table.columns[name]), voltage_limit(robot))
    return fast or (of_range and replace(of_range, columns=(name,)))


def _meant(name: str, names: Iterable[str]) -> list[str]:
    """The columns called so but for a number or a place; the name itself where there are none, or it is a letter."""
    family = [
        column_name
        for column_name in names
        if re.fullmatch(re.escape(name) + r"[ _]?\d+", column_name)
        or ((parts := read_name(column_name)).place is not None and parts.before == name)
    ]
    return family if family and name not in names and not place(f"{name}1") else [name]


def _is_used(name: str, table: FileTable, components: Iterable[str]) -> bool:
    """Whether an assumed unit meets a column: by its name, or as a component or the letter of one."""
    components_and_letters = {spelling for component in components for spelling in (component, letter_of(component))}
    # u stands for commands of motors in any unit: a duty is one that is no voltage.
    kin = {"u": "d", "d": "u"}
    return (
        name in table.names
        or name in components_and_letters
        or kin.get(name[:1], "") + name[1:] in components_and_letters
    )


def _units_of_letters(names: Sequence[str], assumed: Mapping[str, str], units: Mapping[str, str]) -> dict[str, str]:
    """Units of columns a1, a2, .. that are called like a component and nothing else, by what is assumed of a."""
    units_by_name = {}
    for name in names:
        match = _LETTER.fullmatch(name)
        text = assumed.get(match[1], "") if match and name not in units and name not in assumed else ""
        unit = known_unit(text) if text else None
        if match and unit is not None and BY_UNIT.get(unit.quantity) == match[1]:
            units_by_name[name] = text
    return units_by_name


def _order(component: str) -> tuple[int, str, int]:
    location = place(component)
    return (0, "", 0) if location is None else (1, location[0], location[1])


def _take(
    table: FileTable,
    name: str,
    numbers: Mapping[str, int],
    assumed: Mapping[str, str],
    robot: Robot | None,
    guess: Guess,
) -> None:
    """One column: which component it is, in which unit; or a doubt."""
    table_unit = table.units.get(name, "")
    unit = known_unit(assumed[name]) if name in assumed else known_unit(table_unit) if table_unit else None
    parts = read_name(name)
    component = component_of(name, unit, numbers.get(name), name in assumed)
    if component is None:
        _doubt_brackets(name, numbers, guess)
        return
    if component in guess.columns:
        guess.doubts.append(doubt(name, component, "component_taken", (), by=guess.columns[component].name))
        return
    assumption = assumed.get(component) or assumed.get(component.rstrip("0123456789"))
    if assumption is not None:
        unit = parse_unit(assumption)
    unit = unit or parts.unit
    if unit is None and table_unit and table_unit not in ("-", "SI"):
        guess.doubts.append(doubt(name, component, "unit_unknown", unit=table_unit))
        return
    if unit is None:
        unit = unit_of(table, name, component, robot, guess)
    if unit is not None:
        _enter(table, name, component, unit, name in assumed or assumption is not None, guess)


def _doubt_words(table: FileTable, numbers: Mapping[str, int], guess: Guess) -> None:
    """Columns that are called like a component, and whose cells begin like numbers but are none: 5.0V, 1.250.000."""
    for name in table.names:
        cells = table.columns[name]
        component = None if is_numeric(cells) else component_of(name, None, numbers.get(name))
        if component is not None and (cell := first_word(cells)).lstrip("+-.")[:1].isdigit():
            guess.doubts.append(doubt(name, component, "cells_not_numbers", (), cell=cell))


def _doubt_brackets(name: str, numbers: Mapping[str, int], guess: Guess) -> None:
    """A column that is called like a component, with an unknown unit in brackets behind: speed1 [pix/s]."""
    match = BRACKETS.fullmatch(name)
    component = component_of_parts(read_name(match[1]), None, numbers.get(name)) if match else None
    if match and component is not None:
        guess.doubts.append(doubt(name, component, "unit_unknown", unit=match[2]))


def _enter(table: FileTable, name: str, component: str, unit: Unit, is_declared: bool, guess: Guess) -> None:
    """Take a column, where its unit measures what the component is and its values may be so many of it.

    is_declared: whether the user said the unit.
    """
    quantity, doubted_component = quantity_of(component), component
    if unit.quantity == DUTY_UNIT and quantity == VOLTAGE_UNIT and component != "supply":
        component = "d" + component[1:]
    elif unit.quantity == VOLTAGE_UNIT and quantity == DUTY_UNIT:
        component = "u" + component[1:]
    elif unit.quantity in (COUNT, COUNT_RATE):
        divided = "ticks/COUNTS_PER_TURN" + ("/s" if unit.quantity == COUNT_RATE else "")
        guess.doubts.append(doubt(name, component, "counts_per_turn_unknown", (divided,)))
        return
    elif unit.quantity == SPEED_UNIT and is_of_rim(component, unit):
        _enter_rim(name, component, unit, guess)
        return
    elif unit.quantity != quantity:
        if unit.quantity != TIME_UNIT or component not in ("x", "y", "heading"):  # x [s] is the axis of a picture
            guess.doubts.append(doubt(name, component, "unit_of_other", unit=unit.text, quantity=quantity))
        return
    unlikely = implausible(component, unit, floats(table.columns[name]), is_declared, name not in guess.si, guess.robot)
    if unlikely is not None:
        guess.doubts.append(replace(unlikely, columns=(name,), components=(doubted_component,)))
        guess.si.pop(name, None)
        return
    roles = read_name(name).roles
    side = MOTOR_SIDE if component_channel(component) in BEHIND_GEAR and words.MOTOR in roles else WHEEL_SIDE
    guess.columns[component] = Column(name, unit.text, side)


def _enter_rim(name: str, component: str, unit: Unit, guess: Guess) -> None:
    """Take a speed of a rim, where the radius is known that makes it one of the wheel."""
    if guess.robot is None:
        guess.doubts.append(doubt(name, component, "rim_without_robot", (), unit=unit.text))
        return
    guess.columns[component] = Column(name, unit.text)
    guess.note("speeds_of_rims", unit=unit.text)


def _refuse_twins(table: FileTable, guess: Guess, taken: Mapping[str, str]) -> None:
    """Raises InputError where two columns have one name and the first would be taken; equal ones are one.

    taken: column -> component, where the user says which it is.
    """
    for component, column in guess.columns.items():
        twins = [name for name in table.names if AGAIN.sub("", name) == column.name != name]
        twins = [name for name in twins if not _are_equal(table.columns[name], table.columns[column.name])]
        if not twins or component in taken.values():
            continue
        unit = f":{column.unit}" if column.unit else ""
        choices = " or ".join(f'"{component}={name}{unit}"' for name in (column.name, *twins))
        raise InputError(
            "two columns of one name",
            got=f"{column.name}, {1 + len(twins)} times; the later ones are called {', '.join(twins)}",
            expected="a name for each column",
            remedy=f"rename one, or say which it is: `column` {choices}",
            where=table.source,
        )


def _are_equal(one: FloatArray | tuple[str, ...], other: FloatArray | tuple[str, ...]) -> bool:
    """Whether two columns hold the same, to the last digit."""
    if isinstance(one, tuple) or isinstance(other, tuple):
        return isinstance(one, tuple) and one == other
    return np.array_equal(one, other, equal_nan=True)


def _take_bench(table: FileTable, names: list[str], assumed: Mapping[str, str], guess: Guess) -> None:
    """A log of one motor, whose columns need no number: voltage, current, velocity, position.

    Several columns of one kind, such as left_speed and right_speed, are wheels, and nobody knows which is which.
    """
    alike: dict[str, list[str]] = {}
    numbered = {component for component in guess.columns if component[1:2].isdigit()}
    settled = numbered | {
        open_doubt.components[0] for open_doubt in guess.doubts if read_name(open_doubt.columns[0]).number is not None
    }
    body = guess.columns.keys() - numbered - {TIME, "supply", "omega", "heading"}
    turning = {column.name for key, column in guess.columns.items() if body and key in ("omega", "heading")}
    for name in names:
        component = _bench_component(table, name)
        if component and component not in settled and name not in turning:
            alike.setdefault(component, []).append(name)
    _drop_unspoken(alike)
    for component, columns in alike.items():
        if len(columns) > 1:
            _forget(columns, guess)
            order = proposed_wheels(table, columns, guess) if component == "w1" else ""
            first = "" if order else f"{component}={columns[0]}"
            guess.doubts += [doubt(name, component, "wheel_unknown", (), order=order, first=first) for name in columns]
        elif columns and not body:
            _forget(columns, guess)
            _take_single(table, columns[0], component, assumed, guess)
    if any(component[1:2].isdigit() for component in guess.columns.keys() - numbered):
        guess.note("one_motor", numbered=len(numbered))


def _ask_where_motion_differs(table: FileTable, numbers: Mapping[str, int], guess: Guess) -> None:
    """Take back wheels told by their places, where the motion of the body says that their order is another one."""
    placed = [name for name in numbers if read_name(name).place is not None]
    speeds = {key: column.name for key, column in guess.columns.items() if re.fullmatch(r"w\d+", key)}
    speed_names = [name for name in speeds.values() if name in placed]
    order = proposed_wheels(table, speed_names, guess) if speed_names else ""
    if order and order.replace("=-", "=") != ", ".join(f"{key}={name}" for key, name in sorted(speeds.items())):
        _forget(placed, guess)
        guess.notes = [note for note in guess.notes if note.code != BY_PLACES]
        guess.doubts += [doubt(name, "w1", "places_against_motion", (), order=order) for name in placed]


def _drop_unspoken(alike: dict[str, list[str]]) -> None:
    """Leave out voltages of what no word says to be a motor (logic_V), where a word says what drives it."""
    spoken = [name for key in ("u1", "d1") for name in alike.get(key, []) if read_name(name).roles & DRIVES]
    if spoken:
        for key in ("u1", "d1"):
            alike[key] = [name for name in alike.get(key, []) if name in spoken]


def _bench_component(table: FileTable, name: str) -> str:
    """The component of a motor that a name without a number says, "" where it says none."""
    parts = read_name(name)
    letter = numbered_kind(parts._replace(number=1), known_unit(table.units.get(name, "")))
    command = words.COMMAND in parts.roles
    if letter is None or parts.number is not None or parts.roles & NOT_OF_A_MOTOR or (command and letter in "ia"):
        return ""
    return f"{letter}1_cmd" if command and letter == "w" else f"{letter}1"


def _forget(names: list[str], guess: Guess) -> None:
    """Take back what was said about some columns."""
    for component in [key for key, column in guess.columns.items() if column.name in names]:
        del guess.columns[component]
    guess.doubts = [open_doubt for open_doubt in guess.doubts if open_doubt.columns[0] not in names]
    for name in names:
        guess.si.pop(name, None)


def _take_single(table: FileTable, name: str, component: str, assumed: Mapping[str, str], guess: Guess) -> None:
    parts = read_name(name)
    text = assumed.get(name) or assumed.get(letter_of(component)) or table.units.get(name, "")
    unit = known_unit(text) or parts.unit
    unknown = text if text not in ("", "-", "SI") else (match[2] if (match := BRACKETS.fullmatch(name)) else "")
    if unit is None and unknown:
        guess.doubts.append(doubt(name, component, "unit_unknown", unit=unknown))
        return
    unit = unit or unit_of(table, name, component, None, guess)
    if unit is not None:
        is_declared = name in assumed or letter_of(component) in assumed
        _enter(table, name, component, unit, is_declared, guess)


class UnclearTimeError(InputError):
    """Nothing tells the time of the rows. doubt: about the column that looks like it; rows: of the table."""

    doubt: Doubt
    rows: int


def refuse_doubtful(columns: ColumnMap, table: FileTable) -> None:
    """Raises InputError where nothing tells the time: without it there is no log."""
    if TIME in columns.columns:
        return
    unclear = next((doubt for doubt in columns.doubts if TIME in doubt.components), None)
    what = "cannot tell the time of the rows"
    if unclear is None:
        raise InputError(f"{what}: no column looks like a time", remedy=TIME_REMEDY, where=table.source)
    reason = shortened(str(Statement("time_unclear", ERROR, TIME, {"doubt": unclear})), 300)
    remedy = unclear.remedy_text if unclear.units else SECONDS_OR_DATES
    error = UnclearTimeError(f"{what}: {reason}", remedy=remedy, where=table.source)
    error.doubt, error.rows = unclear, len(table)
    raise error
