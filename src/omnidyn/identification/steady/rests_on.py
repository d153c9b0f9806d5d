"""What the levels of a steady state rest on: the logs asked anew with each fixed number 1 % larger."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from omnidyn.errors import OmnidynError
from omnidyn.model.keys import EMF, TORQUE, Key, expand
from omnidyn.model.robot import Robot

STEP = 0.01
# Keys, with what follows them: those that forces and speeds are made with.
FIXED = {
    TORQUE: (EMF,), "motor.resistance_ohm": (), "motor.gear_ratio": (), "wheels.wheel_radius_m": (),
    "wheels.robot_radius_m": (),
}  # fmt: skip


def rests_on(
    robot: Robot, value: Mapping[str, float], again: Callable[[Robot], Mapping[str, float]]
) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key. again: the numbers of a robot."""
    found: dict[str, dict[str, float]] = {name: {} for name in value}
    for key, beside in FIXED.items():
        try:
            other = again(_larger(robot, key, *beside))
        except OmnidynError:  # no number of this robot, or none that these logs can be read with
            continue
        for name, now in value.items():
            if now > 0.0 and name in other:
                found[name][key] = other[name] / now - 1.0
    return found


def _larger(robot: Robot, *names: str) -> Robot:
    for name in names:
        for key in map(Key.parse, expand(name, robot)):
            robot = key.set(robot, (1.0 + STEP) * float(key.get(robot)))
    return robot
