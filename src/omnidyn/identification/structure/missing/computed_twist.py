"""What a log of nothing but a twist hides, if the robot computed that from its wheels, with a radius that is wrong.

Wheels s times as large as said show v/s: exactly what motors of s^2 the resistance, or of 1/s^2 the voltage, and
Coulomb friction over s do (M v' = G K (u - E G'v/(s r))/(R s r) - F sgn v); wheels s times as far out as said turn
like
a body of I/s^2. No fit to such a log can tell.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from omnidyn.identification.lack_of_fit import Remedy
from omnidyn.model.actuation import GAIN
from omnidyn.statement import NOTE, Statement

HIDDEN_KEYS = {
    "motor.resistance_ohm": "wheels.wheel_radius_m",
    GAIN: "wheels.wheel_radius_m",
    "body.inertia_kg_m2": "wheels.robot_radius_m",
}


def hidden_by(key: str, columns: Iterable[tuple[str, int]]) -> list[str]:
    """The radius that looks like a change of a number, to logs of these columns: none, or one."""
    return [HIDDEN_KEYS[key]] if key in HIDDEN_KEYS and {name for name, _ in columns} == {"twist"} else []


def with_odometry(remedies: Sequence[Remedy], columns: Sequence[tuple[str, int]]) -> tuple[Remedy, ...]:
    """The same; those that may be a radius name it, and the radius them."""
    hidden_by_key = {remedy.key: hidden_by(remedy.key, columns) for remedy in remedies}
    new_remedies = []
    for remedy in remedies:
        alias_keys = [key for key, radii in hidden_by_key.items() if remedy.key in radii]
        cause = Statement("if_odometry", NOTE, numbers={"cause": remedy.cause}) if alias_keys else remedy.cause
        equal_keys = tuple(dict.fromkeys((*remedy.same_as, *hidden_by_key[remedy.key], *alias_keys)))
        new_remedies.append(replace(remedy, same_as=equal_keys, cause=cause))
    return tuple(new_remedies)
