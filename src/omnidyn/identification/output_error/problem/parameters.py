"""What a fit may change: numbers of the robot file and nuisances, each with its bounds, its scale and what is known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.errors import InputError
from omnidyn.model.keys import BREAKAWAY, CENTRE, EMF, FRICTION, ROTOR, TORQUE, WHEEL, Key, expand
from omnidyn.model.robot import Robot

LEAST_LATENCY, MOST_LATENCY = -0.1, 0.3  # [s] of a drive or sensor
FRICTION_LIMIT = 1e6  # what a robot file takes
AT = "@"  # KEY@GROUP is the number that a group has for itself
EFFICIENCY = "motor.gear_efficiency"  # of which nothing is above 1
SPAN = 1e4  # a number that must be positive stays within so many times its start, either way
SPAN_OF_SPEED = 30.0  # the same of a speed at which friction changes: far beyond, it changes nothing, or in no time
LIGHT = 1e-3  # of its start, that what spins stays above: it has no place where it would be off, but slopes need a size

OFFSET_SHARE = 0.95  # of the distance of the wheels: as far as a centre of mass may be ahead, or aside
LARGEST = 700.0  # e^709 is the last float


@dataclass(frozen=True)
class Parameter:
    """One free number. The solver sees log(value) where `log`, so that it stays positive, else the value.

    name: key of the robot file, or of a nuisance. value: where it starts. low, high: bounds. prior: (mean, std) of what
    is known beforehand, in the unit of the value; of a `log` number std over mean is that of its logarithm, so that
    half and twice of a rough guess are equally far from it. tied_numbers: other keys of the robot file, tied by a
    factor.
    """

    name: str
    value: float
    low: float
    high: float
    log: bool = False
    prior: tuple[float, float] | None = None
    tied_numbers: tuple[tuple[str, float], ...] = ()

    @property
    def part(self) -> str:
        """What it belongs to: the part of the robot, such as "motor"; of a nuisance its kind, such as "latency"."""
        return self.name.partition(".")[0].partition("@")[0]

    def inner(self, value: float) -> float:
        """The number that the solver sees."""
        return math.log(value) if self.log else value

    def outer(self, inner_value: float) -> float:
        """The value behind the number that the solver sees."""
        return math.exp(min(inner_value, LARGEST)) if self.log else inner_value

    def slope(self, value: float) -> float:
        """d value / d inner."""
        return value if self.log else 1.0

    @property
    def inner_prior(self) -> tuple[float, float] | None:
        """The prior in the numbers that the solver sees: (mean, std)."""
        if self.prior is None:
            return None
        mean, std = self.prior
        return self.inner(mean), std / mean if self.log else std

    def on(self, robot: Robot, value: float) -> Robot:
        """The robot with this number and those tied to it; not checked, for speed."""
        robot = Key.parse(self.name).set(robot, value, checked=False)
        for key, factor in self.tied_numbers:
            robot = Key.parse(key).set(robot, factor * value, checked=False)
        return robot


def robot_at(robot: Robot, parameters: Sequence[Parameter], values: Sequence[float] | FloatArray) -> Robot:
    """The robot with these values of its numbers, not checked; values beyond the parameters are of nuisances."""
    for p, value in zip(parameters, values, strict=False):
        robot = p.on(robot, float(value))
    return robot


def robot_parameter(
    robot: Robot, key: str, prior: tuple[float, float] | None, free_names: Sequence[str] = ()
) -> Parameter:
    """A number of the robot file as a free parameter; `free_names` are free beside it.

    Friction may be 0: it has a linear scale and a bound at 0. So may what rotors and wheels weigh beside the body: on
    a logarithmic scale 0 is infinitely far off, and a robot without rotors keeps some of the guess as mass. A centre of
    mass may be on either side, between the wheels. What must be positive has a logarithmic scale.
    Raises InputError for an unknown key, and for a number that is not positive and has no bound at 0.
    """
    place = Key.parse(key)
    value = float(place.get(robot))
    if place.level:
        return Parameter(key, value, 0.0, FRICTION_LIMIT, prior=prior)
    if place.name == CENTRE:
        widest_offset = OFFSET_SHARE * max(np.atleast_1d(robot.wheels.robot_radius).tolist())
        return Parameter(key, value, -widest_offset, widest_offset, prior=prior)
    if value <= 0.0:
        raise InputError("cannot be free", got=f"{key} = {value:g}", expected="a number above 0", where="free")
    if place.name in (ROTOR, WHEEL):
        return Parameter(key, value, LIGHT * value, value * SPAN, prior=prior)
    span = SPAN_OF_SPEED if place.part == FRICTION and place.field.endswith("_speed") else SPAN
    upper_limit = 1.0 if place.name == EFFICIENCY else value * span
    tied_numbers = tuple(
        (str(follower), float(follower.get(robot)) / value) for follower in _followers(robot, place, free_names)
    )
    return Parameter(key, value, value / span, upper_limit, True, prior, tied_numbers)


def _followers(robot: Robot, key: Key, free_names: Sequence[str]) -> list[Key]:
    """The EMF constants that keep their ratio to this torque constant, for both are one number of the magnet.

    Wheel by wheel where either stands once for each; those that are free themselves do not follow.
    """
    free_emf_keys = [free_key for free_key in map(Key.parse, free_names) if free_key.name == EMF]
    if key.name != TORQUE or Key(EMF) in free_emf_keys:
        return []
    if key.index is None and not free_emf_keys:
        return [Key.parse(emf_name) for emf_name in expand(EMF, robot)]
    wheels = range(robot.wheels.count) if key.index is None else [key.index]
    return [emf_key for wheel in wheels if (emf_key := Key(EMF, wheel)) not in free_emf_keys]


def names_of(names: str | Sequence[str]) -> tuple[str, ...]:
    """Names as a tuple; a string is one name."""
    return (names,) if isinstance(names, str) else tuple(names)


def refuse_repeated(names: Sequence[str]) -> None:
    """Raises InputError for a name that is asked for twice."""
    repeated_names = sorted({name for name in names if names.count(name) > 1})
    if repeated_names:
        raise InputError("asked for twice", got=", ".join(repeated_names), expected="every key once", where="free")


def refuse_unknown(keys: Sequence[str], robot: Robot) -> None:
    """Raises InputError for a key that the robot does not have: left alone it would hold nothing.

    Breakaway may be fixed where the robot has none: it follows coulomb then.
    """
    for key in map(Key.parse, keys):
        if key.level != BREAKAWAY:
            key.get(robot)


def robot_parameters(robot: Robot, keys: Sequence[str], priors: dict[str, tuple[float, float]]) -> list[Parameter]:
    """Free parameters by key; the EMF constants follow the torque constants unless they are asked for themselves."""
    return [robot_parameter(robot, key, priors.get(key), keys) for key in keys]
