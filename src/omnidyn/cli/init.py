"""omnidyn init NAME: a robot file to start from."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import typer

from omnidyn.cli import log_options as logs
from omnidyn.cli.init_logs import as_seen, from_logs
from omnidyn.cli.terminal.numbers import number_words
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document

if TYPE_CHECKING:
    from omnidyn.model.robot import Robot
    from omnidyn.model.wheels import Wheels

MAX_NAME = 60
LEAST_WHEELS, MOST_WHEELS = 3, 16
DEFAULTS = {"wheel_radius": 0.05, "robot_radius": 0.15, "mass": 3.0}  # [m], [m], [kg], shown at a terminal
KEYS = {
    "azimuth": "wheels.azimuth_deg", "wheel_radius": "wheels.wheel_radius_m", "robot_radius": "wheels.robot_radius_m",
    "mass": "body.mass_kg", "voltage_limit": "motor.voltage_limit_V", "roller": "wheels.roller_angle_deg",
}  # fmt: skip
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


def init(
    name: str = typer.Argument(metavar="NAME", help="Name of the robot; the file is NAME.toml."),
    wheels: int | None = typer.Option(
        None, min=LEAST_WHEELS, max=MOST_WHEELS, help="How many wheels; 3 or 4 is usual."
    ),
    like: str = typer.Option("", metavar="ROBOT", help="Take what is not given from this preset or robot file."),
    azimuth: str = typer.Option("", metavar="DEGREES", help="Where they stand, such as 60,180,300; 0 is forward."),
    wheel_radius: str = typer.Option("", metavar="M", help="Radius of a wheel [m], or one per wheel: 0.03,0.03,0.034."),
    robot_radius: str = typer.Option(
        "", metavar="M", help="Centre to wheel [m], or one per wheel; mecanum: half track + half wheelbase."
    ),
    mass: float | None = typer.Option(None, help="Mass of the robot [kg]."),
    voltage_limit: float | None = typer.Option(None, help="Most the driver gives to a motor [V]; default: a guess."),
    log: list[str] = typer.Option(
        [], "--log", metavar="LOG", help="Logs that show where the wheels stand. Repeatable."
    ),
    mecanum: bool = typer.Option(False, "--mecanum", help="Four mecanum wheels, in an X seen from above."),
    friction: str = typer.Option("", help="Where the guessed friction acts: direction (default) or axes."),
    map_file: str = logs.MAP,
    column: list[str] = logs.COLUMN,
    assume: list[str] = logs.ASSUME,
    no_header: bool = logs.NO_HEADER,
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="File to write instead; - is stdout."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="What was written and guessed, for machines."),
) -> None:
    """Write a robot file to start from.

    Needs where the wheels stand, two radii and a mass; asks for them at a terminal.
    The rest is guessed, with a wide spread, and marked as a guess.
    """
    given = {
        "wheels": wheels, "azimuth": _azimuths(azimuth),
        "wheel_radius": _radii("--wheel-radius", wheel_radius), "robot_radius": _radii("--robot-radius", robot_radius),
        "mass": mass, "voltage_limit": voltage_limit,
    }  # fmt: skip
    _refuse_words(given, mecanum, friction, like, out, json)
    _refuse_numbers(given)
    name = name.removesuffix(".toml")
    path = _checked_path(name, out, force)
    preset = _preset(like)
    told = {key for key, value in given.items() if value is not None}
    if not log and (map_file or column or assume or no_header):
        raise typer.BadParameter("--map, --column, --assume and --no-header are for --log.")
    options = logs.log_options(map_file, column, assume, no_header=no_header)
    seen = from_logs(given, log, options, mecanum) if log else None
    found = {KEYS[key] for key in ("azimuth", "robot_radius") if given[key] is not None and key not in told}
    answers = _complete({key: value for key, value in given.items() if value is not None}, preset, mecanum)
    robot = as_seen(_robot(name, answers, preset, mecanum, friction), seen, found)
    _write(robot, path, force, json, like)


def _refuse_words(given: dict[str, Any], mecanum: bool, friction: str, like: str, out: str, json: bool) -> None:
    """Options that contradict each other."""
    count, azimuth = given["wheels"], given["azimuth"]
    if mecanum and (azimuth is not None or count not in (None, 4)):
        raise typer.BadParameter("--mecanum stands for four wheels and where they stand; leave out the rest.")
    if azimuth is not None and count is not None and len(azimuth) != count:
        raise typer.BadParameter(f"--azimuth has {len(azimuth)} values for --wheels {count}.")
    if friction not in ("", "direction", "axes"):
        raise typer.BadParameter("--friction is direction or axes.")
    if friction and like:
        raise typer.BadParameter("--friction is for a guess; with --like friction comes from there.")
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")


def _refuse_numbers(given: dict[str, Any]) -> None:
    """Numbers with which no robot can be guessed, by the names that they have here. Raises InputError."""
    from omnidyn.errors import InputError

    azimuth, limit = given["azimuth"], given["voltage_limit"]
    if azimuth is not None and not LEAST_WHEELS <= len(azimuth) <= MOST_WHEELS:
        raise InputError(
            "a robot that can move in every direction has three wheels or more", got=f"{len(azimuth)} angles",
            expected=f"{LEAST_WHEELS} to {MOST_WHEELS}, one per wheel, such as 60,180,300", where="--azimuth",
        )  # fmt: skip
    if limit is not None and not 0.0 < limit < float("inf"):
        raise InputError(
            "no motor turns at this voltage", got=f"{limit:g} V", expected="more than 0 V, such as 12",
            remedy="leave it out for a guess", where="--voltage-limit",
        )  # fmt: skip


def _azimuths(text: str) -> list[float] | None:
    from omnidyn.cli.terminal.numbers import number_list

    return number_list("--azimuth", text) if text else None


def _radii(option: str, text: str) -> float | tuple[float, ...] | None:
    """One number for all wheels, or one per wheel; None where none is given."""
    from omnidyn.cli.terminal.numbers import number_list

    values = tuple(number_list(option, text)) if text else ()
    return values if len(values) > 1 else values[0] if values else None


def _checked_path(name: str, out: str, force: bool) -> str:
    """The file to write, refused before any question is asked. Raises InputError."""
    from omnidyn.errors import InputError
    from omnidyn.files import check_output
    from omnidyn.model.robot_file import preset_names

    if name in preset_names():
        raise InputError("a preset has this name", got=name, remedy="choose another one, or use --like", where="NAME")
    if not 0 < len(name) <= MAX_NAME or not name.isprintable() or set(name) & set("/\\:") or name[0] in ".- ":
        raise InputError(
            "cannot name a robot and its file like this", got=name, expected=f"a plain name of 1 to {MAX_NAME} letters",
            remedy="use --out for a file in another folder", where="NAME",
        )  # fmt: skip
    path = out or f"{name}.toml"
    if "\0" in path:
        raise InputError("not a file name", got=path, where="--out")
    if path != "-":
        check_output(path, force)
    return path


def _preset(like: str) -> Robot | None:
    from omnidyn.model.robot_file import load_robot

    return load_robot(like) if like else None


def _complete(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Answers:
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
        typed = _ask(f"{QUESTIONS[key]} [{number_words(default)}]: ", lambda text, key=key: _checked(key, _one(text)))
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
        f"{QUESTIONS['azimuth']} [{number_words(default)}]: ", lambda text: _checked("azimuth", _several(text, count))
    )
    if typed is not None or not taken:
        answers.value["azimuth"] = list(default) if typed is None else typed
    if typed is None:
        answers.accepted.add("azimuth")


def _ask(question: str, understood: Callable[[str], Any]) -> Any:
    """An answer, asked for on stderr until it can be used; None for Enter."""
    from omnidyn.errors import InputError

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
    from omnidyn.cli.terminal.numbers import number_list
    from omnidyn.errors import InputError

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
    from omnidyn.errors import InputError

    if text not in map(str, range(LEAST_WHEELS, MOST_WHEELS + 1)):
        raise InputError("cannot use this answer", got=text, expected=f"{LEAST_WHEELS} to {MOST_WHEELS} wheels")
    return int(text)


def _checked(key: str, value: Any) -> Any:
    """The value, if a robot may have it. Raises InputError."""
    from omnidyn.model.first_guess import even_azimuths
    from omnidyn.model.robot import Body
    from omnidyn.model.wheels import Wheels

    if key == "mass":
        Body(mass=value, inertia=1.0)
    else:
        usual = {"azimuth_deg": even_azimuths(3), "wheel_radius": 0.1, "robot_radius": 0.1}
        Wheels(**{**usual, "azimuth_deg" if key == "azimuth" else key: value})
    return value


def _robot(name: str, answers: Answers, preset: Robot | None, mecanum: bool, friction: str) -> Robot:
    """The robot of these answers. Raises InputError, also where no guess makes sense."""
    from omnidyn.errors import InputError
    from omnidyn.model.first_guess import DIRECTION, default_prior, first_guess, like
    from omnidyn.model.robot import Body

    value = answers.value
    wheels, mass = _wheels(value, preset, mecanum), value.get("mass", preset.body.mass if preset else None)
    Body(mass=mass, inertia=1.0)
    told = {KEYS[key] for key in value if key in KEYS and key not in answers.accepted}
    told |= {KEYS["azimuth"], KEYS["roller"]} if mecanum else set()
    try:
        if preset is not None:
            robot = like(preset, name, wheels, mass, value.get("voltage_limit"), told)
        else:
            robot = first_guess(name, wheels, mass, value.get("voltage_limit"), friction or DIRECTION)
    except InputError as error:
        raise InputError(
            "cannot make such a robot", got=str(error), remedy="check the units: m, kg, V, degree", where=name
        ) from None
    accepted = {KEYS[key]: value[key] for key in answers.accepted if key in value}
    return robot.replace(priors=robot.priors | {key: default_prior(key, one) for key, one in accepted.items()})


def _wheels(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Wheels:
    from omnidyn.model.first_guess import mecanum_wheels
    from omnidyn.model.wheels import Wheels

    known = {key: value[key] for key in ("wheel_radius", "robot_radius") if key in value}
    if preset is not None and not mecanum:
        changed = {"azimuth_deg": value["azimuth"]} if "azimuth" in value else {}
        return preset.wheels.replace(**known, **changed)
    if preset is not None:
        known = {"wheel_radius": preset.wheels.wheel_radius, "robot_radius": preset.wheels.robot_radius} | known
    return mecanum_wheels(**known) if mecanum else Wheels(azimuth_deg=value["azimuth"], **known)


def _write(robot: Robot, path: str, force: bool, json: bool, like: str) -> None:
    from omnidyn.cli.terminal.session import provenance, robot_input
    from omnidyn.files import write_atomic
    from omnidyn.model.first_guess import guessed
    from omnidyn.model.robot_file import robot_to_toml

    text = _head(robot) + robot_to_toml(robot)
    if path == "-":
        show(text.rstrip("\n"))
    else:
        write_atomic(path, text, force)
    if path != "-":
        told = Document([path], {"robot": robot.name, "output": path, "guessed": guessed(robot)})
        tell(told, json, provenance([robot_input(like)] if like else []))
    if robot.wheels.radii.max() > _smallest(robot):
        say("omnidyn: warning: a wheel is larger than the robot; are both radii in metres?")
    if guessed(robot):
        say(f"omnidyn: guessed: {', '.join(guessed(robot))}")
    if like:
        say(f"omnidyn: what was not given is like {like}; inertia and friction are scaled to the size")


def _smallest(robot: Robot) -> float:
    import numpy as np

    return float(np.min(robot.wheels.robot_radius))


def _head(robot: Robot) -> str:
    """Comments for whoever opens the file."""
    from omnidyn.model.first_guess import reasons

    lines = [
        "Written by omnidyn init. SI units; azimuths count counter-clockwise from forward (x forward, y left).",
        'The origin of a number stands beside it: "given" by you, a "guess", "imported" from another robot. std is the',
        'standard deviation. Put in what you know, such as { value = 1.7, std = 0.1, origin = "datasheet" }.',
    ]
    guesses = reasons(robot)
    if guesses:
        lines += ["", "How it was guessed (M mass, b centre to wheel):"]
        lines += [f"  {key}: {why}" for key, why in guesses]
    return "".join(f"# {line}".rstrip() + "\n" for line in lines) + "\n"
