"""The part of `omnidyn identify` for motors: write the robot file and the page, show the result."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, cast

from omnidyn.attempts import Attempts, not_made
from omnidyn.cli.identify_show import Out, say_written
from omnidyn.cli.terminal.streams import say
from omnidyn.cli.terminal.telling import end_failed, tell
from omnidyn.document import apart, sentence
from omnidyn.progress import Progress, Report

if TYPE_CHECKING:
    from omnidyn.identification.identification import Identification
    from omnidyn.identification.motors.into_robot import MotorNumbers
    from omnidyn.identification.motors.study import MotorStudy
    from omnidyn.model.robot import Robot


def tell_motors(
    result: Identification, robot: Robot | None, record: dict[str, Any], to: Out, progress: Progress
) -> None:
    study = cast("MotorStudy", result.study)
    attempts, report, numbers = Attempts(), "", _into_file(study, robot, record, to)
    document = study.document()
    if numbers is not None:
        document = replace(document, parts=apart(document.parts, numbers.parts()))
    if to.report:
        progress(Report("drawing"))
        report = to.write_report(attempts, result, record)
    progress(Report("writing"))
    verdict = " ".join([document.verdict_text, *(sentence(str(statement)) for statement in not_made(attempts.missing))])
    document = replace(document, verdict=verdict, data={**document.data, "verdict": verdict})
    robot_dict, omissions = numbers.to_dict() if numbers is not None else None, [*map(asdict, attempts.missing)]
    tell(document, to.json, record, robot=robot_dict, output=to.files.get(""), report=report or None, missing=omissions)
    say_written([*to.files.values(), report])
    to.finish(attempts)
    if study.failed:
        end_failed(study.verdict)


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
