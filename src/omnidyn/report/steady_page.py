"""The report of `omnidyn identify` on logs: what was used, what was found, how sure it is, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.identification.motors.drive_line import DriveStudy
from omnidyn.identification.motors.drive_table import DRIVE_HEAD, drive_rows
from omnidyn.identification.steady.operating_points import SPEEDS
from omnidyn.identification.steady.study import SteadyStudy
from omnidyn.identification.steady.study_table import study_document
from omnidyn.identification.steady.study_words import FORCES
from omnidyn.report.figures.drive_lines import draw_drive_lines
from omnidyn.report.figures.shapes import shape_pictures
from omnidyn.report.html import Section, bullets, figure, page, paragraph, section, table


def render_study(study: SteadyStudy, provenance: Mapping[str, Any]) -> str:
    """The page of a steady-state study, as HTML."""
    points, told = study.points, study_document(study)
    introduction = (
        f"Friction of {study.robot.name} from stretches of constant speed: there it balances what the motors push. "
        f"Forces are from {FORCES[points.force_from]}; the motion is the {SPEEDS[points.speed_from]}."
    )
    errors, *pictures = shape_pictures(study)
    sections = [
        section("findings", "What the data say", told["statements"]),
        section("levels", "Friction, with 95 % intervals", told["levels"]),
        section("data", "What was used", told["travel"]),
        section("shapes", "Which shape", errors, told["shapes"]),
        section("forces", "Forces", *pictures),
        section("doubts", "Doubts", told.joined("warnings", "doubts"), none="None."),
        section("next", "What to measure next", told["next"]),
    ]
    return page(f"{study.robot.name}: friction from logs", introduction, sections, provenance)


def render_drives(study: DriveStudy, provenance: Mapping[str, Any]) -> str:
    """The page of the lines of motors, as HTML."""
    introduction = (
        "What each motor needs to turn: slope, dead band and inertia, from windows in integral form: the integral of "
        "the input is the slope times the angle turned, plus the dead band times the time it turned, plus the inertia "
        "times the change of speed."
    )
    sections = [
        Section("findings", "What the data say", bullets(study.statements)),
        Section("lines", "Lines, with 95 % intervals", table(DRIVE_HEAD, drive_rows(study))),
        Section("figures", "Figures", figure(draw_drive_lines(study))),
        Section("doubts", "Doubts", bullets(study.warnings) or paragraph("None.")),
    ]
    return page("Motors from logs", introduction, sections, provenance)
