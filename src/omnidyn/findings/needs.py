"""What each use of a log needs of it. `identify` chooses its method by these rules, and `check` says what they say.

A rule answers with the reason why not, and none where nothing is missing; it never raises.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnidyn.model.actuation import asked_voltage
from omnidyn.model.drive import SPEED
from omnidyn.model.motor import DYNAMIC
from omnidyn.model.robot import Robot
from omnidyn.run import Run
from omnidyn.sensors import OF_WHEELS, PREDICTED
from omnidyn.simulation.exact.exact_march import why_not_exact
from omnidyn.statement import Statement

CURRENT, VOLTAGE = "current", "voltage"  # where the force of the motors is from
MOTOR_INPUTS: tuple[str, ...] = ("voltage", "duty", "current", "force")
LOOP_REMEDY = (
    'write the speed loop of the firmware into the robot file: [drive] kind = "speed", kp_V_s_rad, ki_V_rad, rate_Hz '
    "(the gains may be guesses: they are fitted)"
)


def is_exact(robot: Robot) -> bool:
    """Whether the exact engine of a fit knows this robot."""
    return not why_not_exact(robot) and robot.motor.electrical != DYNAMIC


def why_no_inputs(runs: Sequence[Run], robot: Robot) -> str:
    """Which log has no input that the robot follows, or no output, in words; "" where all have both."""
    for run in runs:
        reason = why_not_whole(run, robot)
        if reason is not None:
            return f"{run.source or 'a log'} {reason}"
    return ""


def why_not_whole(run: Run, robot: Robot | None) -> Statement | None:
    """Why a log cannot be fitted whole; None where it can be. Without a robot: by no robot that there is."""
    no_drive = run.voltage is None and run.duty is None
    if no_drive and has_set_speeds(run):
        if robot is not None and robot.drive.kind != SPEED:
            return Statement("set_speeds_only")
    elif no_drive:
        return Statement("no_input")
    if not any(getattr(run, name) is not None for name in PREDICTED):
        return Statement("no_output")
    return None


def has_set_speeds(run: Run) -> bool:
    """Whether speeds that were asked for are logged."""
    return run.wheel_speed_command is not None or run.twist_command is not None


def needs_supply(run: Run, robot: Robot | None) -> bool:
    """Whether a duty stands alone: no voltage, and no battery, neither logged nor in the robot file."""
    nominal = robot.drive.supply if robot is not None else None
    return run.duty is not None and asked_voltage(run.voltage, run.duty, run.supply, nominal) is None


def force_origin(runs: Sequence[Run]) -> str:
    """Where the force of the motors can be had from in all runs: "current" first, else "voltage", else ""."""
    if all(run.current is not None for run in runs):
        return CURRENT
    return VOLTAGE if all(run.voltage is not None or run.duty is not None for run in runs) else ""


def motor_input(runs: Sequence[Run], kinds: Sequence[str] = MOTOR_INPUTS) -> str:
    """The first of `kinds` that all runs have as input of their motors; "" where there is none."""
    return next((kind for kind in kinds if runs and all(getattr(run, kind) is not None for run in runs)), "")


def turns_known(run: Run) -> bool:
    """Whether a speed or an angle of the wheels was logged."""
    return any(getattr(run, name) is not None for name in OF_WHEELS)


def loses_in_gear(robot: Robot) -> bool:
    """Whether a gear loses power, which a steady state would count as friction."""
    return bool(np.any(np.asarray(robot.motor.gear_efficiency) < 1.0))
