"""Ask about columns of wheels, in1 in2 in3 or motor_front_left .., whose names do not say what they measure."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence

from omnidyn.logs.channels import place
from omnidyn.logs.columns import names as words
from omnidyn.logs.columns.doubts import Doubt, doubt
from omnidyn.logs.columns.names import read_name, says_no_quantity
from omnidyn.logs.columns.wheel_places import wheels_at
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import MAX_WHEELS, MIN_WHEELS
from omnidyn.statement import NOTE

# What a log needs: the components that serve, and units in which wheels may have it.
_DRIVE = re.compile(r"[ud]\d+|w\d+_cmd|vx_cmd"), ("V", "duty")
_MOTION = re.compile(r"[wa]\d+|vx|x"), ("rad/s", "rad", "ticks/COUNTS_PER_TURN")


def unnamed_families(names: Sequence[str], components: Collection[str], robot: Robot | None = None) -> list[Doubt]:
    """A doubt for each family of columns that may be what a log lacks: what drives its motors, or how they turn.

    names: of the columns that nobody took and no doubt names, without a unit. components: those that are taken, or that
    a doubt is about. A family counts from 0 or 1, or has a place for each wheel; of a robot, for each of its wheels.
    """
    units: tuple[str, ...] = ()
    for served_by, choices in (_DRIVE, _MOTION):
        if not any(served_by.fullmatch(component) for component in components):
            units += choices
    families: dict[str, dict[float, str]] = {}
    for name in filter(says_no_quantity, names if units else ()):
        match, parts = re.fullmatch(r"(.*?)[ _]?(\d{1,2})", name, re.DOTALL), read_name(name)
        stem, number = (match[1], int(match[2])) if match else (parts.before, parts.place)
        if stem and number is not None and not place(f"{stem}1"):
            families.setdefault(stem, {})[number] = name
    return [
        Doubt("quantity_unknown", NOTE, "", {}, "", tuple(family.values()), (), units, stem)
        for stem, family in families.items()
        if _are_wheels(family, robot)
    ]


def _are_wheels(numbers: Collection[float], robot: Robot | None) -> bool:
    """Whether they are as many as a robot has wheels, and 1, 2, .. or 0, 1, .. or the places of wheels."""
    count = len(numbers)
    as_many = MIN_WHEELS <= count <= MAX_WHEELS if robot is None else count == robot.wheels.count
    counted = sorted(numbers) in (list(range(count)), list(range(1, count + 1)))
    return as_many and (counted or bool(wheels_at(numbers, robot)))


def volts_or_speeds(names: Iterable[str]) -> list[Doubt]:
    """A doubt for each of V1, V2, .. or fl_v, ..: volts, or speeds of the rims? Nobody knows."""
    parts = {name: read_name(name) for name in names}
    unclear = {name: read for name, read in parts.items() if read.unit is None and read.roles == {words.LINEAR}}
    numbered = {name: read.number for name, read in unclear.items() if read.number is not None}
    doubts = [
        doubt(name, f"u{number}", "volts_or_speeds", (), first=next(iter(numbered)))
        for name, number in numbered.items()
    ]
    return doubts + [
        Doubt("volts_or_speeds_of_places", NOTE, "", {}, "", (name,), ("u1",), ("V", "m/s"), read.before)
        for name, read in unclear.items()
        if read.place is not None
    ]
