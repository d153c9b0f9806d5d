"""Sizes that no robot of `omnidyn init` has: angles in radians, lengths in millimetres, a mass in grams."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from omnidyn.cli.terminal.numbers import number_words
from omnidyn.errors import InputError

LEAST_WHEELS, MOST_WHEELS = 3, 16
USUAL_WHEEL, USUAL_ROBOT = (8e-3, 0.3), (0.03, 2.0)  # [m] what most robots have
LENGTHS = (1e-3, 1e-2, 0.0254)  # [m] of what may have been meant: mm, cm, in
DENSITY = (1.0, 2500.0)  # [kg/m^3] of the cube around a robot
GRAMS, TONNES = 1e-3, 1e3
TURN = 2.0 * math.pi
ANGLES = 0.05  # [degree] within which angles are rounded to whole degrees
SAYING = "where a robot is so indeed, write that into its file by hand"


def refuse_sizes(value: Mapping[str, Any]) -> None:
    """Raises InputError for the first size that cannot be meant so, with the option that says what may be meant.

    value: name of an option -> number, or numbers of each wheel.
    """
    from omnidyn.model.wheels import ROBOT_RADII, WHEEL_RADII  # imported lazily: slow to load

    _refuse_radians(value.get("azimuth"))
    _refuse_length("wheel_radius", value.get("wheel_radius"), WHEEL_RADII, USUAL_WHEEL)
    _refuse_length("robot_radius", value.get("robot_radius"), ROBOT_RADII, USUAL_ROBOT)
    wheel, robot, mass = (value.get(key) for key in ("wheel_radius", "robot_radius", "mass"))
    if wheel is None or robot is None or min(*_numbers(wheel), *_numbers(robot)) <= 0.0:
        return
    if max(_numbers(wheel)) > min(_numbers(robot)):
        raise InputError(
            "a wheel is larger than the robot: are both radii in metres?",
            got=f"wheels of {number_words(wheel)} m, {number_words(robot)} m from the centre",
            expected="a radius below the distance from the centre to the wheel",
            where="--wheel-radius",
            remedy=f"{_smaller(wheel, robot)}{SAYING}",
        )
    if mass is not None:
        _refuse_mass(mass, 2.0 * (max(_numbers(robot)) + max(_numbers(wheel))))


def _numbers(value: float | tuple[float, ...]) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)


def _call(key: str, value: Any) -> str:
    """The option with a value that may be meant, "" without one."""
    return "" if value is None else f"say --{key.replace('_', '-')} {number_words(value)} if that is meant; "


def _smaller(wheel: Any, robot: Any) -> str:
    """The options with radii that may be meant: the one of the wheel in another unit, else both swapped."""
    radius = _meant(wheel, (USUAL_WHEEL[0], min(_numbers(robot))))
    if radius is not None:
        return _call("wheel_radius", radius)
    return f"say --wheel-radius {number_words(robot)} --robot-radius {number_words(wheel)} if they are swapped; "


def _refuse_radians(azimuth: list[float] | None) -> None:
    """Angles all within a turn in radians: in degrees all wheels would stand side by side."""
    if not azimuth or max(map(abs, azimuth)) > TURN * 1.001 or not any(azimuth):
        return
    degrees = [math.degrees(angle) for angle in azimuth]
    rounded = [round(angle) if abs(angle - round(angle)) < ANGLES else round(angle, 2) for angle in degrees]
    raise InputError(
        "these angles look like radians",
        got=number_words(tuple(azimuth)),
        expected="degrees, such as 60,180,300",
        remedy=f"{_call('azimuth', tuple(map(float, rounded)))}{SAYING}",
        where="--azimuth",
    )


def _refuse_length(key: str, value: Any, possible: tuple[float, float], usual: tuple[float, float]) -> None:
    if value is None or all(possible[0] <= length <= possible[1] for length in _numbers(value)):
        return
    if not all(length > 0.0 for length in _numbers(value)):
        return  # which no robot file takes
    raise InputError(
        f"no {key.replace('_', ' ')} is so {'small' if min(_numbers(value)) < possible[0] else 'large'}",
        got=f"{number_words(value)} m",
        expected=f"metres, {possible[0]:g} to {possible[1]:g}",
        remedy=f"{_call(key, _meant(value, usual))}{SAYING}",
        where=f"--{key.replace('_', '-')}",
    )


def _meant(value: float | tuple[float, ...], usual: tuple[float, float]) -> Any:
    """The value in metres, were it in mm, cm or in: the first that is usual; None where none is."""
    for unit in LENGTHS:
        metres = tuple(float(f"{number * unit:.4g}") for number in _numbers(value))
        if all(usual[0] <= length <= usual[1] for length in metres):
            return metres if isinstance(value, tuple) else metres[0]
    return None


def _refuse_mass(mass: float, side: float) -> None:
    """A mass that the cube around the robot, of a side [m], cannot have."""
    density = mass / side**3
    if not mass > 0.0 or DENSITY[0] <= density <= DENSITY[1]:
        return
    intended = float(f"{mass * (GRAMS if density > DENSITY[1] else TONNES):.4g}")
    fits = DENSITY[0] <= intended / side**3 <= DENSITY[1]
    raise InputError(
        f"no robot of this size is so {'heavy' if density > DENSITY[1] else 'light'}",
        got=f"{mass:g} kg in {side:.2g} m",
        expected=f"kilograms, {_two(DENSITY[0] * side**3)} to {_two(DENSITY[1] * side**3)}",
        where="--mass",
        remedy=f"{_call('mass', intended if fits else None)}{SAYING}",
    )


def _two(value: float) -> str:
    return f"{value:.2g}"
