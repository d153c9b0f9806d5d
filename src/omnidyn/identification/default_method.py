"""Which method a robot and its logs allow: output error, or where they do not allow that, steady state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from omnidyn.clocks import usual_step
from omnidyn.findings.needs import MOTOR_INPUTS, motor_input, why_no_inputs
from omnidyn.identification.methods import (
    OUTPUT_ERROR,
    STEADY_STATE,
    Method,
    MotorFit,
    MotorLine,
    OutputError,
    SteadyState,
)
from omnidyn.identification.steady.loop_speed import why_no_transient
from omnidyn.model.drive import DUTY, SPEED, VOLTAGE
from omnidyn.model.robot import MEASURED, Prior, Robot
from omnidyn.progress import Progress, Report
from omnidyn.run import Run


def as_driven(robot: Robot, runs: Sequence[Run]) -> Robot:
    """The robot with the drive that its logs show: one of duties where they hold duties and no voltage.

    A file without it would take the next set of duties for volts. The supply is the median of the logged one, where
    the file has none.
    """
    if robot.drive.kind != VOLTAGE or not runs or any(run.duty is None or run.voltage is not None for run in runs):
        return robot
    drive, priors = robot.drive.replace(kind=DUTY), robot.priors
    supplies = [run.supply[np.isfinite(run.supply)] for run in runs if run.supply is not None]
    logged = np.concatenate(supplies) if supplies else np.zeros(0)
    if drive.supply is None and logged.size and float(np.median(logged)) > 0.0:
        drive = drive.replace(supply=round(float(np.median(logged)), 3))
        priors = {**priors, "drive.supply_V": Prior(source="median of the logs", origin=MEASURED)}
    return robot.replace(drive=drive, priors=priors)


def why_not_output_error(runs: Sequence[Run], robot: Robot) -> str:
    """Why whole logs are not fitted by output error unless it is asked for, in words; "" where they are."""
    reason = why_no_inputs(runs, robot)
    if reason or robot.drive.kind != SPEED or any(run.voltage is not None or run.duty is not None for run in runs):
        return reason
    return why_no_transient(runs, robot)


class Choice(NamedTuple):
    """A method, and why it is not the one by default: in words, "" where it is, or where it was asked for."""

    method: Method | None
    reason: str = ""


def default_method(runs: Sequence[Run], robot: Robot, hold_out: Sequence[str], progress: Progress) -> Choice:
    """The method that robot and logs support; `progress` hears why it is not output error.

    hold_out: of `identify`; only output error predicts logs.
    """
    reason = "" if hold_out else why_not_output_error(runs, robot)
    if reason:
        progress(Report(f"{STEADY_STATE}, not {OUTPUT_ERROR}: {reason}", urgent=True))
    return Choice(SteadyState() if reason else OutputError(), reason)


def default_motor_method(runs: Sequence[Run], input: str, progress: Progress) -> MotorFit | MotorLine:
    """Free runs of whole logs; the line of each motor for a current, and for rows too far apart for a free run.

    input: "voltage", "duty", "current" or "force"; "" for the first that all runs have. `progress` hears why it is the
    line.
    """
    from omnidyn.identification.motors.fit import FREE_RUN_INPUTS  # imported lazily: slow to load
    from omnidyn.identification.motors.points import SLOW_ROW

    kind = input or motor_input(runs, MOTOR_INPUTS)
    step = max((usual_step(run.t) for run in runs), default=0.0)
    reason = f"rows are {step:.2g} s apart" if step > SLOW_ROW else ""
    if kind and kind not in FREE_RUN_INPUTS:
        reason = f"the input is a {kind}"
    if kind and not reason:
        return MotorFit(input=input)
    if reason:
        progress(Report(f"{STEADY_STATE}, not {OUTPUT_ERROR}: {reason}", urgent=True))
    return MotorLine(input=input)  # which names all inputs where there is none
