"""The part of `omnidyn identify` for motors: fit them, write the robot file and the page, show the result."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from omnidyn.cli.identify_logs import Loaded
from omnidyn.cli.identify_show import Out, say_warnings, say_written
from omnidyn.cli.terminal.streams import say, show, show_json
from omnidyn.identification.question import AUTO, STEADY_STATE, Question

if TYPE_CHECKING:
    from omnidyn.identification.motors.into_robot import MotorNumbers
    from omnidyn.identification.motors.study import MotorStudy
    from omnidyn.model.robot import Robot


def run_motors(
    question: Question, loaded: Loaded, robot: Robot | None, record: dict[str, Any], to: Out, now: Any
) -> None:
    """Fit, write, tell."""
    from omnidyn.identification.grouping import held_out
    from omnidyn.identification.motors.study import identify_motors

    out = held_out([run.source for run in loaded.runs], question.hold_out)
    runs = [run for run, away in zip(loaded.runs, out, strict=True) if not away]
    held = [run for run, away in zip(loaded.runs, out, strict=True) if away]
    method = STEADY_STATE if question.method == AUTO else question.method
    study = identify_motors(
        runs, method=method, kind=question.input, speed=question.speed, robot=robot, share=question.window,
        between=question.between, latency=_latency(question), loss=question.loss, held_out=held, now=now,
    )  # fmt: skip
    now("writing")
    _tell(study, robot, record, to)


def _latency(question: Question) -> bool | None:
    """Whether to fit a latency; None is where the logs show one."""
    from omnidyn.errors import InputError

    if question.nuisances is None:
        return None
    for name in question.nuisances:
        if name.partition(".")[0] != "latency":
            raise InputError("of the motors only latency can be fitted", got=name, where="nuisances")
    return bool(question.nuisances)


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
    numbers = _into_file(study, robot, to)
    output = to.out if numbers is not None and numbers.value else ""
    report = ""
    if to.report:

        def render() -> str:
            from omnidyn.report.motors_page import render_motors

            return render_motors(study, record)

        report = to.write_report(render)
    if to.json:
        say_warnings(study.doubts)
        own = numbers.to_dict() if numbers is not None else None
        show_json({
            **study.to_dict(), "robot": own, "output": output or None, "report": report or None, "provenance": record
        })  # fmt: skip
    else:
        show("\n".join([study.summary(), *(numbers.lines() if numbers is not None else [])]).rstrip("\n"))
    say_written([output, report])
    to.finish()
