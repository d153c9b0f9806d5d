"""Karnopp's law in a fit: its band is a device of solvers that cannot stick, and no number of a robot.

What is fitted are its levels, by the engines that stick exactly; the law and its band come back into the answer.
"""

from __future__ import annotations

from collections.abc import Sequence

from omnidyn.errors import InputError
from omnidyn.model.friction.kinds import KARNOPP
from omnidyn.model.keys import Key
from omnidyn.model.robot import Robot

BAND = "friction.axes.karnopp_speed"


def without_band(robot: Robot, free: Sequence[str]) -> Robot:
    """The robot with the levels of Karnopp's law as Coulomb's. Raises InputError where its band is free."""
    asked = [key for key in free if Key.parse(key).name == BAND]
    if asked:
        raise InputError(
            "cannot be free", got=asked[0], expected="coulomb, breakaway or viscous",
            remedy="leave it out: the speed below which Karnopp's law rests is chosen for a solver, not measured",
            where="free",
        )  # fmt: skip
    return _with_law(robot, "coulomb") if robot.friction.axes.law == KARNOPP else robot


def with_band(robot: Robot, of: Robot) -> Robot:
    """A fitted robot with the law of the robot that it began from."""
    return _with_law(robot, KARNOPP) if of.friction.axes.law == KARNOPP else robot


def band_words(of: Robot) -> tuple[str, ...]:
    """What is to be said of it."""
    if of.friction.axes.law != KARNOPP:
        return ()
    return (
        f'law = "{KARNOPP}" is fitted as Coulomb friction with breakaway, which its band stands in for; '
        "karnopp_speed is numerical and stays as it is",
    )


def _with_law(robot: Robot, law: str) -> Robot:
    axes = robot.friction.axes.model_copy(update={"law": law})
    return robot.model_copy(update={"friction": robot.friction.model_copy(update={"axes": axes})})
