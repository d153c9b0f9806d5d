"""omnidyn init NAME: a robot file to start from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.init_answers import LEAST_WHEELS, MOST_WHEELS, Answers, complete
from omnidyn.cli.init_sizes import refuse_sizes
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.numbers import number_list, number_words
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document
from omnidyn.errors import InputError, printable
from omnidyn.files import check_output, write_atomic
from omnidyn.model.presets import preset_names

if TYPE_CHECKING:
    from omnidyn.logs.geometry import Geometry
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot
    from omnidyn.model.wheels import Wheels


MAX_NAME = 60
KEYS = {
    "azimuth": "wheels.azimuth_deg", "wheel_radius": "wheels.wheel_radius_m", "robot_radius": "wheels.robot_radius_m",
    "mass": "body.mass_kg", "voltage_limit": "motor.voltage_limit_V", "roller": "wheels.roller_angle_deg",
    "gear_ratio": "motor.gear_ratio", "rotor_inertia": "motor.rotor_inertia_kg_m2",
}  # fmt: skip


@reads_logs("latency", "save_map", "sort", "skip_bad_rows", "current_unsigned")
def init(
    name: str = typer.Argument(metavar="NAME", help="Name of the robot; the file is NAME.toml."),
    wheels: int | None = typer.Option(None, min=LEAST_WHEELS, max=MOST_WHEELS, help="How many; 3 or 4 is usual."),
    like: str = typer.Option("", metavar="ROBOT", help="Take what is not given from this preset or robot file."),
    azimuth: str = typer.Option("", metavar="DEGREES", help="Where they stand, such as 60,180,300; 0 is forward."),
    wheel_radius: str = typer.Option("", metavar="M", help="Radius of a wheel [m], or one per wheel: 0.03,0.03,0.034."),
    robot_radius: str = typer.Option(
        "", metavar="M", help="Centre to wheel [m], or one per wheel; mecanum: half track + half wheelbase."
    ),
    mass: float | None = typer.Option(None, help="Mass of the robot [kg]."),
    voltage_limit: float | None = typer.Option(None, help="Most the driver gives to a motor [V]; default: a guess."),
    gear_ratio: float | None = typer.Option(None, help="Turns of the motor per turn of the wheel; default: a guess."),
    rotor_inertia: float | None = typer.Option(
        None, help="Of one motor's rotor, at its shaft [kg m2]: 1 g cm2 is 1e-7. Default: a guess."
    ),
    log: list[str] = typer.Option([], "--log", metavar="LOG", help="Logs that show where wheels stand. Repeatable."),
    mecanum: bool = typer.Option(False, "--mecanum", help="Four mecanum wheels, in an X seen from above."),
    friction: str = typer.Option("", help="Where the guessed friction acts: direction (default) or axes."),
    speed_loop: str = typer.Option(
        "", metavar="[KP,KI,]HZ", help="The firmware holds wheel speeds: V s/rad, V/rad, ticks a second."
    ),
    flags: LogFlags = NO_FLAGS,
    out: str = typer.Option("", "-o", "--out", metavar="OUT", help="File to write instead; - is stdout."),
    force: bool = typer.Option(False, "--force", help="Replace the file if it exists."),
    json: bool = typer.Option(False, "--json", help="What was written and guessed, for machines."),
) -> None:
    """Write a robot file to start from.

    Needs where the wheels stand, two radii and a mass; asks for them at a terminal.
    The rest is guessed, with a wide spread, and marked as a guess.
    """
    given = {
        "wheels": wheels, "azimuth": _listed("azimuth", azimuth), "wheel_radius": _radii("wheel_radius", wheel_radius),
        "robot_radius": _radii("robot_radius", robot_radius), "mass": mass, "voltage_limit": voltage_limit,
        "speed_loop": _listed("speed_loop", speed_loop), "gear_ratio": gear_ratio, "rotor_inertia": rotor_inertia,
    }  # fmt: skip
    _refuse_words(given, mecanum, friction, like, out, json)
    _refuse_numbers(given)
    path = _checked_path(name := name.removesuffix(".toml"), out, force)
    log_options.keep_inputs(log, [like], [flags.map_file], "" if path == "-" else path)
    log_options.refuse_missing(log)
    preset, told = _preset(like), _said(given)
    if not log and flags != NO_FLAGS:
        raise typer.BadParameter("--map, --column, --assume, --no-header, --rate, --max-bytes and --var are for --log.")
    seen = from_logs(given, log, flags.options(), mecanum, bool(like)) if log else None
    found = {KEYS[key] for key in KEYS.keys() & (_said(given).keys() - told.keys())}
    answers = _answers(given, preset, mecanum)
    robot = _with_motor(as_seen(_robot(name, answers, preset, mecanum, friction), seen, found), given, bool(like))
    _write(robot, path, force, json, like)


def _said(given: dict[str, Any]) -> dict[str, Any]:
    """The numbers that are known, by their names here."""
    return {key: value for key, value in given.items() if value is not None}


def _refuse_words(given: dict[str, Any], mecanum: bool, friction: str, like: str, out: str, json: bool) -> None:
    """Options that contradict each other."""
    count, azimuth = given["wheels"], given["azimuth"]
    if mecanum and (azimuth is not None or count not in (None, 4)):
        raise typer.BadParameter("--mecanum stands for four wheels and where they stand; leave out the rest.")
    if azimuth is not None and count is not None and len(azimuth) != count:
        raise typer.BadParameter(f"--azimuth has {len(azimuth)} values for --wheels {count}.")
    if friction not in ("", "direction", "axes"):
        raise typer.BadParameter("--friction is direction or axes.")
    for flag in ("--friction",) * bool(friction) + ("--speed-loop",) * bool(given["speed_loop"]):
        if like:
            raise typer.BadParameter(f"{flag} is for a guess; with --like it comes from there.")
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")


def _refuse_numbers(given: dict[str, Any]) -> None:
    """Numbers with which no robot can be guessed, by the names that they have here. Raises InputError."""
    azimuth, limit, loop = given["azimuth"], given["voltage_limit"], given["speed_loop"]
    count = given["wheels"] or (azimuth and len(azimuth))
    for key in ("wheel_radius", "robot_radius"):
        if count and isinstance(given[key], tuple) and len(given[key]) != count:
            raise InputError(
                "wrong number of values", got=number_words(given[key]), expected=f"1, or one per wheel ({count})",
                where=f"--{key.replace('_', '-')}",
            )  # fmt: skip
    if loop is not None and len(loop) not in (1, 3):
        raise InputError(
            "not a speed loop", got=f"{len(loop)} numbers", where="--speed-loop",
            expected="its rate, such as 100 [Hz], or both gains and its rate: 0.5,3,100 [V s/rad, V/rad, Hz]",
        )  # fmt: skip
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
    gear = given["gear_ratio"]
    if gear is not None and not 0.0 < gear < float("inf"):
        raise InputError(
            "no gear has this ratio", got=f"{gear:g}", expected="more than 0, such as 30", where="--gear-ratio"
        )


def _answers(given: dict[str, Any], preset: Robot | None, mecanum: bool) -> Answers:
    """All that is needed, with sizes that a robot may have. Raises InputError."""
    refuse_sizes(_sizes(given, preset))
    answers = complete({key: value for key, value in given.items() if value is not None}, preset, mecanum)
    refuse_sizes(_sizes(answers.value, preset))
    return answers


def _sizes(given: dict[str, Any], preset: Robot | None) -> dict[str, Any]:
    """What is given of lengths, angles and the mass, the rest from the preset."""
    of_preset = {} if preset is None else {
        "wheel_radius": preset.wheels.wheel_radius, "robot_radius": preset.wheels.robot_radius,
        "mass": preset.body.mass,
    }  # fmt: skip
    return of_preset | {key: value for key, value in given.items() if value is not None}


def _listed(key: str, text: str) -> list[float] | None:
    return number_list(f"--{key.replace('_', '-')}", text) if text else None


def _radii(key: str, text: str) -> float | tuple[float, ...] | None:
    """One radius for all wheels, or one each."""
    values = _listed(key, text)
    return None if values is None else values[0] if len(values) == 1 else tuple(values)


def _checked_path(name: str, out: str, force: bool) -> str:
    """The file to write, refused before any question is asked. Raises InputError."""
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
    return omnidyn.load_robot(like) if like else None


def _robot(name: str, answers: Answers, preset: Robot | None, mecanum: bool, friction: str) -> Robot:
    """The robot of these answers. Raises InputError, also where no guess makes sense."""
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
            robot = first_guess(
                name, wheels, mass, value.get("voltage_limit"), friction or DIRECTION, value.get("speed_loop", ())
            )
    except InputError as error:
        raise InputError(
            "cannot make such a robot", got=str(error), remedy="check the units: m, kg, V, degree", where=name
        ) from None
    accepted = {KEYS[key]: value[key] for key in answers.accepted if key in value}
    return robot.replace(priors=robot.priors | {key: default_prior(key, one) for key, one in accepted.items()})


def _with_motor(robot: Robot, given: dict[str, Any], copied: bool) -> Robot:
    """The robot with the gear and the rotor that were given. copied: from a preset, whose motors stay as they are.

    Raises InputError for a rotor behind a gear that is only guessed: at the wheel it counts with its square.
    """
    from omnidyn.model.first_guess import GEAR, with_gear, with_rotor
    from omnidyn.model.robot import GIVEN, GUESS, Prior

    gear, rotor = given["gear_ratio"], given["rotor_inertia"]
    if gear is not None and copied:
        known = {key: prior for key, prior in robot.priors.items() if not key.startswith(GEAR)}
        motor = robot.motor.replace(gear_ratio=gear)
        robot = robot.replace(motor=motor, priors=known | {GEAR: Prior(origin=GIVEN)})
    elif gear is not None:
        robot = with_gear(robot, gear, "", GIVEN)
    if rotor is None:
        return robot
    if GEAR in robot.priors and robot.priors[GEAR].origin == GUESS:
        raise InputError(
            "a rotor needs its gear: at the wheel its inertia is J l^2", got=f"{rotor:g} kg m2 and no gear ratio",
            expected="both", remedy="give --gear-ratio too", where="--rotor-inertia",
        )  # fmt: skip
    return with_rotor(robot, rotor)


def _wheels(value: dict[str, Any], preset: Robot | None, mecanum: bool) -> Wheels:
    from omnidyn.model.first_guess import mecanum_wheels
    from omnidyn.model.wheels import Wheels

    known: dict[str, Any] = {key: value[key] for key in ("wheel_radius", "robot_radius") if key in value}
    if preset is not None and not mecanum:
        changed = {"azimuth_deg": value["azimuth"]} if "azimuth" in value else {}
        return preset.wheels.replace(**known, **changed)
    if preset is not None:
        known = {"wheel_radius": preset.wheels.wheel_radius, "robot_radius": preset.wheels.robot_radius} | known
    return mecanum_wheels(**known) if mecanum else Wheels(azimuth_deg=value["azimuth"], **known)


def _write(robot: Robot, path: str, force: bool, json: bool, like: str) -> None:
    from omnidyn.model.first_guess import guessed
    from omnidyn.model.robot_file import robot_to_toml

    text = _head(robot) + robot_to_toml(robot)
    if path == "-":
        show(text.rstrip("\n"))
    else:
        write_atomic(path, text, force)
    if path != "-":
        told = Document([printable(path)], {"robot": robot.name, "output": path, "guessed": guessed(robot)})
        tell(told, json, provenance([robot_input(like)] if like else []))
    if guessed(robot):
        say(f"omnidyn: guessed: {', '.join(guessed(robot))}")
    if like:
        say(f"omnidyn: what was not given is like {like}; inertia and friction are scaled to the size")


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


# What `omnidyn init` takes from logs: where the wheels stand, the radius of the robot, a gear

LEAST_RADIUS, LARGEST_RADIUS = 0.012, 0.3  # [m] of a wheel; what is outside is no radius, the speeds are of a motor
GEARED = 1.5  # logged speeds so many times those of the wheels are speeds before a gear


def from_logs(given: dict[str, Any], log: list[str], options: LogOptions, mecanum: bool, copied: bool) -> Geometry:
    """Azimuths and radii, of the robot where it turned, from logs; what is given on the command line stays.

    copied: the wheels are those of a preset, whose radius then tells the gear.
    """
    from omnidyn.logs.geometry import as_mecanum, wheel_geometry

    runs, maps = [], log_options.Maps()
    for path, each in log_options.load_logs(log_options.log_files(log), None, options):
        maps.show(path, each.columns)
        runs.append(each.to_run())
    seen = wheel_geometry(runs, "--robot-radius" if mecanum else "`azimuth`")
    azimuth = [round(angle, 2) for angle in seen.azimuth_deg]
    where = "pushing towards" if mecanum else "at"
    told = f"from {seen.source} ({seen.residual:.1%} unexplained)"
    say(f"omnidyn: wheels {where} {number_words(tuple(azimuth))} degrees, {told}")
    if mecanum:
        seen = as_mecanum(seen)
    elif given["azimuth"] is None and given["wheels"] in (None, len(azimuth)):
        given["azimuth"], given["wheels"] = azimuth, len(azimuth)
    if given["robot_radius"] is None and seen.robot_radius is not None and seen.robot_radius > 0.0:
        given["robot_radius"] = round(seen.robot_radius, 4)
        say(f"omnidyn: centre to wheel {given['robot_radius']:g} m")
    elif given["robot_radius"] is None:
        say("omnidyn: the logs do not turn, or hold no turn rate: the distance from centre to wheel is not in them")
    radius = 1.0 / seen.per_metre
    if given["wheel_radius"] is None and seen.measured and not copied and LEAST_RADIUS < radius < LARGEST_RADIUS:
        given["wheel_radius"] = round(radius, 4)
        say(f"omnidyn: wheel radius {radius:.4g} m, if the logged speeds are those of the wheels, behind the gear")
    return seen


def as_seen(robot: Robot, seen: Geometry | None, from_logs: set[str]) -> Robot:
    """The robot with the gear that the logged speeds show: those of the motor shaft are faster by it.

    from_logs: keys of the robot file whose numbers the logs gave; their source says so.
    """
    from omnidyn.model.first_guess import with_gear
    from omnidyn.model.robot import MEASURED, Prior

    if seen is None:
        return robot
    told = Prior(source=f"logs: {seen.source}", origin=MEASURED)
    robot = robot.replace(priors=robot.priors | dict.fromkeys(from_logs, told))
    ratio = seen.per_metre * float(robot.wheels.radii.mean())
    if ratio < GEARED:
        return robot
    say(f"omnidyn: logged speeds are {ratio:.4g} times those of such wheels: taken as those of the motor, gear ratio")
    return with_gear(robot, round(ratio, 3), "logs: speed of the motor shaft over that of the wheel")
