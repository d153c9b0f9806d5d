"""The robot of `omnidyn init`: from its options, at a terminal from its user, from logs, from a preset."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import typer

from omnidyn.cli import log_options
from omnidyn.cli.terminal.numbers import number_list, number_words
from omnidyn.cli.terminal.sizes import LEAST_WHEELS, MOST_WHEELS, refuse_sizes
from omnidyn.cli.terminal.streams import say
from omnidyn.errors import InputError
from omnidyn.logs.channels import components
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.logs.geometry import Geometry, as_mecanum, turned_wheels, wheel_geometry
from omnidyn.logs.read_log import LogOptions
from omnidyn.model.first_guess import (
    DIRECTION,
    GEAR,
    default_prior,
    even_azimuths,
    first_guess,
    guessed,
    like,
    mecanum_wheels,
    reasons,
    with_gear,
    with_rotor,
)
from omnidyn.model.robot import GIVEN, GUESS, MEASURED, Body, Prior, Robot
from omnidyn.model.robot_file import robot_to_toml
from omnidyn.model.wheels import Wheels

DEFAULTS = {"wheel_radius": 0.05, "robot_radius": 0.15, "mass": 3.0}  # [m], [m], [kg], shown at a terminal
QUESTIONS = {
    "azimuth": "where the wheels stand, counter-clockwise from forward [degree]",
    "wheel_radius": "radius of a wheel [m]",
    "robot_radius": "from the centre of the robot to a wheel [m]",
    "mass": "mass of the robot [kg]",
}


KEYS = {
    "azimuth": "wheels.azimuth_deg",
    "wheel_radius": "wheels.wheel_radius_m",
    "robot_radius": "wheels.robot_radius_m",
    "mass": "body.mass_kg",
    "voltage_limit": "motor.voltage_limit_V",
    "roller": "wheels.roller_angle_deg",
    "gear_ratio": "motor.gear_ratio",
    "rotor_inertia": "motor.rotor_inertia_kg_m2",
}
LEAST_RADIUS, LARGEST_RADIUS = 0.012, 0.3  # [m] of a wheel; what is outside is no radius, the speeds are of a motor
CONTRADICTED = 0.1  # a gear ratio that logs show is another one than that given, from this share on
GEARED = 1.5  # logged speeds so many times those of the wheels are speeds before a gear


@dataclass
class Answers:
    """What is known of the robot: name of an option -> its value. accepted: answered with Enter at a terminal."""

    value: dict[str, Any]
    accepted: set[str] = field(default_factory=set)


def robot_of(
    name: str,
    values: dict[str, Any],
    given_keys: Collection[str],
    preset: Robot | None,
    mecanum: bool,
    friction: str,
    geometry: Geometry | None,
) -> Robot:
    """The robot of all that is known. Raises InputError.

    Args:
        name: of the robot.
        values: name of an option -> its value, from the command line or from logs; None where not known.
        given_keys: names of the options of the command line.
        preset: whose numbers are taken for what is not given.
        mecanum: four mecanum wheels.
        friction: where guessed friction acts, "" for the default.
        geometry: what logs show of its wheels.
    """
    sizes = {key: value for key, value in values.items() if value is not None}
    refuse_sizes(_sizes(sizes, preset))
    answers = complete(dict(sizes), preset, mecanum)
    refuse_sizes(_sizes(answers.value, preset))
    from_logs = {KEYS[key] for key in KEYS.keys() & (sizes.keys() - set(given_keys))}
    guess = _guessed_robot(name, answers, preset, mecanum, friction)
    robot = _as_seen(guess, geometry, from_logs, values["gear_ratio"])
    return _with_motor(robot, values, preset is not None)


def complete(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Answers:
    """Answers to all that is needed: from options, at a terminal from its user, from the preset."""
    if mecanum:
        value["wheels"] = 4
    answers = Answers(value)
    questions = [key for key in QUESTIONS if key not in value and not (mecanum and key == "azimuth")]
    if _at_terminal() and questions:
        _ask_for(questions, answers, preset)
    elif preset is not None:
        answers.accepted = {
            key
            for key in questions
            if key != "azimuth" or (value.get("wheels", preset.wheels.count) == preset.wheels.count)
        }
        questions = [key for key in questions if key not in answers.accepted]
    if not _at_terminal() and questions:
        flags = ", ".join(f"--{key.replace('_', '-')}" for key in questions)
        raise typer.BadParameter(f"{flags} missing; without them it asks, but only at a terminal.")
    return answers


def _at_terminal() -> bool:
    return sys.stdin is not None and sys.stdin.isatty() and sys.stderr.isatty()


def _ask_for(questions: list[str], answers: Answers, preset: Robot | None) -> None:
    """Ask one by one; Enter takes what stands in brackets."""
    say("Enter takes what stands in brackets.")
    for key in questions:
        if key == "azimuth":
            _ask_for_wheels(answers, preset)
            continue
        default = getattr(preset.body if key == "mass" else preset.wheels, key) if preset else DEFAULTS[key]
        typed = _ask(
            f"{QUESTIONS[key]} [{number_words(default)}]: ",
            lambda text, key=key: _checked(key, _several(text, 1, "one number, such as 0.05")[0], answers.value),
        )
        if typed is None:
            answers.accepted.add(key)
            if preset is None:
                answers.value[key] = default
        else:
            answers.value[key] = typed


def _ask_for_wheels(answers: Answers, preset: Robot | None) -> None:
    count = answers.value.get("wheels")
    if count is None:
        usual = preset.wheels.count if preset else 3
        count = _ask(f"how many wheels [{usual}]: ", _count) or usual
        answers.value["wheels"] = count
    fits_preset = preset is not None and preset.wheels.count == count
    default = preset.wheels.azimuth_deg if preset is not None and fits_preset else even_azimuths(count)
    typed = _ask(
        f"{QUESTIONS['azimuth']} [{number_words(default)}]: ",
        lambda text: _checked("azimuth", _several(text, count), {}),
    )
    if typed is not None or not fits_preset:
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


def _checked(key: str, value: Any, known_values: Mapping[str, Any]) -> Any:
    """The value, if a robot may have it beside what is known. Raises InputError."""
    refuse_sizes({**known_values, key: value})
    if key == "mass":
        Body(mass=value, inertia=1.0)
    else:
        usual = {"azimuth_deg": even_azimuths(3), "wheel_radius": 0.1, "robot_radius": 0.1}
        Wheels(**{**usual, "azimuth_deg" if key == "azimuth" else key: value})
    return value


def _sizes(values: dict[str, Any], preset: Robot | None) -> dict[str, Any]:
    """What is given of lengths, angles and the mass, the rest from the preset."""
    of_preset = (
        {}
        if preset is None
        else {
            "wheel_radius": preset.wheels.wheel_radius,
            "robot_radius": preset.wheels.robot_radius,
            "mass": preset.body.mass,
        }
    )
    return of_preset | {key: value for key, value in values.items() if value is not None}


def _guessed_robot(name: str, answers: Answers, preset: Robot | None, mecanum: bool, friction: str) -> Robot:
    """The robot of these answers. Raises InputError, also where no guess makes sense."""
    value = answers.value
    wheels, mass = _wheels(value, preset, mecanum), value.get("mass", preset.body.mass if preset else None)
    Body(mass=mass, inertia=1.0)
    given_keys = {KEYS[key] for key in value if key in KEYS and key not in answers.accepted}
    given_keys |= {KEYS["azimuth"], KEYS["roller"]} if mecanum else set()
    try:
        if preset is not None:
            robot = like(preset, name, wheels, mass, value.get("voltage_limit"), given_keys)
        else:
            robot = first_guess(
                name,
                wheels,
                mass,
                value.get("voltage_limit"),
                friction or DIRECTION,
                value.get("speed_loop", ()),
                value.get("supply"),
            )
    except InputError as error:
        raise InputError(
            "cannot make such a robot", got=str(error), remedy="check the units: m, kg, V, degree", where=name
        ) from None
    accepted = {KEYS[key]: value[key] for key in answers.accepted if key in value}
    return robot.replace(priors=robot.priors | {key: default_prior(key, number) for key, number in accepted.items()})


def _with_motor(robot: Robot, values: dict[str, Any], copied: bool) -> Robot:
    """The robot with the gear and the rotor that were given. copied: from a preset, whose motors stay as they are.

    Raises InputError for a rotor behind a gear that is only guessed: at the wheel it counts with its square.
    """
    gear, rotor = values["gear_ratio"], values["rotor_inertia"]
    if gear is not None and copied:
        priors = {key: prior for key, prior in robot.priors.items() if not key.startswith(GEAR)}
        motor = robot.motor.replace(gear_ratio=gear)
        robot = robot.replace(motor=motor, priors=priors | {GEAR: Prior(origin=GIVEN)})
    elif gear is not None:
        robot = with_gear(robot, gear, "", GIVEN)
    if rotor is None:
        return robot
    if GEAR in robot.priors and robot.priors[GEAR].origin == GUESS:
        raise InputError(
            "a rotor needs its gear: at the wheel its inertia is J l^2",
            got=f"{rotor:g} kg m2 and no gear ratio",
            expected="both",
            remedy="give --gear-ratio too",
            where="--rotor-inertia",
        )
    return with_rotor(robot, rotor)


def _wheels(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Wheels:
    radii: dict[str, Any] = {key: value[key] for key in ("wheel_radius", "robot_radius") if key in value}
    if preset is not None and not mecanum:
        azimuths = {"azimuth_deg": value["azimuth"]} if "azimuth" in value else {}
        return preset.wheels.replace(**radii, **azimuths)
    if preset is not None:
        radii = {"wheel_radius": preset.wheels.wheel_radius, "robot_radius": preset.wheels.robot_radius} | radii
    return mecanum_wheels(**radii) if mecanum else Wheels(azimuth_deg=value["azimuth"], **radii)


def file_of(robot: Robot) -> tuple[str, list[str]]:
    """The robot file, with comments for whoever opens it, and the keys of the numbers that were guessed."""
    lines = [
        "Written by omnidyn init. SI units; azimuths count counter-clockwise from forward (x forward, y left).",
        'The origin of a number stands beside it: "given" by you, a "guess", "imported" from another robot. std is the',
        'standard deviation. Put in what you know, such as { value = 1.7, std = 0.1, origin = "datasheet" }.',
    ]
    guesses = reasons(robot)
    if guesses:
        lines += ["", "How it was guessed (M mass, b centre to wheel):"]
        lines += [f"  {key}: {reason}" for key, reason in guesses]
    head = "".join(f"# {line}".rstrip() + "\n" for line in lines)
    return f"{head}\n{robot_to_toml(robot)}", guessed(robot)


def from_logs(values: dict[str, Any], files: list[str], options: LogOptions, mecanum: bool, copied: bool) -> Geometry:
    """Azimuths and radii, of the robot where it turned, from logs; what is given on the command line stays.

    copied: the wheels are those of a preset, whose radius then tells the gear.
    """
    gear, runs, maps, at_motor = values["gear_ratio"], [], log_options.Maps(), set[str]()
    for path, loaded in log_options.load_logs(files, None, replace(options, gear_ratio=gear)):
        maps.show(path, loaded.columns)
        runs.append(loaded.to_run())
        at_motor |= {component_channel(key) for key, column in loaded.columns.columns.items() if column.at_motor}
    geometry = wheel_geometry(runs, "--robot-radius" if mecanum else "`azimuth`")
    geometry = replace(geometry, at_motor=gear is None and geometry.wheels in at_motor)
    azimuth = [round(angle, 2) for angle in geometry.azimuth_deg]
    verb = "pushing towards" if mecanum else "at"
    remark = f"from {geometry.source} ({geometry.residual:.1%} unexplained)"
    say(f"omnidyn: wheels {verb} {number_words(tuple(azimuth))} degrees, {remark}")
    counted_back = turned_wheels(geometry) if mecanum else ()
    if counted_back:
        names = components(geometry.wheels, len(azimuth))
        options_of_all = " ".join(f"--column {names[k - 1]}=-NAME" for k in counted_back)
        say(f"omnidyn: wheels {number_words(counted_back)} count clockwise: turned; say {options_of_all} elsewhere")
    if mecanum:
        geometry = as_mecanum(geometry)
    elif values["azimuth"] is None and values["wheels"] in (None, len(azimuth)):
        values["azimuth"], values["wheels"] = azimuth, len(azimuth)
    if values["robot_radius"] is None and geometry.robot_radius is not None and geometry.robot_radius > 0.0:
        values["robot_radius"] = round(geometry.robot_radius, 4)
        say(f"omnidyn: centre to wheel {values['robot_radius']:g} m")
    elif values["robot_radius"] is None:
        say("omnidyn: the logs do not turn, or hold no turn rate: the distance from centre to wheel is not in them")
    if values["wheel_radius"] is None and geometry.measured and not copied:
        _take_radius(values, geometry, gear is not None and geometry.wheels in at_motor)
    return geometry


def _take_radius(values: dict[str, Any], geometry: Geometry, divided: bool) -> None:
    """Take the radius of the wheels from the logs, where they have it. divided: by the gear ratio that was given."""
    radius = 1.0 / geometry.per_metre
    if geometry.at_motor:
        say("omnidyn: speeds are those of the motor shaft: without --gear-ratio the wheel radius is not in the logs")
    elif LEAST_RADIUS < radius < LARGEST_RADIUS:
        values["wheel_radius"] = round(radius, 4)
        condition = "if the logged speeds are those of the wheels, behind the gear"
        if divided:
            condition = f"behind the gear of {values['gear_ratio']:g} that was given"
        elif values["gear_ratio"] is not None:
            condition += "; if they are those of the motors, add @motor to their unit"
        say(f"omnidyn: wheel radius {radius:.4g} m, {condition}")


def _as_seen(robot: Robot, geometry: Geometry | None, from_logs: set[str], gear: float | None) -> Robot:
    """The robot with the gear that the logged speeds show: those of the motor shaft are faster by it.

    from_logs: keys of the robot file whose numbers the logs gave; their source says so. gear: its ratio, where it was
    given: that stays, and logs that contradict it are named.
    """
    if geometry is None:
        return robot
    prior = Prior(source=f"logs: {geometry.source}", origin=MEASURED)
    robot = robot.replace(priors=robot.priors | dict.fromkeys(from_logs, prior))
    ratio = geometry.per_metre * float(robot.wheels.radii.mean())
    if gear is not None:
        if min(abs(ratio - 1.0), abs(ratio / gear - 1.0)) > CONTRADICTED:
            say(
                f"omnidyn: warning: logged speeds are {ratio:.4g} times those of such wheels; expected 1, or {gear:g} "
                "at the motor: check --gear-ratio, --wheel-radius and the unit of the speeds; --gear-ratio is kept"
            )
        return robot
    if ratio < GEARED and not geometry.at_motor:
        return robot
    say(f"omnidyn: logged speeds are {ratio:.4g} times those of such wheels: taken as those of the motor, gear ratio")
    return with_gear(robot, round(ratio, 3), "logs: speed of the motor shaft over that of the wheel")
