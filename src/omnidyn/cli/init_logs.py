"""What `omnidyn init` takes from logs: where the wheels stand, the radius of the robot, a gear."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from omnidyn.cli import log_options
from omnidyn.cli.terminal.numbers import number_words
from omnidyn.cli.terminal.streams import say

if TYPE_CHECKING:
    from omnidyn.logs.geometry import Geometry
    from omnidyn.logs.read_log import LogOptions
    from omnidyn.model.robot import Robot

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
