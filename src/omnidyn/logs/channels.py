"""Names of what a log can hold: the channels of a Run, taken apart into one component per column.

Such as u1 u2 of a voltage, vx vy omega of a twist: the table stands in sensors.py.
"""

from __future__ import annotations

import re

from omnidyn.sensors import CHANNELS, TABLE, WHEEL

TIME = "t"

_COMPONENTS = {name: channel.components for name, channel in TABLE.items()}
_WHEEL_COMPONENT = re.compile(r"([a-z])([1-9]\d?)(_cmd)?", re.ASCII)


def components(channel: str, wheels: int) -> tuple[str, ...]:
    """Components of a channel in the order of its columns: ("u1", "u2", "u3") or ("vx", "vy", "omega")."""
    names = TABLE[channel].components
    return tuple(names[0].format(wheel + 1) for wheel in range(wheels)) if CHANNELS[channel] == WHEEL else names


def place(component: str) -> tuple[str, int] | None:
    """Channel and column of a component: ("voltage", 1) for "u2"; None for a name that is none."""
    match = _WHEEL_COMPONENT.fullmatch(component)
    for channel, (name, *others) in _COMPONENTS.items():
        if component == name or component in others:
            return channel, [name, *others].index(component)
        if match and CHANNELS[channel] == WHEEL and name.format(match[2]) == component:
            return channel, int(match[2]) - 1
    return None


def si_suffix(component: str) -> str:
    """SI unit of a component as it ends a column of a run file: "rad_s" of "w1". KeyError for an unknown name."""
    if component == TIME:
        return "s"
    location = place(component)
    if location is None:
        raise KeyError(component)
    channel, column = location
    units = TABLE[channel].units
    unit = units[column % len(units)]
    return channel if unit == "1" else unit.replace("/", "_")
