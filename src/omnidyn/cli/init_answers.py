"""What `omnidyn init` needs to know of a robot: from its options, at a terminal from its user, from a preset."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli.init_sizes import refuse_sizes
from omnidyn.cli.terminal.numbers import number_list, number_words
from omnidyn.cli.terminal.streams import say
from omnidyn.errors import InputError

if TYPE_CHECKING:
    from omnidyn.model.robot import Robot

LEAST_WHEELS, MOST_WHEELS = 3, 16
DEFAULTS = {"wheel_radius": 0.05, "robot_radius": 0.15, "mass": 3.0}  # [m], [m], [kg], shown at a terminal
QUESTIONS = {
    "azimuth": "where the wheels stand, counter-clockwise from forward [degree]",
    "wheel_radius": "radius of a wheel [m]",
    "robot_radius": "from the centre of the robot to a wheel [m]",
    "mass": "mass of the robot [kg]",
}


@dataclass
class Answers:
    """What is known of the robot: name of an option -> its value. accepted: answered with Enter at a terminal."""

    value: dict[str, Any]
    accepted: set[str] = field(default_factory=set)


def complete(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Answers:
    """Answers to all that is needed: from options, at a terminal from its user, from the preset."""
    if mecanum:
        value["wheels"] = 4
    answers = Answers(value)
    needed = [key for key in QUESTIONS if key not in value and not (mecanum and key == "azimuth")]
    if _at_terminal() and needed:
        _ask_for(needed, answers, preset)
    elif preset is not None:
        answers.accepted = {key for key in needed if key != "azimuth" or _fits(preset, value)}
        needed = [key for key in needed if key not in answers.accepted]
    if not _at_terminal() and needed:
        flags = ", ".join(f"--{key.replace('_', '-')}" for key in needed)
        raise typer.BadParameter(f"{flags} missing; without them it asks, but only at a terminal.")
    return answers


def _fits(preset: Robot, value: dict[str, Any]) -> bool:
    """Whether the preset has the number of wheels that was asked for."""
    return value.get("wheels", preset.wheels.count) == preset.wheels.count


def _at_terminal() -> bool:
    return sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty()


def _ask_for(needed: list[str], answers: Answers, preset: Robot | None) -> None:
    """Ask one by one; Enter takes what stands in brackets."""
    say("Enter takes what stands in brackets.")
    for key in needed:
        if key == "azimuth":
            _ask_for_wheels(answers, preset)
            continue
        default = getattr(preset.body if key == "mass" else preset.wheels, key) if preset else DEFAULTS[key]
        typed = _ask(
            f"{QUESTIONS[key]} [{number_words(default)}]: ",
            lambda text, key=key: _checked(key, _one(text), answers.value),
        )
        if typed is None:
            answers.accepted.add(key)
            if preset is None:
                answers.value[key] = default
        else:
            answers.value[key] = typed


def _ask_for_wheels(answers: Answers, preset: Robot | None) -> None:
    from omnidyn.model.first_guess import even_azimuths

    count = answers.value.get("wheels")
    if count is None:
        usual = preset.wheels.count if preset else 3
        count = _ask(f"how many wheels [{usual}]: ", _count) or usual
        answers.value["wheels"] = count
    taken = preset is not None and preset.wheels.count == count
    default = preset.wheels.azimuth_deg if preset is not None and taken else even_azimuths(count)
    typed = _ask(
        f"{QUESTIONS['azimuth']} [{number_words(default)}]: ",
        lambda text: _checked("azimuth", _several(text, count), {}),
    )
    if typed is not None or not taken:
        answers.value["azimuth"] = list(default) if typed is None else typed
    if typed is None:
        answers.accepted.add("azimuth")


def _ask(question: str, understood: Callable[[str], Any]) -> Any:
    """An answer, asked for on stderr until it can be used; None for Enter."""
    while True:
        with contextlib.suppress(BrokenPipeError):
            print(question, end="", file=sys.stderr, flush=True)
        line = sys.stdin.readline()
        if not line:
            say("")
            raise InputError("the input ended before all was answered", remedy="or give the numbers as options")
        if not line.strip():
            return None
        try:
            return understood(line.strip())
        except InputError as error:
            say(f"omnidyn: {error}")


def _one(text: str) -> float:
    return _several(text, 1, "one number, such as 0.05")[0]


def _several(text: str, count: int, expected: str = "") -> list[float]:
    try:
        values = number_list("", text)
    except InputError:
        values = []
    if len(values) != count:
        raise InputError(
            "cannot use this answer", got=text, expected=expected or f"{count} numbers, such as 60,180,300"
        )
    return values


def _count(text: str) -> int:
    if text not in map(str, range(LEAST_WHEELS, MOST_WHEELS + 1)):
        raise InputError("cannot use this answer", got=text, expected=f"{LEAST_WHEELS} to {MOST_WHEELS} wheels")
    return int(text)


def _checked(key: str, value: Any, known: Mapping[str, Any]) -> Any:
    """The value, if a robot may have it beside what is known. Raises InputError."""
    from omnidyn.model.first_guess import even_azimuths
    from omnidyn.model.robot import Body
    from omnidyn.model.wheels import Wheels

    refuse_sizes({**known, key: value})
    if key == "mass":
        Body(mass=value, inertia=1.0)
    else:
        usual = {"azimuth_deg": even_azimuths(3), "wheel_radius": 0.1, "robot_radius": 0.1}
        Wheels(**{**usual, "azimuth_deg" if key == "azimuth" else key: value})
    return value
