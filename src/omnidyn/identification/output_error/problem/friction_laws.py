"""Breakaway where the level falls with the speed, from breakaway to Coulomb: a smooth number, with a derivative.

Where it does not fall, S says only which drives hold: trust/breakaway.py. Here every slow row tells of it. S is never
below C; they are kept so far apart that the slopes of the fall exist: nearer, no log tells them apart.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from omnidyn.identification.output_error.problem.parameters import AT, Parameter
from omnidyn.model.friction.kinds import KINDS
from omnidyn.model.keys import BREAKAWAY, COULOMB, Key, find_key
from omnidyn.model.robot import Robot

LEVEL_RATIO = 1.001  # S over C at least


def falls(name: str, robot: Robot) -> bool:
    """Whether this is the breakaway of a law that falls from it with the speed."""
    key = find_key(name)
    if key is None or key.level != BREAKAWAY:
        return False
    law = getattr(robot.friction, key.table.rpartition(".")[2])
    speed = "yaw_stribeck_speed" if key.field.startswith("yaw_") else "stribeck_speed"
    return KINDS[law.law].falls and getattr(law, speed, None) is not None


def coulomb_below(name: str, robot: Robot | None = None) -> str:
    """The Coulomb level that this breakaway is at least; of a group, that of the group.

    robot: whose own level backward it is, where it has one.
    """
    key, separator, group = name.partition(AT)
    coulomb_name = key.replace(BREAKAWAY, COULOMB)
    law = robot and getattr(robot.friction, Key.parse(key).table.rpartition(".")[2])
    if law is not None and "_backward" in coulomb_name and law.coulomb_backward is None:
        coulomb_name = coulomb_name.replace("_backward", "")
    return f"{coulomb_name}{separator}{group}"


def speed_of(name: str, names: Sequence[str]) -> str:
    """Of `names`, the speed over which this breakaway falls; "" where it is not among them."""
    key, separator, group = name.partition(AT)
    level_key = Key.parse(key)
    yaw = "yaw_" if level_key.field.startswith("yaw_") else ""
    list_, end = f"{level_key.table}.{yaw}stribeck_speed", "" if level_key.index is None else f"[{level_key.index}]"
    return next(
        (
            speed_name
            for speed_name in (f"{list_}{end}{separator}{group}", f"{list_}{separator}{group}")
            if speed_name in names
        ),
        "",
    )


def kept_in_order(p: Parameter, robot: Robot, names: Sequence[str]) -> Parameter:
    """The parameter with the bound that the other level is, where that one is not free (`names`) and they fall."""
    if falls(p.name, robot) and coulomb_below(p.name, robot) not in names:
        least_level = LEVEL_RATIO * float(Key.parse(coulomb_below(p.name, robot)).get(robot))
        return replace(p, low=max(p.low, least_level), value=max(p.value, least_level))
    breakaway_name = p.name.replace(COULOMB, BREAKAWAY)
    if Key.parse(p.name).level == COULOMB and breakaway_name not in names and falls(breakaway_name, robot):
        hold = _level(breakaway_name, robot)
        most_level = p.high if hold is None else hold / LEVEL_RATIO
        return replace(p, high=min(p.high, most_level), value=min(p.value, most_level))
    return p


def _level(name: str, robot: Robot) -> float | None:
    """A level of the robot; None where it has none."""
    key = Key.parse(name)
    law = getattr(robot.friction, key.table.rpartition(".")[2])
    return None if getattr(law, key.field, None) is None else float(key.get(robot))
