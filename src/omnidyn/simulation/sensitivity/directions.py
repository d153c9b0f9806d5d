"""What a run is derived by: the robot a little up and down each key, as plants that the compiled march takes along."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from omnidyn.arrays import BoolArray, FloatArray, IntArray
from omnidyn.errors import InputError, UnsupportedError
from omnidyn.model.dynamics import settled_currents
from omnidyn.model.friction.kinds import KARNOPP
from omnidyn.model.keys import CENTRE, DEAD_BAND, ROTOR, WHEEL, Key
from omnidyn.model.layout import N_AXES, Plant, PlantState, Stage, many, new_stage, new_state
from omnidyn.model.robot import Robot
from omnidyn.model.stick_slip.plant import plant
from omnidyn.model.surroundings import refuse_slope
from omnidyn.model.wheels import refuse_slip

RATE = "drive.rate_Hz"
EPS = 1e-5  # relative change of a parameter: rounding 1e-11, curvature 1e-10; all kinks are on their branch


class Directions(NamedTuple):
    """Plants a little up (2k) and down (2k + 1) each of the K parameters, and room to work in."""

    plants: Plant  # 2 K + 1 of them
    stages: Stage  # one of each plant
    arm: FloatArray  # (elements, K, 3) derivative of the directions g_e
    voltage: FloatArray  # (K, rows, n) derivative of the applied voltage
    push: FloatArray  # (2 K + 1, rows, 3) wrench from outside on each of the plants; no rows where there is none
    lift: FloatArray  # (3, 6) rows of the elimination: stuck direction, and what it is made of
    held: IntArray  # (2, 3) which elements span what is stuck; pivots
    point: FloatArray  # (5, 3) points, accelerations
    aim: FloatArray  # (K, D) derivative of x*, i* and z*; D = 3 + n, and all elements and the plane where any bends
    middle: FloatArray  # (K, D) derivative at stage 1
    half: FloatArray  # (K, D) derivative after the first half step
    rate: FloatArray  # (D,) derivative by time
    first: PlantState  # ends of a piece of a half step
    last: PlantState
    gained: FloatArray  # (3,) acceleration
    carry: FloatArray  # (3, n) di/di*, the force per ampere of i*, and the branch of the current
    kept: FloatArray  # (K, D) derivative before a piece of a half step


@dataclass(frozen=True, eq=False)
class Prepared:
    """A robot and its keys for any number of runs. robots, plants: up and down each key by EPS scale."""

    robot: Robot
    keys: tuple[str, ...]
    scale: FloatArray
    robots: list[Robot]
    numbers: Plant
    plants: list[Plant]


def prepared(robot: Robot, keys: Sequence[str]) -> Prepared:
    """Raises InputError for an unknown key, for friction or a gear loss that is off, UnsupportedError on a slope, or of
    wheels that slip."""
    refuse_slope(robot.floor, "derivatives of a run know")
    refuse_band(robot)
    refuse_slip(robot.wheels, "derivatives of a run know")
    scale = np.array([_scale(robot, key) for key in keys])
    robots = [_moved(robot, key, s, side) for key, s in zip(keys, scale, strict=True) for side in (1.0, -1.0)]
    numbers, plants = plant(robot), [plant(r) for r in robots]
    for j, key in enumerate(keys):
        refuse_switched_off(key, numbers, plants[2 * j])
    return Prepared(robot, tuple(keys), scale, robots, numbers, plants)


def directions_of(numbers: Plant, plants: list[Plant], rates: FloatArray, push: FloatArray | None = None) -> Directions:
    """Tables of the plants up and down each key, the robot's own as the last one, and room to work in.

    rates: derivatives of the applied voltages, shape (K, rows, n). push: on each plant, (2 K + 1, rows, 3) [N].
    """
    all_plants = many([*plants, numbers])
    push = np.zeros((len(plants) + 1, 0, N_AXES)) if push is None else np.ascontiguousarray(push)
    count, n = len(plants) // 2, numbers.wheels
    arm = np.ascontiguousarray(np.swapaxes(difference(all_plants.element["g"][:-1]), 0, 1))
    work = np.zeros((4, count, width(numbers)))
    return Directions(
        plants=all_plants,
        stages=new_stage(all_plants),
        arm=arm,
        voltage=rates,
        push=push,
        lift=np.zeros((3, 6)),
        held=np.zeros((2, 3), np.int64),
        point=np.zeros((5, 3)),
        aim=work[0],
        middle=work[1],
        half=work[2],
        rate=np.zeros(width(numbers)),
        first=new_state(numbers),
        last=new_state(numbers),
        gained=np.zeros(3),
        carry=np.zeros((3, n)),
        kept=work[3],
    )


def width(numbers: Plant) -> int:
    """D: how many numbers of a state have derivatives. x, currents, and where anything bends how far all of it does."""
    bends = numbers.body.bristles + numbers.body.gathers > 0.0
    return N_AXES + numbers.wheels + (len(numbers.element) + 2 if bends else 0)


def difference(values: FloatArray) -> FloatArray:
    """Derivatives from values up (even) and down (odd) each key. Shape (2 K, ...) -> (K, ...)."""
    with np.errstate(invalid="ignore"):  # of a run that ran away
        return np.ascontiguousarray((values[0::2] - values[1::2]) / (2.0 * EPS))


def current_derivatives(
    ends: Sequence[Robot], twist: FloatArray, voltage: FloatArray, dtwist: FloatArray, dvoltage: FloatArray | float
) -> FloatArray:
    """Derivatives of settled currents [A] along one direction; `ends`: the robot up and down it. Shape (rows, n)."""
    sides = zip(ends, (EPS, -EPS), strict=True)
    values = [settled_currents(robot, twist + eps * dtwist, voltage + eps * dvoltage) for robot, eps in sides]
    return difference(np.array(values))[0]


def refuse_band(robot: Robot) -> None:
    """Raises UnsupportedError for Karnopp's law, whose band is no motion that a number could move."""
    for table in type(robot.friction).model_fields:
        if getattr(robot.friction, table).law != KARNOPP:
            continue
        raise UnsupportedError(
            f'no derivatives of a run with law = "{KARNOPP}"',
            got=KARNOPP,
            expected='law = "coulomb"',
            remedy='take law = "coulomb" with the same levels: it sticks exactly, which the band stands in for',
            where=f"friction.{table}.law",
        )


def refuse_switched_off(key: str, numbers: Plant, up: Plant) -> None:
    """Dry friction, or a gear loss, of 0 is not a number to differentiate by: where it is off nothing can stick."""
    before, after = numbers.element, up.element
    off = _differ(before, after, "coulomb", "breakaway", "efficiency") & (before["active"] == 0.0)
    off |= _differ(before, after, "bristle_coulomb", "bristle_breakaway") & (before["stiffness"] == 0.0)
    ellipse = numbers.body.breakaway[0] == 0.0 and up.body.coulomb.sum() > 0.0
    if off.any() or ellipse or (numbers.body.stiffness == 0.0 and up.body.stiffness > 0.0):
        raise InputError(
            "cannot differentiate with respect to what is off",
            got=key,
            expected="a level that is not 0, a loss",
            remedy="give it a value first",
            where="keys",
        )


def _differ(before: Any, after: Any, *names: str) -> BoolArray:
    """Which elements differ in one of these fields. Shape (elements,)."""
    return np.any([(before[name] != after[name]).reshape(len(before), -1).any(axis=1) for name in names], axis=0)


def _scale(robot: Robot, key: str) -> float:
    """The size of a parameter: changes are relative to it."""
    place = Key.parse(key)
    return abs(place.get(robot)) or _size_of_none(place, robot)


def _size_of_none(key: Key, robot: Robot) -> float:
    """The size beside which a number that is 0 is small: 1, but of an inertia that spins what weighs as the body; of a
    centre of mass, where the wheels stand."""
    if key.name == CENTRE:
        return float(np.mean(robot.wheels.robot_radius))
    if key.name not in (ROTOR, WHEEL):
        return 1.0
    radius, gear = float(np.mean(robot.wheels.radii)), float(np.mean(robot.motor.gear_ratio))
    return robot.body.mass * (radius / (gear if key.name == ROTOR else 1.0)) ** 2


def _moved(robot: Robot, key: str, scale: float, side: float) -> Robot:
    """The robot with one number changed a little; not checked, for it may be at the end of its range."""
    place = Key.parse(key)
    return place.set(robot, place.get(robot) + side * EPS * scale, checked=False)


def refuse_rate(keys: Sequence[str]) -> None:
    """Raises UnsupportedError where the rate of a speed loop, or the dead band behind it, is among the keys."""
    if DEAD_BAND in keys:
        raise UnsupportedError(
            "no derivative by the dead band behind a speed loop",
            got=DEAD_BAND,
            expected="other keys",
            where="keys",
            remedy="try a few dead bands instead",
        )
    if RATE in keys:
        raise UnsupportedError(
            "no derivative by the rate of the speed loop",
            got=RATE,
            expected="other keys",
            remedy="its ticks would move; try a few rates instead",
            where="keys",
        )
