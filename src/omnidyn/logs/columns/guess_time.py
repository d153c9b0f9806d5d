"""Guess which column is the time, and in which unit: given, or unmistakable."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.logs.channels import TIME
from omnidyn.logs.clock.clock import are_steps, is_dates
from omnidyn.logs.column import Column
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.doubts import UNIT, doubt
from omnidyn.logs.columns.guessed import Guess, first_word, floats, is_numeric
from omnidyn.logs.columns.mapping import ColumnMap
from omnidyn.logs.columns.names import read_name
from omnidyn.logs.table.table import FileTable
from omnidyn.units import TIME as TIME_UNIT
from omnidyn.units import Unit, known_unit, parse_unit

SHORTEST_STEP, USUAL_STEP, LONGEST_STEP = 0.95e-4, 1.0, 10.5  # [s] between rows: what a log of a robot may have
LONGEST_SLOW = 7200.0  # [s] that a log with rows slower than usual lasts: a sweep of a motor by hand or by a script
NOWADAYS = 1e9, 2.5e9  # [s] since 1970: 2001 to 2049
SAME_MOTION = 30.0  # a speed and what its position moved differ by less: a gear, degrees; units of time differ by 1000
TIME_NAMES = ("s", "ms", "us", "ns")


def take_time(table: FileTable, assumed: Mapping[str, str], guess: Guess) -> None:
    """The column of time and its unit, which must be given or unmistakable."""
    candidates = [name for name in table.names if words.TIME in read_name(name).roles]
    dates = [name for name in candidates if is_dates(table.columns[name])]
    wordy = [name for name in candidates if not is_numeric(table.columns[name]) and name not in dates]
    candidates = [name for name in candidates if is_numeric(table.columns[name])]
    mixed = [name for name in candidates if _increases(table.columns[name]) and not _is_span(name)]
    candidates = [name for name in candidates if not read_name(name).roles - {words.TIME, words.BODY, words.MEASURED}]
    candidates = candidates or mixed[:1]  # t_now, motor_time_ms
    if not candidates and not wordy:  # in any language: the one column with a unit of time
        timed = [name for name in table.names if _is_clock(table, name, assumed)]
        candidates = timed if len(timed) == 1 else []
    candidates.sort(key=lambda name: (name != "t_s", table.names.index(name)))
    if dates and not candidates:
        guess.columns[TIME] = Column(dates[0], "s")
        guess.note("dates", column=dates[0])
        return
    if not candidates and wordy:
        cell = first_word(table.columns[wordy[0]])
        guess.doubts.append(doubt(wordy[0], TIME, "cells_not_dates", (), cell=cell))
        return
    steps = [
        name for name in table.names if is_numeric(cells := table.columns[name]) and are_steps(name, floats(cells))
    ]
    if steps and (not candidates or candidates == steps):
        _take_steps(table, steps[0], assumed, guess)
        return
    if not candidates:
        increasing = [name for name in table.names if _increases(table.columns[name])]
        if increasing:
            step, units = _possible_units(floats(table.columns[increasing[0]]))
            texts = tuple(unit.text for unit in units) if step != 1.0 else UNIT  # one by one: rows that are counted
            guess.doubts.append(doubt(increasing[0], TIME, "clock_unit_unknown", texts or UNIT))
        return
    name = candidates[0]
    text = assumed.get(name) or assumed.get(TIME) or table.units.get(name, "")
    unit = known_unit(text) or _unit(table, name, assumed)
    if unit is None:
        unit = _plausible_time(table, floats(table.columns[name]), name, text, guess)
    if unit is not None and unit.quantity == TIME_UNIT:
        guess.columns[TIME] = Column(name, unit.text)
    elif unit is not None:
        guess.doubts.append(doubt(name, TIME, "unit_of_other", unit=unit.text, quantity="time"))


def _is_span(name: str) -> bool:
    """Whether a name says a difference of times, or how long something takes: dt, period, time step."""
    return bool(re.search(r"(?:^|[\W_])(?:d|dt|delta|diff|step|period|cycle|remaining|left)(?:$|[\W_])", name.lower()))


def _take_steps(table: FileTable, name: str, assumed: Mapping[str, str], guess: Guess) -> None:
    """A column that holds the time from row to row, where there is no other clock: it is summed up."""
    text = assumed.get(name) or assumed.get(TIME) or table.units.get(name, "")
    values = floats(table.columns[name])
    unit = known_unit(text) or read_name(name).unit or _plausible_time(table, np.cumsum(values), name, text, guess)
    if unit is not None and unit.quantity == TIME_UNIT:
        guess.columns[TIME] = Column(name, unit.text)
    elif unit is not None:
        guess.doubts.append(doubt(name, TIME, "unit_of_other", unit=unit.text, quantity="time"))


def _is_clock(table: FileTable, name: str, assumed: Mapping[str, str]) -> bool:
    """Whether a column has a unit of time, increases, and is no span."""
    unit = _unit(table, name, assumed)
    return unit is not None and unit.quantity == TIME_UNIT and _increases(table.columns[name]) and not _is_span(name)


def _unit(table: FileTable, name: str, assumed: Mapping[str, str]) -> Unit | None:
    """The unit assumed, of a row of units, at the end of the name, or the name itself: ms."""
    return known_unit(assumed.get(name) or table.units.get(name, "")) or read_name(name).unit or known_unit(name)


def _increases(values: FloatArray | tuple[str, ...]) -> bool:
    """Whether nearly every row is later than the one before: it may be a clock."""
    values = floats(values)
    times = values[np.isfinite(values)]
    return len(times) > 1 and float(np.mean(times[1:] > times[:-1])) > 0.9


def _plausible_time(table: FileTable, values: FloatArray, name: str, declared_unit: str, guess: Guess) -> Unit | None:
    """The one unit under which rows are as far apart as a log has them; None where there are two or none.

    Of several, a clock that counts from 1970 or a motion that fits its speed leaves one.
    """
    if declared_unit and declared_unit not in ("-", "SI"):
        guess.doubts.append(doubt(name, TIME, "unit_unknown", unit=declared_unit))
        return None
    finite = values[np.isfinite(values)]
    step, possible = _possible_units(values)
    if len(possible) > 1:
        since_1970 = [unit for unit in possible if NOWADAYS[0] <= finite[0] * unit.size <= NOWADAYS[1]]
        possible = since_1970 if len(since_1970) == 1 else _of_motion(table, values, possible, guess)
    if len(possible) != 1:
        texts = tuple(unit.text for unit in possible)
        guess.doubts.append(doubt(name, TIME, "time_without_unit", texts or UNIT, step=step))
        return None
    guess.note("time_unit_taken", column=name, unit=possible[0].text, step_s=step * possible[0].size)
    return possible[0]


def _possible_units(values: FloatArray) -> tuple[float, list[Unit]]:
    """(the usual step between rows in the unit of the column, the units in which rows may be so far apart)."""
    finite = values[np.isfinite(values)]
    steps = np.diff(finite)
    steps = steps[steps > 0.0]
    step = float(np.median(steps)) if steps.size else 0.0
    units = [parse_unit(text) for text in TIME_NAMES]
    return step, [unit for unit in units if _is_step(step * unit.size, len(finite))]


def _is_step(step: float, rows: int) -> bool:
    """Whether so many rows may be so far apart [s]: those slower than usual are few."""
    return SHORTEST_STEP <= step <= LONGEST_STEP and (step <= USUAL_STEP or step * rows <= LONGEST_SLOW)


def _of_motion(table: FileTable, times: FloatArray, possible: list[Unit], guess: Guess) -> list[Unit]:
    """The units under which speeds are those of what is moved in the log; all of them where it has no such pair."""
    steps = np.diff(times)
    for speeds, places in _pairs(guess):
        moved, expected = 0.0, 0.0
        for speed, position in zip(speeds, places, strict=True):
            rate, place = (floats(table.columns[column.name]) * column.factor for column in (speed, position))
            pair = np.array([np.abs(np.diff(place)), np.abs(rate[1:] + rate[:-1]) / 2.0 * steps])
            moved, expected = np.array([moved, expected]) + pair[:, np.isfinite(pair).all(axis=0)].sum(axis=1)
        if not (moved > 0.0 and expected > 0.0):
            continue
        alike = [unit for unit in possible if 1.0 / SAME_MOTION < expected * unit.size / moved < SAME_MOTION]
        if len(alike) == 1:
            return alike
    return possible


def _pairs(guess: Guess) -> list[tuple[list[Column], list[Column]]]:
    """Speeds and the positions that they move: of each wheel, of the heading, of the body along x and y."""
    columns = guess.columns
    names = [([f"w{key[1:]}"], [key]) for key in columns if re.fullmatch(r"a\d+", key)]
    names += [(["omega"], ["heading"]), (["vx", "vy"], ["x", "y"])]
    return [
        ([columns[name] for name in speeds], [columns[name] for name in places])
        for speeds, places in names
        if columns.keys() >= {*speeds, *places}
    ]


def refuse_second_time(
    table: FileTable, assumed: Mapping[str, str], column_map: ColumnMap | None, overrides: Mapping[str, Column]
) -> None:
    """Raises InputError where a table whose time was made of a rate has a time of its own, or one is named."""
    rate_column = next(name for name, declaration in table.says.items() if declaration.component == TIME)
    time_column = overrides.get(TIME) or (column_map.columns.get(TIME) if column_map is not None else None)
    if time_column is None:
        guess, declarations = (
            Guess(),
            {name: declaration for name, declaration in table.says.items() if name != rate_column},
        )
        declared_time = next((name for name, declaration in declarations.items() if declaration.component == TIME), "")
        take_time(replace(table, names=table.names[1:], says=declarations), assumed, guess)
        time_column = Column(declared_time, "s") if declared_time else guess.columns.get(TIME)
    if time_column is not None and time_column.name != rate_column:
        raise InputError(
            "the log has a time already",
            got=f"the column {time_column.name}, and `rate`",
            expected="one of the two",
            remedy="leave `rate` out",
            where=table.source,
        )
