"""The report of `omnidyn identify` on logs: what was used, what was found, how sure it is, what to measure next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.document import sentence
from omnidyn.findings.finding import Verdict
from omnidyn.identification.fit_document import verdict_table
from omnidyn.identification.steady.operating_points import FORCES, SPEEDS
from omnidyn.identification.steady.study_table import SteadyStudy
from omnidyn.identification.verdict import steady_verdict
from omnidyn.logs.path import driven
from omnidyn.report.figures.dead_zone_section import dead_zone_section
from omnidyn.report.figures.friction_speed import draw_estimates
from omnidyn.report.figures.shapes import shape_pictures
from omnidyn.report.html import page, section


def render_study(
    study: SteadyStudy, provenance: Mapping[str, Any], *, verdict: str = "", verdicts: Sequence[Verdict] = ()
) -> str:
    """The page of a steady-state study, as HTML. verdict: what it came to; "" is the study's own word. verdicts: of
    `check` on each log."""
    points, document = study.points, study.document()
    introduction = (
        f"Friction of {study.robot.name} from stretches of constant speed: there it balances what the motors push. "
        f"Forces are from {FORCES[points.force_from]}; the motion is the {SPEEDS[points.speed_from]}."
    )
    errors, *pictures = shape_pictures(study)
    sections = [
        section("warnings", "Warnings", document.joined("warnings", "warnings of fits"), none="None."),
        section("next", "What to measure next", document["next"], none="Nothing: every number is well determined."),
        section("forces", "Forces", *pictures),
        section("friction", "Friction against speed", draw_estimates(study.estimates, driven=driven([points.twist]))),
        section("findings", "What the data say", document["statements"]),
        section("shapes", "Which shape", errors, document["shapes"]),
        section("levels", "Friction, with 95 % intervals", document["levels"]),
        dead_zone_section({group: estimate.robot for group, estimate in study.estimates.items()}),
        section("data", "What was used", document["travel"]),
    ]
    sections += [section("logs", "What check says of the logs", verdict_table(verdicts))] if verdicts else []
    title = f"{study.robot.name}: friction from logs"
    return page(
        title,
        introduction,
        sections,
        provenance,
        verdict=verdict or " ".join(sentence(str(estimate)) for estimate in steady_verdict(study)),
    )
