"""The report of `omnidyn identify` on a table of steady points, or on logs with --shape line: Fig. 3 with own data."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from omnidyn.document import Points
from omnidyn.identification.fit_document import verdict_table
from omnidyn.identification.identification import Identification
from omnidyn.report.figures.dead_zone_section import dead_zone_section
from omnidyn.report.figures.friction_speed import draw_estimates
from omnidyn.report.html import Section, content, page, paragraph, section


def render_lines(result: Identification, provenance: Mapping[str, Any]) -> str:
    """The page of the paper's line on each axis, as HTML."""
    estimates = result.groups
    warnings = list(dict.fromkeys(warning for estimate in estimates.values() for warning in estimate.warnings))
    words = {group: f"{group}: {estimate.data}." for group, estimate in estimates.items()}
    numbers = "".join(
        (paragraph(words[group]) if len(estimates) > 1 else "") + content(estimate.document()["numbers"])
        for group, estimate in estimates.items()
    )
    first = next(iter(estimates.values()))
    sections = [
        section("warnings", "Warnings", Points(warnings), none="None."),
        *([section("next", "What to mend", Points(result.advice))] if result.advice else []),
        section("friction", "Friction against speed", draw_estimates(estimates)),
        Section("numbers", "All numbers, with standard errors", numbers),
        dead_zone_section({group: estimate.robot for group, estimate in estimates.items()}),
    ]
    if result.verdicts:
        sections.append(section("logs", "What check says of the logs", verdict_table(result.verdicts)))
    title = f"{first.robot.name}: friction from steady speeds"
    introduction = f"{first.method[:1].upper()}{first.method[1:]}. Data: {first.data}." if len(estimates) == 1 else ""
    return page(title, introduction, sections, provenance, verdict=result.verdict)
