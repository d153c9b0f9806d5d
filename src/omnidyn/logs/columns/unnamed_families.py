"""Ask about columns that are numbered as wheels are, in1 in2 in3, and whose names do not say what they measure."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from omnidyn.logs.channels import place
from omnidyn.logs.columns.doubts import Doubt
from omnidyn.logs.columns.names import says_no_quantity
from omnidyn.model.robot import Robot
from omnidyn.model.wheels import MAX_WHEELS, MIN_WHEELS
from omnidyn.statement import NOTE

# What a log needs: the components that serve, and units in which wheels may have it.
_DRIVE = re.compile(r"[ud]\d+|w\d+_cmd|vx_cmd"), ("V", "duty")
_MOTION = re.compile(r"[wa]\d+|vx|x"), ("rad/s", "rad")


def unnamed_families(names: Sequence[str], components: Collection[str], robot: Robot | None = None) -> list[Doubt]:
    """A doubt for each family of columns that may be what a log lacks: what drives its motors, or how they turn.

    names: of the columns that nobody took and no doubt names, without a unit. components: those that are taken, or that
    a doubt is about. A family counts from 0 or 1, to the wheels of the robot where there is one.
    """
    units: tuple[str, ...] = ()
    for served_by, choices in (_DRIVE, _MOTION):
        if not any(served_by.fullmatch(component) for component in components):
            units += choices
    families: dict[str, dict[int, str]] = {}
    for name in names if units else ():
        match = re.fullmatch(r"(.*?)[ _]?(\d{1,2})", name, re.DOTALL)
        if match and match[1] and not place(f"{match[1]}1") and says_no_quantity(name):
            families.setdefault(match[1], {})[int(match[2])] = name
    return [
        Doubt("quantity_unknown", NOTE, "", {}, "", tuple(family.values()), (), units, stem)
        for stem, family in families.items()
        if _counts_wheels(family, robot)
    ]


def _counts_wheels(numbers: Collection[int], robot: Robot | None) -> bool:
    """Whether numbers are 1, 2, .. or 0, 1, .. to as many as a robot has wheels."""
    count = len(numbers)
    as_many = MIN_WHEELS <= count <= MAX_WHEELS if robot is None else count == robot.wheels.count
    return as_many and sorted(numbers) in (list(range(count)), list(range(1, count + 1)))
