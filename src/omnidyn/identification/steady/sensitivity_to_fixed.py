"""What the levels of a steady state rest on: the logs asked anew with each fixed number 1 % larger."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import OmnidynError
from omnidyn.model.keys import EMF, TORQUE, Key, expand
from omnidyn.model.known.told import known_priors
from omnidyn.model.robot import Robot

STEP = 0.01
# Keys, with what follows them: those that forces and speeds are made with.
FIXED = {
    TORQUE: (EMF,),
    "motor.resistance_ohm": (),
    "motor.gear_ratio": (),
    "wheels.wheel_radius_m": (),
    "wheels.robot_radius_m": (),
    EMF: (),
}


def rests_on(
    robot: Robot, value: Mapping[str, float], refit: Callable[[Robot], Mapping[str, float]]
) -> dict[str, dict[str, float]]:
    """Number -> fixed key -> relative change of the number per percent of the key. refit: the numbers of a robot."""
    changes_by_number: dict[str, dict[str, float]] = {name: {} for name in value}
    for key, tied_keys in FIXED.items():
        try:
            other_values = refit(_larger(robot, key, *tied_keys))
        except OmnidynError:  # no number of this robot, or none that these logs can be read with
            continue
        for name, value_now in value.items():
            if value_now > 0.0 and name in other_values:
                changes_by_number[name][key] = other_values[name] / value_now - 1.0
    return changes_by_number


def moved_by_the_file(
    robot: Robot, value: Mapping[str, float], refit: Callable[[Robot], Mapping[str, float]]
) -> FloatArray:
    """What one std of each number that the file of the robot knows only so far moves the numbers by, to first order.
    Shape (numbers, K). A torque constant brings the EMF constant with it: both are one number of the magnet."""
    std_by_key = {key: std for key, (_, std) in known_priors(robot).items() if Key.parse(key).name in FIXED}
    magnet = any(Key.parse(key).name == TORQUE for key in std_by_key)
    shifts = []
    for key, std in std_by_key.items():
        place = Key.parse(key)
        if magnet and place.name == EMF:
            continue
        try:
            other_values = refit(_larger(robot, key, *(str(Key(name, place.index)) for name in FIXED[place.name])))
        except OmnidynError:  # no number that these logs are read with
            continue
        size = STEP * float(place.get(robot))
        shifts.append(
            [std / size * (other_values.get(name, value_now) - value_now) for name, value_now in value.items()]
        )
    return np.array(shifts).reshape(-1, len(value)).T


def _larger(robot: Robot, *names: str) -> Robot:
    for name in names:
        for key in map(Key.parse, expand(name, robot)):
            robot = key.set(robot, (1.0 + STEP) * float(key.get(robot)))
    return robot
