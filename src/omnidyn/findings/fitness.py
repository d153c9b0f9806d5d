"""What a log is good for: a fit of whole logs, steady state, motors, geometry; each yes, or no and why.

The rules are those by which `identify` itself decides and refuses (needs.py), and what reads a log for it: steady
windows (logs/plateaus.py) and where the wheels stand (logs/geometry.py).
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from omnidyn.document import all_of
from omnidyn.errors import OmnidynError
from omnidyn.findings import needs
from omnidyn.findings.signal.log_under_check import MIN_ROWS
from omnidyn.findings.use import Use
from omnidyn.logs.columns.mapping import ColumnMap, component_channel
from omnidyn.logs.geometry import shows_both, wheel_geometry
from omnidyn.logs.log import Log
from omnidyn.logs.one_clock import on_clock_of_wheels
from omnidyn.logs.plateaus import MIN_DURATION, Plateau, first_plateaus
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.run import Run

WHOLE, STEADY, MOTORS, GEOMETRY = "whole logs", "steady state", "motors", "geometry"
USES = (WHOLE, STEADY, MOTORS, GEOMETRY)
ENOUGH = 12  # steady windows that are counted
AT_REST = 0.02  # [rad/s] of a wheel: 1 mm/s at the rim of one of 5 cm
SURE = 2.0  # standard errors: a mean speed below is not known to be one
NEVER, FEW = "never_moved", "few_rows"  # findings that leave nothing to do
INPUTS, SET_SPEEDS = ("voltage", "duty"), ("wheel_speed_command", "twist_command")
WHEELS = ("wheel_speed", "wheel_angle")


def uses(log: Log, robot: Robot | None = None, codes: Collection[str] = ()) -> tuple[Use, ...]:
    """What a log is good for as it stands. codes: of the findings on it. Never raises for what the log holds."""
    why = _why_nothing(log, codes)
    run = None
    try:
        run = None if why else log.to_run()
    except OmnidynError as error:
        why = error.what if not error.remedy else f"{error.what}; {error.remedy}"
    if run is None:
        return tuple(Use(name, False, why) for name in USES)
    lacks = _Lacks(log.columns)
    return (_whole(run, robot, lacks), _steady(run, robot, lacks), _motors(run, robot, lacks), _geometry(run))


def _why_nothing(log: Log, codes: Collection[str]) -> str:
    if len(log) < 2:
        return "it holds no two rows"
    if FEW in codes:
        return f"{len(log)} rows, too few to tell motion from noise: {MIN_ROWS} or more are needed, 10 s are better"
    return "the robot never moves: drive it beyond its dead zone" if NEVER in codes else ""


@dataclass(frozen=True)
class _Lacks:
    """What the columns say of channels that are not there."""

    columns: ColumnMap

    def words(self, what: str, *channels: str) -> str:
        """What is lacking, and which columns look like it but were not taken."""
        doubted = self.columns.doubted.items()
        found = dict.fromkeys(words for name, words in doubted if component_channel(name) in channels)
        return f"{what}: {'; '.join(found)}" if found else what


def _whole(run: Run, robot: Robot | None, lacks: _Lacks) -> Use:
    """A fit of the whole log by output error."""
    why = needs.why_not_whole(run, robot)
    if why:
        no_output = not any(getattr(run, name) is not None for name in needs.OUTPUTS)
        no_input = run.voltage is None and run.duty is None
        channels = (*(INPUTS if no_input else ()), *(needs.OUTPUTS if no_output else ()))
        return Use(WHOLE, False, lacks.words(f"it {why}", *channels))
    if why := _why_not_robot(run, robot) or _why_no_battery(run, robot, lacks):
        return Use(WHOLE, False, why)
    if why := _why_no_stretch(run, robot):
        return Use(WHOLE, False, why)
    drives = next(name for name in (*INPUTS, *SET_SPEEDS) if getattr(run, name) is not None)
    outputs = [name for name in needs.OUTPUTS if getattr(run, name) is not None]
    return Use(WHOLE, True, f"{drives} in, {all_of(outputs)} out{_if_robot(run, robot, drives)}")


def _if_robot(run: Run, robot: Robot | None, drives: str) -> str:
    """What a robot file must have, where none was given."""
    if robot is not None:
        return ""
    if drives in SET_SPEEDS:
        return '; with a robot file that has the speed loop of the firmware, [drive] kind = "speed"'
    return f"; with a robot file{' that has supply_V' if drives == 'duty' and needs.needs_supply(run, None) else ''}"


def _why_not_robot(run: Run, robot: Robot | None) -> str:
    if robot is None or run.wheels is None or run.wheels == robot.wheels.count:
        return ""
    return f"the log is of {run.wheels} wheels, {robot.name} has {robot.wheels.count}"


def _why_no_battery(run: Run, robot: Robot | None, lacks: _Lacks) -> str:
    if robot is None or robot.drive.kind == SPEED or not needs.needs_supply(run, robot):
        return ""
    return lacks.words("a duty needs its battery: a column supply, or [drive] supply_V in the robot file", "supply")


def _why_no_stretch(run: Run, robot: Robot | None) -> str:
    """An input of all wheels at once, in more rows than one."""
    name = next((name for name in INPUTS if getattr(run, name) is not None), "")
    if not name or (robot is not None and robot.drive.kind == SPEED):
        return ""
    known = np.isfinite(getattr(run, name))
    lacking = [f"{k + 1}" for k in np.flatnonzero(~known.any(axis=0))]
    if lacking:
        return f"no {name} of wheel {all_of(lacking)}"
    return "" if known.all(axis=1).sum() >= MIN_ROWS else f"hardly a row has the {name} of all wheels"


def _steady(run: Run, robot: Robot | None, lacks: _Lacks) -> Use:
    """Friction from stretches of constant speed."""
    origin = needs.force_origin([run])
    if not origin:
        return Use(STEADY, False, lacks.words("no current and no motor input", *INPUTS, "current"))
    if not needs.turns_known(run):
        return Use(STEADY, False, lacks.words("no speed or angle of the wheels", *WHEELS))
    battery = _why_no_battery(run, robot, lacks) if origin == needs.VOLTAGE else ""
    if why := _why_not_robot(run, robot) or battery:
        return Use(STEADY, False, why)
    if robot is not None and needs.loses_in_gear(robot):
        return Use(STEADY, False, "the robot file has a lossy gear, which a steady state does not know")
    windows = first_plateaus(on_clock_of_wheels(run), ENOUGH)
    count = sum(map(_moves, windows))
    if not count:
        rest = ", only at rest" if windows else ""
        return Use(STEADY, False, f"no stretch of constant speed{rest}: hold commands for {MIN_DURATION:g} s or more")
    many = f"{count} or more stretches" if len(windows) == ENOUGH else f"{count} stretch{'es' * (count > 1)}"
    drives = "duty" if origin == needs.VOLTAGE and run.voltage is None else origin
    return Use(STEADY, True, f"{many} of constant speed, the force from {drives}{_if_robot(run, robot, drives)}")


def _moves(window: Plateau) -> bool:
    """Whether a wheel surely turns in a steady window."""
    speed, std = window.mean.get("wheel_speed"), window.std.get("wheel_speed")
    if speed is None or std is None:
        return False
    return bool((np.abs(speed) > np.maximum(AT_REST, SURE * np.nan_to_num(std))).any())


def _motors(run: Run, robot: Robot | None, lacks: _Lacks) -> Use:
    """The line of each motor."""
    kind = needs.motor_input([run])
    if not kind:
        return Use(MOTORS, False, lacks.words("no motor input", *needs.MOTOR_INPUTS))
    if not needs.turns_known(run):
        return Use(MOTORS, False, lacks.words("no speed or angle of the motors", *WHEELS))
    speed = all_of([name for name in WHEELS if getattr(run, name) is not None])
    return Use(MOTORS, True, f"{kind} against {speed}, if the wheels were off the ground")


def _geometry(run: Run) -> Use:
    """Where the wheels stand."""
    if not shows_both(run):
        return Use(GEOMETRY, False, "no motion of both the body and the wheels")
    try:
        seen = wheel_geometry([run])
    except OmnidynError as error:
        return Use(GEOMETRY, False, error.what)
    except np.linalg.LinAlgError:
        return Use(GEOMETRY, False, "the speeds are beyond all numbers of a robot")
    angles = all_of([f"{angle:.0f}" for angle in seen.azimuth_deg])
    return Use(GEOMETRY, True, f"the wheels push as omni wheels at {angles} degrees do ({seen.source})")
