"""What a fit says that it cannot tell: of its directions, of axes that did not move, or as it refuses."""

from __future__ import annotations

from benchmarks.blind.log import logged
from benchmarks.blind.setups import Setup
from omnidyn.errors import InsufficientDataError
from omnidyn.identification.identify import identify
from omnidyn.identification.methods import OutputError
from omnidyn.model.keys import Key, in_words
from omnidyn.model.robot import Robot

STILL = "never visibly moved"


def said(setup: Setup, seed: int) -> list[str]:
    """Every statement of what the log does not tell, with what would cure it; none where it tells all."""
    run, robot = logged(setup, seed)
    try:
        fit = identify(run, robot, OutputError(free=setup.free, nuisances=setup.nuisances)).estimate
    except InsufficientDataError as error:
        return [f"{words}; to tell: {error.remedy}" for words in error.what.split("; ")[1:]]
    still = [words for words in map(str, fit.warnings) if STILL in words and _free_there(setup, robot, words)]
    return [*map(str, fit.blind), *still]


def _free_there(setup: Setup, robot: Robot, words: str) -> bool:
    """Whether friction of an axis that did not move was asked for."""
    axis = ["x", "y", "yaw"].index(words.split("axis ")[1].split()[0])
    return any(Key.parse(key).axis == axis for key in setup.free)


def named(setup: Setup, told: list[str]) -> bool:
    """Whether there are as many statements as directions, they hold all numbers, and one cure is right."""
    words = " ".join(told)
    return (
        len(told) == setup.count
        and all(_is_named(key, words) for key in setup.lost)
        and any(cure in words for cure in setup.cures)
    )


def _is_named(key: str, words: str) -> bool:
    """Whether a number is named: itself, all of its list, or the axis that did not move."""
    place = Key.parse(key) if "." in key else None
    if place is None:
        return key in words
    still = place.axis is not None and f"axis {('x', 'y', 'yaw')[place.axis]} {STILL}" in words
    return still or in_words(key) in words or f"{in_words(place.name)} " in words
