"""The part of `omnidyn identify` that fits motors, wheels off the ground: `--what motors`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from omnidyn.cli.identify_fit import Out, Part, nuisances
from omnidyn.cli.identify_logs import Loaded
from omnidyn.cli.identify_steady import How, say_written
from omnidyn.cli.terminal.streams import say, show, show_json

if TYPE_CHECKING:
    from omnidyn.identification.motors.into_robot import MotorNumbers
    from omnidyn.identification.motors.study import MotorStudy
    from omnidyn.model.robot import Robot


def run_motors(method: str, loaded: Loaded, robot: Robot | None, asked: Any, record: dict[str, Any], now: Any) -> None:
    """Fit, write, tell."""
    from omnidyn.identification.motors.study import STEADY_STATE, identify_motors

    ask, part = asked.fit(), Part(loaded, asked.hold_out)
    study = identify_motors(
        part.runs, method=method or STEADY_STATE, kind=asked.input_, speed=asked.speed, robot=robot,
        share=How(asked.speed, asked.force_from, asked.window).shares(), between=ask.between or "auto",
        latency=_latency(nuisances(ask.nuisances)), loss=ask.loss or "gaussian", held_out=[run for run, _ in part.held],
        now=now,
    )  # fmt: skip
    now("writing")
    _tell(study, robot, record, asked.places())


def _latency(asked: str | list[str]) -> bool | None:
    """Whether to fit a latency; None is where the logs show one."""
    from omnidyn.errors import InputError

    if asked == "auto":
        return None
    for name in asked:
        if name.partition(".")[0] != "latency":
            raise InputError("of the motors only latency can be fitted", got=name, where="nuisances")
    return bool(asked)


def _into_file(study: MotorStudy, robot: Robot | None, to: Out) -> MotorNumbers | None:
    """Write the robot file where one is asked for, and the logs determine a number of it."""
    from omnidyn.identification.motors.into_robot import motors_into_robot
    from omnidyn.model.robot_file import save_robot

    if not to.out:
        return None
    if robot is None:
        say("omnidyn: a robot file needs the robot that the motors belong to, --robot ROBOT; -o is not used")
        return None
    numbers = motors_into_robot(study, robot)
    if numbers.value:
        save_robot(numbers.robot, to.out, to.force)
    else:
        say("omnidyn: the logs determine no number of a robot file; -o is not used")
    return numbers


def _tell(study: MotorStudy, robot: Robot | None, record: dict[str, Any], to: Out) -> None:
    """Write and show: robot file, report, JSON or the summary."""
    from omnidyn.files import write_atomic

    numbers = _into_file(study, robot, to)
    output = to.out if numbers is not None and numbers.value else ""
    if to.report:
        from omnidyn.report.motors_page import render_motors

        write_atomic(to.report, render_motors(study, record), to.force)
    if to.json:
        for warning in study.doubts:
            say(f"omnidyn: warning: {warning}")
        own = numbers.to_dict() if numbers is not None else None
        show_json({
            **study.to_dict(), "robot": own, "output": output or None, "report": to.report or None, "provenance": record
        })  # fmt: skip
    else:
        show("\n".join([study.summary(), *(numbers.lines() if numbers is not None else [])]).rstrip("\n"))
    say_written([output, to.report])
