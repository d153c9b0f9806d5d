"""Channels of a log, one row each: what its columns are, and how checks, fits and comparisons see what was measured.

A new sensor is a row here, a field of `Run`, and its physics: docs/extending.md has the recipe.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

WHEEL, AXIS, SCALAR = "wheel", "axis", "scalar"
ALL = slice(None)


@dataclass(frozen=True)
class Channel:
    """kind: a column per wheel, per axis (x, y, yaw), or one. components: of its columns, "{}" the number of a wheel.

    units: SI, one for all columns or one each. words: for people, of all wheels. outputs: the names under which a fit
    takes it, and which of its columns; none for an input. shows_motion: whether it tells where and how fast the robot
    begins. from_start: whether it counts from an unknown start. counted: whether an encoder gives it in whole counts.
    behind_gear: whether it is, at the motor, the gear ratio times as much. integral: the channel that sums it up.
    """

    kind: str
    components: tuple[str, ...]
    units: tuple[str, ...]
    words: str = ""
    outputs: Mapping[str, slice] = field(default_factory=dict)
    shows_motion: bool = False
    from_start: bool = False
    counted: bool = False
    behind_gear: bool = False
    integral: str = ""


_TWIST, _POSE = ("m/s", "m/s", "rad/s"), ("m", "m", "rad")
TABLE = {
    "voltage": Channel(WHEEL, ("u{}",), ("V",), "voltages"),
    "duty": Channel(WHEEL, ("d{}",), ("1",)),
    "current": Channel(WHEEL, ("i{}",), ("A",), "currents", {"current": ALL}),
    "wheel_angle": Channel(
        WHEEL,
        ("a{}",),
        ("rad",),
        "wheel angles",
        {"wheel_angle": ALL},
        shows_motion=True,
        from_start=True,
        counted=True,
        behind_gear=True,
    ),
    "wheel_speed": Channel(
        WHEEL,
        ("w{}",),
        ("rad/s",),
        "wheel speeds",
        {"wheel_speed": ALL},
        shows_motion=True,
        behind_gear=True,
        integral="wheel_angle",
    ),
    "wheel_speed_command": Channel(WHEEL, ("w{}_cmd",), ("rad/s",), behind_gear=True),
    "twist": Channel(AXIS, ("vx", "vy", "omega"), _TWIST, outputs={"twist": ALL}, shows_motion=True),
    "twist_command": Channel(AXIS, ("vx_cmd", "vy_cmd", "omega_cmd"), _TWIST),
    "pose": Channel(
        AXIS,
        ("x", "y", "heading"),
        _POSE,
        outputs={"heading": slice(2, 3), "position": slice(0, 2)},
        shows_motion=True,
        from_start=True,
    ),
    "supply": Channel(SCALAR, ("supply",), ("V",)),
    "force": Channel(WHEEL, ("f{}",), ("N",)),
}

CHANNELS = {name: channel.kind for name, channel in TABLE.items()}
UNITS = {name: ", ".join(channel.units) for name, channel in TABLE.items()}
SENSORS = ("wheel_speed", "wheel_angle", "twist", "pose", "current")  # measured, those asked first for times first
SHOWN = ("twist", "wheel_speed", "wheel_angle", "current", "voltage", "pose")  # what a model predicts, as it is shown
PREDICTED = tuple(name for name in SHOWN if name in SENSORS)

COUNTED = tuple(name for name in SENSORS if TABLE[name].counted)
FROM_START = tuple(name for name in PREDICTED if TABLE[name].from_start)
OF_WHEELS = tuple(name for name in SENSORS if TABLE[name].behind_gear)  # sensors of how wheels turn
BEHIND_GEAR = tuple(name for name, channel in TABLE.items() if channel.behind_gear)
OF_MOTORS = tuple(name for name, kind in CHANNELS.items() if kind == WHEEL and name != "force")

MEASURED = {output: (name, columns) for name in PREDICTED for output, columns in TABLE[name].outputs.items()}
OUTPUTS = tuple(sorted(MEASURED, key=lambda output: MEASURED[output][0] in COUNTED))  # as a fit takes them, counts last
TRAVEL = tuple(output for output in OUTPUTS if MEASURED[output][0] in FROM_START)
STARTS = tuple(output for output in MEASURED if TABLE[MEASURED[output][0]].shows_motion)
