"""Levels of breakaway by their keys: what holds a robot at rest, nowhere less than the Coulomb friction it slides
with.

A level of a list that the robot does not have puts the list there; its other entries are those of Coulomb friction.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from omnidyn.model.keys import BREAKAWAY, Key
from omnidyn.model.robot import Robot

# What each level of breakaway is at least; `backward` is coulomb where there is no other.
COULOMB_OF = {"breakaway": "coulomb", "yaw_breakaway": "yaw_coulomb", "breakaway_backward": "backward"}


def holding(robot: Robot, levels: Mapping[str, float] | None = None) -> Robot:
    """The robot with these levels of breakaway, key -> [N], about yaw [N m], and all others as it has them.

    Not checked. One that is below its Coulomb friction, such as 0, is that.
    """
    friction, laws = robot.friction, {}
    requests = [(Key.parse(name), level) for name, level in (levels or {}).items()]
    for table in type(friction).model_fields:
        law = getattr(friction, table)
        breakaways = {field: value for field, value in dict(law).items() if BREAKAWAY in field}
        for key, level in requests:
            if key.table.rpartition(".")[2] == table:
                breakaways[key.field] = _with(
                    breakaways[key.field], slides(robot, key), key.index, level, robot.wheels.count
                )
        breakaways = {
            k: _at_least(level, getattr(law, COULOMB_OF[k])) for k, level in breakaways.items() if level is not None
        }
        if breakaways:
            laws[table] = law.model_copy(update=breakaways)
    return robot.model_copy(update={"friction": friction.model_copy(update=laws)}) if laws else robot


def slides(robot: Robot, key: Key) -> Any:
    """Coulomb friction below a breakaway [N], about yaw [N m]: the whole list where it stands in one."""
    return getattr(getattr(robot.friction, key.table.rpartition(".")[2]), COULOMB_OF[key.field])


def slides_least(robot: Robot, name: str) -> float:
    """The Coulomb friction that a breakaway is at least [N, N m], by its key; of several wheels, of the easiest."""
    key = Key.parse(name)
    levels = np.atleast_1d(slides(robot, key)).astype(float)
    return float(levels[key.index] if key.index is not None and len(levels) > 1 else levels.min())


def _with(present: Any, below: Any, index: int | None, level: float, count: int) -> Any:
    """A level, or a list of them, with one changed. present: as it is, or None; below: of Coulomb friction."""
    if index is None:
        return level
    many = np.array(below if present is None else present, dtype=float)
    many = many if many.ndim else np.full(count, float(many))
    many[index] = level
    return tuple(many.tolist())


def _at_least(level: Any, floor: Any) -> Any:
    """Level by level; one for all wheels stays one where each slides with less."""
    higher = np.maximum(level, floor)
    return (
        level
        if np.array_equal(higher, np.broadcast_to(level, higher.shape))
        else (tuple(higher.tolist()) if higher.ndim else float(higher))
    )
