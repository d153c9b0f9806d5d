"""omnidyn init NAME: a robot file to start from."""

from __future__ import annotations

from typing import Any

import typer

import omnidyn
from omnidyn.cli import log_options
from omnidyn.cli.log_options import NO_FLAGS, LogFlags, reads_logs
from omnidyn.cli.terminal.numbers import number_list, number_words
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.sizes import LEAST_WHEELS, MOST_WHEELS
from omnidyn.cli.terminal.streams import say, show
from omnidyn.cli.terminal.telling import tell
from omnidyn.document import Document
from omnidyn.errors import InputError, printable
from omnidyn.files import check_output, write_atomic
from omnidyn.model.presets import preset_names

MAX_NAME = 60
LEAST_VOLTS, MOST_VOLTS = 0.5, 1000.0  # [V]: beyond lies another unit


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
    supply: float | None = typer.Option(
        None, metavar="V", help="The drive takes duties (PWM), -1 to 1 of this supply [V]; default: it takes volts."
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
    values = {
        "wheels": wheels,
        "azimuth": _listed("azimuth", azimuth),
        "wheel_radius": _radii("wheel_radius", wheel_radius),
        "robot_radius": _radii("robot_radius", robot_radius),
        "mass": mass,
        "voltage_limit": voltage_limit,
        "speed_loop": _listed("speed_loop", speed_loop),
        "supply": supply,
        "gear_ratio": gear_ratio,
        "rotor_inertia": rotor_inertia,
    }
    _refuse_words(values, mecanum, friction, like, out, json)
    _refuse_numbers(values)
    path = _checked_path(name := name.removesuffix(".toml"), out, force)
    files = log_options.keep_inputs(log, [like], [flags.map_file], "" if path == "-" else path)
    log_options.refuse_missing(files)
    from omnidyn.cli import init_robot

    preset = omnidyn.load_robot(like) if like else None
    given_keys = [key for key, value in values.items() if value is not None]
    if not log and flags != NO_FLAGS:
        raise typer.BadParameter("--map, --column, --assume, --no-header, --rate, --max-bytes and --var are for --log.")
    geometry = init_robot.from_logs(values, files, flags.options(), mecanum, bool(like)) if log else None
    robot = init_robot.robot_of(name, values, given_keys, preset, mecanum, friction, geometry)
    _write(robot.name, *init_robot.file_of(robot), path, force, json, like)


def _refuse_words(values: dict[str, Any], mecanum: bool, friction: str, like: str, out: str, json: bool) -> None:
    """Options that contradict each other."""
    count, azimuth = values["wheels"], values["azimuth"]
    if mecanum and (azimuth is not None or count not in (None, 4)):
        raise typer.BadParameter("--mecanum stands for four wheels and where they stand; leave out the rest.")
    if azimuth is not None and count is not None and len(azimuth) != count:
        raise typer.BadParameter(f"--azimuth has {len(azimuth)} values for --wheels {count}.")
    if friction not in ("", "direction", "axes"):
        raise typer.BadParameter("--friction is direction or axes.")
    given = {"--friction": friction, "--speed-loop": values["speed_loop"], "--supply": values["supply"] is not None}
    for flag in (flag for flag, value in given.items() if value):
        if like:
            raise typer.BadParameter(f"{flag} is for a guess; with --like it comes from there.")
    if values["speed_loop"] and values["supply"] is not None:
        raise typer.BadParameter("--speed-loop takes speeds, --supply duties: give one of them.")
    if out == "-" and json:
        raise typer.BadParameter("-o - and --json both want stdout.")


def _refuse_numbers(values: dict[str, Any]) -> None:
    """Numbers with which no robot can be guessed, by the names that they have here. Raises InputError."""
    azimuth, loop = values["azimuth"], values["speed_loop"]
    count = values["wheels"] or (azimuth and len(azimuth))
    for key in ("wheel_radius", "robot_radius"):
        if count and isinstance(values[key], tuple) and len(values[key]) != count:
            raise InputError(
                "wrong number of values",
                got=number_words(values[key]),
                expected=f"1, or one per wheel ({count})",
                where=f"--{key.replace('_', '-')}",
            )
    if loop is not None and len(loop) not in (1, 3):
        raise InputError(
            "not a speed loop",
            got=f"{len(loop)} numbers",
            where="--speed-loop",
            expected="its rate, such as 100 [Hz], or both gains and its rate: 0.5,3,100 [V s/rad, V/rad, Hz]",
        )
    if azimuth is not None and not LEAST_WHEELS <= len(azimuth) <= MOST_WHEELS:
        raise InputError(
            "a robot that can move in every direction has three wheels or more",
            got=f"{len(azimuth)} angles",
            expected=f"{LEAST_WHEELS} to {MOST_WHEELS}, one per wheel, such as 60,180,300",
            where="--azimuth",
        )
    for key, otherwise in (("voltage_limit", "for a guess"), ("supply", "for a drive that takes volts")):
        if (volts := values[key]) is not None and not LEAST_VOLTS <= volts <= MOST_VOLTS:
            raise InputError(
                "no motor turns at this voltage",
                got=f"{volts:g} V",
                expected=f"volts, {LEAST_VOLTS:g} to {MOST_VOLTS:g}, such as 12",
                remedy=f"leave it out {otherwise}",
                where=f"--{key.replace('_', '-')}",
            )
    supply, limit = values["supply"], values["voltage_limit"]
    if supply is not None and limit is not None and limit > supply:
        raise InputError(
            "no driver gives more than its supply",
            got=f"{limit:g} V of a supply of {supply:g} V",
            expected=f"at most {supply:g} V",
            remedy="leave it out: then it is the supply",
            where="--voltage-limit",
        )
    gear = values["gear_ratio"]
    if gear is not None and not 0.0 < gear < float("inf"):
        raise InputError(
            "no gear has this ratio", got=f"{gear:g}", expected="more than 0, such as 30", where="--gear-ratio"
        )


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
            "cannot name a robot and its file like this",
            got=name,
            expected=f"a plain name of 1 to {MAX_NAME} letters",
            remedy="use --out for a file in another folder",
            where="NAME",
        )
    path = out or f"{name}.toml"
    if "\0" in path:
        raise InputError("not a file name", got=path, where="--out")
    if path != "-":
        check_output(path, force)
    return path


def _write(name: str, text: str, guesses: list[str], path: str, force: bool, json: bool, like: str) -> None:
    if path == "-":
        show(text.rstrip("\n"))
    else:
        write_atomic(path, text, force)
    if path != "-":
        document = Document([printable(path)], {"robot": name, "output": path, "guessed": guesses})
        tell(document, json, provenance([robot_input(like)] if like else []))
    if guesses:
        say(f"omnidyn: guessed: {', '.join(guesses)}")
    if like:
        say(f"omnidyn: what was not given is like {like}; inertia and friction are scaled to the size")
