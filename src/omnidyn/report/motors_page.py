"""The report of `omnidyn identify` on motors: what each needs to turn, how sure that is, and the windows if any."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.identification.fit_document import verdict_table
from omnidyn.identification.motors.study import MotorStudy
from omnidyn.report.figures.motor_lines import draw_motor_lines
from omnidyn.report.html import page, section

WINDOWS = (
    "What each motor needs to turn: slope, dead band and inertia, from windows in integral form: the integral of the "
    "input is the slope times the angle turned, plus the dead band times the time it turned, plus the inertia times "
    "the change of speed."
)
FREE_RUNS = (
    "Slope, dead band and lag of each motor for which its free run under the logged input comes nearest to the "
    "measured speed; with and without a dead band."
)


def render_motors(study: MotorStudy, provenance: Mapping[str, Any]) -> str:
    """The page of the motors, as HTML."""
    document = study.document()
    windows = study.windows or study.drawn
    pictures = [] if windows is None else [draw_motor_lines(study.motors, windows, study.starts, study.curves)]
    sections = [
        section("warnings", "Warnings", document["warnings"], none="None."),
        *([section("next", "What to mend", document["next"])] if study.advice else []),
        *([section("figures", "What each motor needs", *pictures)] if pictures else []),
        section("findings", "What the data say", document["statements"]),
        *([section("starts", "Where each direction starts", document["starts"])] if study.starts else []),
        *([section("curves", "Where speed is no line of the input", document["curves"])] if study.curves else []),
        section("numbers", "Numbers, with 95 % intervals", document["motors"]),
    ]
    if study.verdicts:
        sections += [section("logs", "What check says of the logs", verdict_table(study.verdicts))]
    introduction = WINDOWS if study.windows is not None else FREE_RUNS
    return page("Motors from logs", introduction, sections, provenance, verdict=document.verdict_text)
