"""A program as data of another language: straight pieces of its inputs, and what each leg must turn the wheels by."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.arrays import FloatArray
from omnidyn.driving.guard import LEAST_SUPPLY, MOVING
from omnidyn.driving.program import DriveProgram
from omnidyn.export.spelling import number
from omnidyn.model.wheels import twist_from_wheel_speed

ROUNDING = 1e-9  # of the largest input: rows that are nearer to a line lie on it
ONE_WAY = 0.8  # of the way of a wheel in a leg: where it ends nearer, the leg is not judged by it
DEAD_MAN = 0.25  # [s]


class StraightPiece(NamedTuple):
    """Rows on a straight line.

    rows: how many. first, step (wheels,): the input of the first one, and from row to row.
    """

    rows: int
    first: tuple[float, ...]
    step: tuple[float, ...]


class LegData(NamedTuple):
    """end: the row behind a leg. angle (wheels,): by how much each wheel must turn in it [rad]; 0 is not judged."""

    end: int
    angle: tuple[float, ...]


def pieces(inputs: FloatArray) -> list[StraightPiece]:
    """The fewest straight pieces from the left, that give every row. Inputs: shape (rows, wheels)."""
    nearest = ROUNDING * max(float(np.abs(inputs).max()), 1e-300)
    found, k = list[StraightPiece](), 0
    while k < len(inputs):
        step = inputs[k + 1] - inputs[k] if k + 1 < len(inputs) else np.zeros(inputs.shape[1])
        line = inputs[k] + np.arange(len(inputs) - k)[:, None] * step
        off = np.flatnonzero((np.abs(inputs[k:] - line) > nearest).any(axis=1))
        count = int(off[0]) if off.size else len(line)
        if count <= 2 and np.any(step):  # two rows lie on any line: a jump is none
            count, step = 1, np.zeros_like(step)
        found.append(StraightPiece(count, tuple(inputs[k].tolist()), tuple(step.tolist())))
        k += count
    return found


def leg_data(program: DriveProgram) -> list[LegData]:
    """What each leg must turn the wheels by, as predicted."""
    speed = np.asarray(program.predicted.wheel_speed)
    steps = 0.5 * program.dt * (speed[1:] + speed[:-1])
    net = np.array([steps[leg.first : leg.end].sum(axis=0) for leg in program.legs])
    path = np.array([np.abs(steps[leg.first : leg.end]).sum(axis=0) for leg in program.legs])
    is_judged = (np.abs(net) >= ONE_WAY * path) & (np.abs(net) > MOVING * np.abs(net).max())
    judged = np.where(is_judged, net, 0.0).tolist()
    return [LegData(leg.end, tuple(angle)) for leg, angle in zip(program.legs, judged, strict=True)]


class Constants(NamedTuple):
    """The numbers of a program by name, each a number or rows of numbers."""

    wheels: int
    dt: float
    dead_man: float
    area: tuple[float, float]
    least_supply: float
    to_twist: tuple[tuple[float, ...], ...]
    pieces: list[StraightPiece]
    legs: list[LegData]


def constants(program: DriveProgram) -> Constants:
    """What a program needs where there is no omnidyn."""
    wheels, supply = program.robot.wheels, program.robot.drive.supply
    to_twist = twist_from_wheel_speed(wheels, np.eye(wheels.count)).T
    return Constants(
        wheels.count,
        program.dt,
        DEAD_MAN,
        program.area,
        LEAST_SUPPLY * supply if supply else 0.0,
        tuple(map(tuple, to_twist.tolist())),
        pieces(program.inputs),
        leg_data(program),
    )


def cells(values: Sequence[float], spell: Callable[[float], str] = number) -> str:
    """Numbers with commas between them."""
    return ", ".join(map(spell, values))


def about(program: DriveProgram) -> list[str]:
    """What a file is, as lines of a comment."""
    return [
        f"{program.source or 'a program'} for {program.robot.name}, by omnidyn: {program.seconds:.1f} s, "
        f"{len(program.legs)} legs, inputs in {program.unit}.",
        f"Begin in the middle of {program.area[0]:g} m x {program.area[1]:g} m, along the first side. "
        "Wheels on blocks first.",
        *(f"{leg.first * program.dt:6.1f} s  {leg.words}" for leg in program.legs),
    ]
