"""The report of `omnidyn identify` by output error: logs, numbers, free runs, residuals, doubts, what to do next."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.findings.finding import Verdict
from omnidyn.identification.advice import (
    DIFFERENCE_HEAD,
    NUMBER_HEAD,
    VERDICT_HEAD,
    advice,
    difference_rows,
    number_rows,
    verdict_advice,
    verdict_rows,
)
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.steady.study_parts import Difference
from omnidyn.identification.validation import Validation, output_name
from omnidyn.report.figures.correlation import draw_correlation
from omnidyn.report.figures.overlay import draw_overlay
from omnidyn.report.figures.residuals import draw_residuals
from omnidyn.report.html import Section, bullets, content, figure, page, paragraph, table
from omnidyn.report.style import Picture

Fits = Mapping[str, OutputErrorEstimate]


def render_fit(
    fits: Fits, validations: Mapping[str, Validation], verdicts: Sequence[Verdict], provenance: Mapping[str, Any],
    differences: Sequence[Difference] = (),
) -> str:  # fmt: skip
    """The page of a fit, as HTML. fits, validations: by group; one group is the whole."""
    first = next(iter(fits.values()))
    robot = first.robot.name
    introduction = (
        f"Numbers of {robot} for which the model, run freely under the logged inputs, comes nearest to all that was "
        f"measured: {first.method}. Data: {'; '.join(f.data for f in fits.values())}."
    )
    sections = [Section("findings", "What the data say", bullets(_findings(fits, validations)))]
    sections.append(Section("numbers", "Numbers, with 95 % intervals", _each(fits, _numbers)))
    if differences:
        sections.append(
            Section("differences", "Between the groups", table(DIFFERENCE_HEAD, difference_rows(differences)))
        )
    sections += [
        Section("data", "The logs, and what check says of them", _verdicts(verdicts)),
        Section("runs", "Measured and model", _each(validations, _runs)),
        Section(
            "residuals", "What the model leaves", "".join(_residuals(g, fits[g], v) for g, v in validations.items())
        ),
        Section("correlation", "What cannot be told apart", "".join(_correlations(fits))),
        Section("doubts", "Doubts", _doubts(fits, validations)),
        Section("next", "What to measure next", _next(fits, validations, verdicts)),
    ]
    return page(f"{robot}: identified from whole logs", introduction, sections, provenance)


def _named(group: str, words: str, fits: Mapping[str, Any]) -> str:
    return words if len(fits) == 1 else f"{group}: {words}"


def _findings(fits: Fits, validations: Mapping[str, Validation]) -> list[str]:
    found = []
    for group, fit in fits.items():
        for name, value, _, interval, unit, mark in number_rows(fit):
            text = f"{name} = {value} {unit}, 95 % {interval}".replace("  ", " ")
            found.append(_named(group, f"{text}{f' ({mark})' if mark else ''}", fits))
    for group, each in validations.items():
        found += [_named(group, words, fits) for words in each.statements()]
    return found


def _each(parts: Mapping[str, Any], content) -> str:
    if len(parts) == 1:
        return "".join(content("", each) for each in parts.values())
    return "".join(paragraph(f"{group}:") + content(group, each) for group, each in parts.items())


def _numbers(group: str, fit: OutputErrorEstimate) -> str:
    return table(NUMBER_HEAD, number_rows(fit))


def _verdicts(verdicts: Sequence[Verdict]) -> str:
    if not verdicts:
        return paragraph("The logs are too long to be checked on the way: see omnidyn check.")
    return table(VERDICT_HEAD, verdict_rows(verdicts))


def _runs(group: str, validation: Validation) -> str:
    pictures = [_renamed(draw_overlay(validation.fitted), f"overlay-fitted{group}", "on a log it was fitted to")]
    if validation.held_out is not None:
        pictures.append(_renamed(draw_overlay(validation.held_out), f"overlay-held-out{group}", "on a log held out"))
    return content(validation.table(), *pictures)


def _renamed(drawn: Picture, name: str, words: str) -> Picture:
    return Picture(_anchor(name), f"{drawn.title}, {words}", drawn.caption, drawn.png, drawn.svg)


def _anchor(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in name)


def _residuals(group: str, fit: OutputErrorEstimate, validation: Validation) -> str:
    logs = [("fitted", validation.fitted, ", logs it was fitted to")]
    if validation.held_out is not None:
        logs.append(("held-out", validation.held_out, ", logs held out"))
    found = []
    for which, comparison, words in logs:
        noise = {key: fit.noise[name] for key in comparison.channels if (name := output_name(key)) in fit.noise}
        found.append(figure(draw_residuals(comparison, noise, _anchor(f"residuals-{which}{group}"), words)))
    return "".join(found)


def _correlations(fits: Fits) -> list[str]:
    found = []
    for group, fit in fits.items():
        drawn = draw_correlation(fit.correlation)
        title = _named(group, drawn.title, fits)
        found.append(figure(Picture(_anchor(f"correlation{group}"), title, drawn.caption, drawn.png, drawn.svg)))
        lost = [f"{name} is not identifiable from these logs" for name in fit.unidentifiable]
        found.append(bullets([_named(group, words, fits) for words in [*lost, *fit.blind]]))
    return found


def _doubts(fits: Fits, validations: Mapping[str, Validation]) -> str:
    words = [_named(group, each, fits) for group, fit in fits.items() for each in fit.warnings]
    for each in validations.values():
        for comparison in (each.fitted, each.held_out):
            words += comparison.warnings if comparison is not None else ()
    return bullets(list(dict.fromkeys(words))) or paragraph("None.")


def _next(fits: Fits, validations: Mapping[str, Validation], verdicts: Sequence[Verdict]) -> str:
    words = verdict_advice(verdicts)
    for group, fit in fits.items():
        words += [_named(group, each, fits) for each in advice(fit, validations.get(group))]
    return bullets(list(dict.fromkeys(words))) or paragraph("Nothing: every number is well determined.")
