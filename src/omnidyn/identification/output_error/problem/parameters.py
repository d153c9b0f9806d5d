"""What a fit may change: numbers of the robot file and nuisances, each with its bounds, its scale and what is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from omnidyn.errors import InputError
from omnidyn.model.robot import Robot
from omnidyn.simulation.sensitivity.directions import changed_parameter, parameter

FloatArray = NDArray[np.float64]

FRICTION = tuple(f"friction.axes.{name}[{axis}]" for name in ("viscous", "coulomb") for axis in range(3))
TORQUE, EMF = "motor.torque_constant_Nm_A", "motor.emf_constant_Vs_rad"
FRICTION_LIMIT = 1e6  # what a robot file takes
AT = "@"  # KEY@GROUP is the number that a group has for itself
SPAN = 1e4  # a number that must be positive stays within so many times its start, either way

LARGEST = 700.0  # e^709 is the last float


@dataclass(frozen=True)
class Parameter:
    """One free number. The solver sees log(value) where `log`, so that it stays positive, else the value.

    name: key of the robot file, or of a nuisance. value: where it starts. low, high: bounds. prior: (mean, std) of what
    is known beforehand, in the unit of the value. also: other keys of the robot file, tied to it by a factor.
    """

    name: str
    value: float
    low: float
    high: float
    log: bool = False
    prior: tuple[float, float] | None = None
    also: tuple[tuple[str, float], ...] = ()

    def inner(self, value: float) -> float:
        """The number that the solver sees."""
        return math.log(value) if self.log else value

    def outer(self, inner: float) -> float:
        """The value behind the number that the solver sees."""
        return math.exp(min(inner, LARGEST)) if self.log else inner

    def slope(self, value: float) -> float:
        """d value / d inner."""
        return value if self.log else 1.0

    def on(self, robot: Robot, value: float) -> Robot:
        """The robot with this number and those tied to it; not checked, for speed."""
        robot = changed_parameter(robot, self.name, value, checked=False)
        for key, factor in self.also:
            robot = changed_parameter(robot, key, factor * value, checked=False)
        return robot


def robot_parameter(robot: Robot, key: str, tied: bool, prior: tuple[float, float] | None) -> Parameter:
    """A number of the robot file as a free parameter.

    Friction may be 0: it has a linear scale and a bound at 0. What must be positive has a logarithmic one. `tied`: the
    EMF constant keeps its ratio to the torque constant, for both are one number of the magnet.
    Raises InputError for an unknown key, and for a number that is not positive and has no bound at 0.
    """
    value = float(parameter(robot, key))
    if key.startswith("friction."):
        return Parameter(key, value, 0.0, FRICTION_LIMIT, prior=prior)
    if value <= 0.0:
        raise InputError("cannot be free", got=f"{key} = {value:g}", expected="a number above 0", where="free")
    also = ((EMF, float(parameter(robot, EMF)) / value),) if tied and key == TORQUE else ()
    return Parameter(key, value, value / SPAN, value * SPAN, True, prior, also)


def names_of(names: str | Sequence[str]) -> tuple[str, ...]:
    """Names as a tuple; a string is one name."""
    return (names,) if isinstance(names, str) else tuple(names)


def refuse_unknown(keys: Sequence[str], robot: Robot) -> None:
    """Raises InputError for a key that the robot does not have: left alone it would hold nothing.

    Breakaway may be fixed where the robot has none: it follows coulomb then.
    """
    for key in keys:
        if not key.startswith("friction.axes.breakaway"):
            parameter(robot, key)


def robot_parameters(robot: Robot, keys: Sequence[str], priors: dict[str, tuple[float, float]]) -> list[Parameter]:
    """Free parameters by key; the EMF constant is tied to the torque constant unless it is asked for itself."""
    twice = sorted({key for key in keys if list(keys).count(key) > 1})
    if twice:
        raise InputError("asked for twice", got=", ".join(twice), expected="every key once", where="free")
    tied = EMF not in keys and np.ndim(robot.motor.torque_constant) == 0 and np.ndim(robot.motor.emf_constant) == 0
    return [robot_parameter(robot, key, tied, priors.get(key)) for key in keys]
