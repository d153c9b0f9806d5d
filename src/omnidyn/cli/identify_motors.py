"""The part of `omnidyn identify` for motors: fit them, write the robot file and the page, show the result."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any

import omnidyn
from omnidyn.attempts import Attempts, not_made
from omnidyn.cli.identify_logs import Loaded
from omnidyn.cli.identify_show import Out, say_written
from omnidyn.cli.terminal.session import provenance, robot_input
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import end_failed, tell
from omnidyn.document import apart, sentence
from omnidyn.identification.question import Question
from omnidyn.progress import Progress, Report

if TYPE_CHECKING:
    from omnidyn.identification.motors.into_robot import MotorNumbers
    from omnidyn.identification.motors.study import MotorStudy
    from omnidyn.model.robot import Robot


def run_motors(
    question: Question, loaded: Loaded, robot: Robot | None, record: dict[str, Any], to: Out, progress: Progress
) -> None:
    """Fit; write robot file and report; show the result."""
    study = omnidyn.identify_motors(loaded.runs, robot, question=question, logs=loaded.logs, progress=progress)
    _tell(study, robot, record, to, progress)


def tell_motor_table(table: str, robot: str, question: Question, to: Out) -> None:
    """The same from a table input,speed[,motor], which has no time."""
    from omnidyn.logs.motor_table import read_motor_table

    start, data = omnidyn.load_robot(robot) if robot else None, read_motor_table(table)
    study = omnidyn.identify_motors(data, start, question=question)
    inputs = [{"role": "data", "name": table, "sha256": data.sha256}]
    _tell(study, start, provenance([*([robot_input(robot)] if robot else []), *inputs]), to, lambda _: None)


def _tell(
    study: MotorStudy, robot: Robot | None, record: dict[str, Any], to: Out, progress: Progress
) -> None:  # fmt: skip
    attempts, report, numbers = Attempts(), "", _into_file(study, robot, record, to)
    told = study.document()
    if numbers is not None:
        told = replace(told, parts=apart(told.parts, numbers.parts()))
    if to.report:
        progress(Report("drawing"))
        report = to.write_report(attempts, lambda: _page(study, record))
    progress(Report("writing"))
    verdict = " ".join([told.verdict_text, *(sentence(str(each)) for each in not_made(attempts.missing))])
    told = replace(told, verdict=verdict, data={**told.data, "verdict": verdict})
    own, missing = numbers.to_dict() if numbers is not None else None, [*map(asdict, attempts.missing)]
    tell(told, to.json, record, robot=own, output=to.files.get(""), report=report or None, missing=missing)
    say_written([*to.files.values(), report])
    to.finish(attempts)
    if study.failed:
        end_failed(study.verdict)


def _page(study: MotorStudy, record: dict[str, Any]) -> str:
    from omnidyn.report.motors_page import render_motors

    return render_motors(study, record)


def _into_file(study: MotorStudy, robot: Robot | None, record: dict[str, Any], to: Out) -> MotorNumbers | None:
    """Write the robot file where one is asked for, and the logs determine a number of it."""
    from omnidyn.identification.motors.into_robot import motors_into_robot

    if not to.out:
        return None
    if robot is None:
        say("omnidyn: a robot file needs the robot that the motors belong to, --robot ROBOT; -o is not used")
        return None
    numbers = motors_into_robot(study, robot)
    if numbers.value:
        to.save({"": numbers.robot}, record["inputs"])
    else:
        say("omnidyn: the logs determine no number of a robot file; -o is not used")
    return numbers
