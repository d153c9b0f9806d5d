"""Names of what a log can hold: the channels of a Run, taken apart into one component per column.

voltage u1 u2 ..   duty d1 ..   current i1 ..   wheel_angle a1 ..   wheel_speed w1 ..   wheel_speed_command w1_cmd ..
twist vx vy omega   twist_command vx_cmd vy_cmd omega_cmd   pose x y heading   supply   force f1
"""

from __future__ import annotations

import re

from omnidyn.run import CHANNELS, WHEEL

TIME = "t"

# Components of a channel of wheels, "{}" being the number of the wheel, or of any other channel.
_OF_WHEELS = {
    "voltage": "u{}",
    "duty": "d{}",
    "current": "i{}",
    "wheel_angle": "a{}",
    "wheel_speed": "w{}",
    "wheel_speed_command": "w{}_cmd",
    "force": "f{}",
}
_OTHER_COMPONENTS = {
    "twist": ("vx", "vy", "omega"),
    "twist_command": ("vx_cmd", "vy_cmd", "omega_cmd"),
    "pose": ("x", "y", "heading"),
    "supply": ("supply",),
}
_WHEEL_COMPONENT = re.compile(r"([a-z])([1-9]\d?)(_cmd)?", re.ASCII)

# SI unit of each component, as it ends the names of the columns of a run file; per axis where the axes differ.
_UNITS = {
    "voltage": "V",
    "duty": "duty",
    "current": "A",
    "wheel_angle": "rad",
    "wheel_speed": "rad_s",
    "wheel_speed_command": "rad_s",
    "supply": "V",
    "force": "N",
    "pose": ("m", "m", "rad"),
    "twist": ("m_s", "m_s", "rad_s"),
    "twist_command": ("m_s", "m_s", "rad_s"),
}


def components(channel: str, wheels: int) -> tuple[str, ...]:
    """Components of a channel in the order of its columns: ("u1", "u2", "u3") or ("vx", "vy", "omega")."""
    if CHANNELS[channel] == WHEEL:
        return tuple(_OF_WHEELS[channel].format(wheel + 1) for wheel in range(wheels))
    return _OTHER_COMPONENTS[channel]


def place(component: str) -> tuple[str, int] | None:
    """Channel and column of a component: ("voltage", 1) for "u2"; None for a name that is none."""
    for channel, names in _OTHER_COMPONENTS.items():
        if component in names:
            return channel, names.index(component)
    match = _WHEEL_COMPONENT.fullmatch(component)
    for channel, form in _OF_WHEELS.items():
        if match and form.format(match[2]) == component:
            return channel, int(match[2]) - 1
    return None


def si_suffix(component: str) -> str:
    """SI unit of a component as it ends a column of a run file: "rad_s" of "w1". KeyError for an unknown name."""
    if component == TIME:
        return "s"
    location = place(component)
    if location is None:
        raise KeyError(component)
    unit = _UNITS[location[0]]
    return unit if isinstance(unit, str) else unit[location[1]]
