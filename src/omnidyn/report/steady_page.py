"""The report of `omnidyn identify` on logs: what was used, what was found, how sure it is, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.identification.steady.operating_points import SPEEDS
from omnidyn.identification.steady.study import SteadyStudy
from omnidyn.identification.steady.study_table import (
    LEVEL_HEAD,
    SHAPE_HEAD,
    TRAVEL_HEAD,
    level_rows,
    shape_rows,
    travel_rows,
)
from omnidyn.identification.steady.study_words import FORCES
from omnidyn.report.figures.shapes import shape_pictures
from omnidyn.report.html import Section, bullets, figure, page, paragraph, table


def render_study(study: SteadyStudy, provenance: Mapping[str, Any]) -> str:
    """The page of a steady-state study, as HTML."""
    points = study.points
    introduction = (
        f"Friction of {study.robot.name} from stretches of constant speed: there it balances what the motors push. "
        f"Forces are from {FORCES[points.force_from]}; the motion is the {SPEEDS[points.speed_from]}."
    )
    errors, *pictures = shape_pictures(study)
    doubts = [*study.warnings]
    for group, estimate in study.estimates.items():
        doubts += [words if group == "all" else f"{group}: {words}" for words in estimate.warnings]
    sections = [
        Section("findings", "What the data say", bullets(study.statements)),
        Section("levels", "Friction, with 95 % intervals", table(LEVEL_HEAD, level_rows(study))),
        Section("data", "What was used", table(TRAVEL_HEAD, travel_rows(study))),
        Section("shapes", "Which shape", figure(errors) + table(SHAPE_HEAD, shape_rows(study))),
        Section("forces", "Forces", "".join(map(figure, pictures))),
        Section("doubts", "Doubts", bullets(doubts) or paragraph("None.")),
        Section("next", "What to measure next", bullets(study.advice)),
    ]
    return page(f"{study.robot.name}: friction from logs", introduction, sections, provenance)
