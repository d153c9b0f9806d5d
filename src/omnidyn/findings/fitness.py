"""What a log can be used for: a fit of whole logs, steady state, motors, geometry; each yes, or no and why.

The rules are those by which `identify` itself decides and refuses (needs.py), and what reads a log for it: steady
windows (logs/plateaus.py) and where the wheels stand (logs/geometry.py).
"""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from omnidyn.errors import OmnidynError
from omnidyn.findings import needs
from omnidyn.findings.finding import Use
from omnidyn.findings.signal.log_under_check import MIN_ROWS
from omnidyn.logs.columns.mapping import ColumnMap, component_channel
from omnidyn.logs.geometry import shows_both, wheel_geometry
from omnidyn.logs.log import Log
from omnidyn.logs.plateaus import MIN_DURATION, Plateau, first_plateaus
from omnidyn.logs.sensor_rows import on_clock_of_wheels
from omnidyn.model.drive import SPEED
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.sensors import OF_WHEELS, PREDICTED
from omnidyn.statement import ERROR, NOTE, WARNING, Statement

WHOLE_LOGS, STEADY, MOTORS, GEOMETRY = "whole logs", "steady state", "motors", "geometry"
USES = (WHOLE_LOGS, STEADY, MOTORS, GEOMETRY)
MOST_WINDOWS = 12  # steady windows that are counted
AT_REST = 0.02  # [rad/s] of a wheel: 1 mm/s at the rim of one of 5 cm
SURE_ERRORS = 2.0  # standard errors: a mean speed below is not known to be one
NEVER, FEW_ROWS = "never_moved", "few_rows"  # findings that leave nothing to do
INPUTS, SET_SPEEDS = ("voltage", "duty"), ("wheel_speed_command", "twist_command")


def uses(log: Log, robot: Robot | None = None, codes: Collection[str] = ()) -> tuple[Use, ...]:
    """What a log can be used for as it stands. codes: of the findings on it. Never raises for what the log holds."""
    reason, run = _why_nothing(log, codes), None
    try:
        run = None if reason else log.to_run()
    except OmnidynError as error:
        reason = _refused(error)
    if run is None or reason is not None:
        assert reason is not None
        return tuple(Use(name, False, reason) for name in USES)
    columns = log.columns
    return (_whole(run, robot, columns), _steady(run, robot, columns), _motors(run, columns), _geometry(run))


def _why_nothing(log: Log, codes: Collection[str]) -> Statement | None:
    if len(log) < 2:
        return Statement("no_two_rows", ERROR)
    if FEW_ROWS in codes:
        return Statement("too_few_rows", ERROR, "", {"rows": len(log), "least": MIN_ROWS})
    return Statement("robot_rests", ERROR) if NEVER in codes else None


def _refused(error: OmnidynError) -> Statement:
    """What the message of an error says, with its remedy."""
    return Statement("refused", ERROR, "", {"what": error.what, "remedy": error.remedy})


def _not(use: str, code: str, columns: ColumnMap, *channels: str, **numbers: object) -> Use:
    """A use that a log does not serve, with the doubts about columns that look like the channels that are missing."""
    doubts = [
        doubt for doubt in columns.doubts if any(component_channel(name) in channels for name in doubt.components)
    ]
    return Use(use, False, Statement(code, WARNING, "", {**numbers, "doubts": doubts}))


def _yes(use: str, code: str, **numbers: object) -> Use:
    return Use(use, True, Statement(code, NOTE, "", numbers))


def _whole(run: Run, robot: Robot | None, columns: ColumnMap) -> Use:
    """A fit of the whole log by output error."""
    reason = needs.why_not_whole(run, robot)
    if reason is not None:
        no_output = not any(getattr(run, name) is not None for name in PREDICTED)
        no_input = run.voltage is None and run.duty is None
        channels = (*(INPUTS if no_input else ()), *(PREDICTED if no_output else ()))
        return _not(WHOLE_LOGS, reason.code, columns, *channels)
    if use := _not_robot(WHOLE_LOGS, run, robot, columns) or _no_battery(WHOLE_LOGS, run, robot, columns):
        return use
    if use := _no_stretch(run, robot, columns):
        return use
    drives = next(name for name in (*INPUTS, *SET_SPEEDS) if getattr(run, name) is not None)
    outputs = [name for name in PREDICTED if getattr(run, name) is not None]
    return _yes(WHOLE_LOGS, "serves_whole", input=drives, outputs=outputs, needs=_needs_of_robot(run, robot, drives))


def _needs_of_robot(run: Run, robot: Robot | None, drives: str) -> str:
    """What a robot file must have, where none was given: "speed_loop", "supply" or "robot"; "" where one was."""
    if robot is not None:
        return ""
    if drives in SET_SPEEDS:
        return "speed_loop"
    return "supply" if drives == "duty" and needs.needs_supply(run, None) else "robot"


def _not_robot(use: str, run: Run, robot: Robot | None, columns: ColumnMap) -> Use | None:
    if robot is None or run.wheels is None or run.wheels == robot.wheels.count:
        return None
    return _not(use, "other_robot", columns, wheels=run.wheels, of_robot=robot.wheels.count, robot=robot.name)


def _no_battery(use: str, run: Run, robot: Robot | None, columns: ColumnMap) -> Use | None:
    if robot is None or robot.drive.kind == SPEED or not needs.needs_supply(run, robot):
        return None
    return _not(use, "no_battery", columns, "supply")


def _no_stretch(run: Run, robot: Robot | None, columns: ColumnMap) -> Use | None:
    """Where no rows have an input of all wheels at once."""
    name = next((name for name in INPUTS if getattr(run, name) is not None), "")
    if not name or (robot is not None and robot.drive.kind == SPEED):
        return None
    finite = np.isfinite(getattr(run, name))
    absent = [int(k) + 1 for k in np.flatnonzero(~finite.any(axis=0))]
    if absent or finite.all(axis=1).sum() < MIN_ROWS:
        return _not(WHOLE_LOGS, "input_incomplete", columns, channel=name, missing=absent)
    return None


def _steady(run: Run, robot: Robot | None, columns: ColumnMap) -> Use:
    """Friction from stretches of constant speed."""
    origin = needs.force_origin([run])
    if not origin:
        return _not(STEADY, "no_force", columns, *INPUTS, "current")
    if not needs.turns_known(run):
        return _not(STEADY, "no_wheel_motion", columns, *OF_WHEELS)
    battery = _no_battery(STEADY, run, robot, columns) if origin == needs.VOLTAGE else None
    if use := _not_robot(STEADY, run, robot, columns) or battery:
        return use
    if robot is not None and needs.loses_in_gear(robot):
        return _not(STEADY, "lossy_gear", columns)
    windows = first_plateaus(on_clock_of_wheels(run), MOST_WINDOWS)
    count = sum(map(_moves, windows))
    if not count:
        return _not(STEADY, "no_steady_stretch", columns, hold_s=MIN_DURATION, at_rest=len(windows))
    drives = "duty" if origin == needs.VOLTAGE and run.voltage is None else origin
    truncated = len(windows) == MOST_WINDOWS
    return _yes(
        STEADY,
        "serves_steady",
        stretches=count,
        more=truncated,
        force_from=drives,
        needs=_needs_of_robot(run, robot, drives),
    )


def _moves(window: Plateau) -> bool:
    """Whether a wheel surely turns in a steady window."""
    speed, std = window.mean.get("wheel_speed"), window.std.get("wheel_speed")
    if speed is None or std is None:
        return False
    return bool((np.abs(speed) > np.maximum(AT_REST, SURE_ERRORS * np.nan_to_num(std))).any())


def _motors(run: Run, columns: ColumnMap) -> Use:
    """The line of each motor."""
    kind = needs.motor_input([run])
    if not kind:
        return _not(MOTORS, "no_motor_input", columns, *needs.MOTOR_INPUTS)
    if not needs.turns_known(run):
        return _not(MOTORS, "no_motor_motion", columns, *OF_WHEELS)
    return _yes(
        MOTORS, "serves_motors", input=kind, speeds=[name for name in OF_WHEELS if getattr(run, name) is not None]
    )


def _geometry(run: Run) -> Use:
    """Where the wheels stand."""
    if not shows_both(run):
        return Use(GEOMETRY, False, Statement("no_two_motions"))
    try:
        geometry = wheel_geometry([run])
    except OmnidynError as error:
        return Use(GEOMETRY, False, _refused(error))
    except np.linalg.LinAlgError:
        return Use(GEOMETRY, False, Statement("speeds_beyond_robots"))
    return _yes(GEOMETRY, "serves_geometry", azimuth_deg=geometry.azimuth_deg, source=geometry.source)
