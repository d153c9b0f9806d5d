"""The report of `omnidyn identify` by output error: logs, numbers, free runs, residuals, warnings, what to do next."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np

from omnidyn.comparison.model_bands import with_fitted_band
from omnidyn.comparison.result import Comparison
from omnidyn.document import Points, sentence
from omnidyn.identification.fit_document import difference_table, number_table, short_table, verdict_table
from omnidyn.identification.identification import Identification
from omnidyn.identification.output_error.answer import OutputErrorEstimate
from omnidyn.identification.validation import FITTED, HELD_OUT, Score, Validation, output_name
from omnidyn.logs.columns.mapping import component_channel
from omnidyn.logs.path import BodyPath, body_twist, driven, path_of
from omnidyn.report.figures.correlations import draw_correlation
from omnidyn.report.figures.dead_zone_section import dead_zone_section
from omnidyn.report.figures.friction_speed import draw_estimates
from omnidyn.report.figures.overlay import draw_overlay
from omnidyn.report.figures.path import draw_path
from omnidyn.report.figures.residuals import draw_residuals, residuals_of
from omnidyn.report.html import Section, beside, bullets, content, figure, page, paragraph, section
from omnidyn.report.misfit_section import draw_misfit
from omnidyn.report.style import Picture
from omnidyn.run import Run
from omnidyn.sensors import COUNTED

Fits = Mapping[str, OutputErrorEstimate]
Bands = tuple[Comparison, Comparison | None]


def render_fit(result: Identification, provenance: Mapping[str, Any]) -> str:
    """The page of an identification by output error, as HTML."""
    fits, validations = result.fits, result.validations
    with ThreadPoolExecutor(1) as pool:  # bands take many runs, which leave the interpreter to whoever draws
        banded = {group: pool.submit(_with_bands, fits, group, validation) for group, validation in validations.items()}
        return _page(result, fits, validations, banded, provenance)


def _page(
    result: Identification,
    fits: Fits,
    validations: Mapping[str, Validation],
    banded: Mapping[str, Future[Bands]],
    provenance: Mapping[str, Any],
) -> str:
    """All of it. banded: group -> its comparisons with the band of the model, which are on their way."""
    first = next(iter(fits.values()))
    robot = first.robot.name
    method_words = (
        f"Numbers of {robot} for which the model, run freely under the logged inputs, comes nearest to all that was "
        f"measured: {first.method}. Data: {'; '.join(f.data for f in fits.values())}."
    )
    between = [section("differences", "Between the groups", difference_table(result.differences))]
    friction = draw_estimates(fits, driven=_driven(fits, validations))
    travelled = _paths(fits, validations)
    unchecked = paragraph("The logs are too long to be checked on the way: see omnidyn check.")
    checked = content(verdict_table(result.verdicts)) if result.verdicts else unchecked
    warnings, advice = list(dict.fromkeys(_warnings(fits, validations))), list(dict.fromkeys(result.advice))
    residuals = "".join(_residuals(g, fits[g], v) for g, v in validations.items())
    climbed = _ladder(next(iter(fits.values())))  # all groups have the same
    numbers = _each(fits, lambda group, fit: content(*filter(None, (number_table(fit), fit.alone_table()))))
    sections = [
        section("warnings", "Warnings", Points(warnings), none="None."),
        section("next", "What to measure next", Points(advice), none="Nothing: every number is well determined."),
        Section("misfit", "What the model leaves out", _each(fits, _misfit)),
        *([Section("ladder", "What was switched on, step by step", climbed)] if climbed else []),
        section("friction", "Friction against speed", friction),
        *([section("path", "Where the logs went", draw_path(travelled))] if travelled else []),
        section("findings", "What the data say", Points(_findings(fits, validations))),
        dead_zone_section({group: fit.robot for group, fit in fits.items()}),
        Section("rests", "What the numbers rest on", _each(fits, _rests)),
        Section("stability", "Whether the numbers are the same throughout the logs", _each(fits, _stability)),
        Section("residuals", "Residuals", residuals),
        Section("correlation", "What cannot be told apart", "".join(_correlations(fits))),
        Section("numbers", "All numbers, with standard errors", paragraph(method_words) + numbers),
        *(between if result.differences else []),
        Section(
            "scores",
            "How near the model comes",
            _each(validations, lambda group, validation: content(validation.table())),
        ),
        Section("data", "The logs, and what check says of them", checked),
    ]
    runs = Section("runs", "Measured and model", _each(banded, _runs))  # the last to be drawn: bands take longest
    sections.insert(2, runs)
    group, fit = next(iter(fits.items()))
    screen = beside(content(short_table(fit)), _first_overlay(group, banded))
    full_verdict = f"Verdict in full: {result.verdict}" if result.verdict != result.headline else ""
    return page(
        f"{robot}: identified from whole logs",
        full_verdict,
        sections,
        provenance,
        verdict=result.headline,
        screen=screen,
    )


def _first_overlay(group: str, banded: Mapping[str, Future[Bands]]) -> str:
    """Model and measurement of the first log held out, or fitted where none was; nothing where none was compared."""
    if group not in banded:
        return ""
    fit_comparison, held_out = banded[group].result()
    return figure(
        _renamed(draw_overlay(held_out or fit_comparison), "overlay-first", "held out" if held_out else "fitted")
    )


def _named(group: str, words: object, fits: Mapping[str, Any]) -> str:
    return f"{words}" if len(fits) == 1 else f"{group}: {words}"


def _findings(fits: Fits, validations: Mapping[str, Validation]) -> list[str]:
    findings = [_named(group, validation.statement(), fits) for group, validation in validations.items()]
    for group, fit in fits.items():
        findings += [_named(group, fit.held_out.statement(), fits)] if fit.held_out is not None else []
        for words, name, value, _, interval, unit, mark in number_table(fit).rows:
            if name in fit.nuisances:
                continue  # of the log, not of the robot: they stand in the table
            plain = f"{words}, " if words else ""
            value_words = f" = {value} {unit}".rstrip() + f", 95 % {interval}" if interval else ""
            findings.append(_named(group, f"{plain}{name}{value_words}{f' ({mark})' if mark else ''}", fits))
    return findings


def _each(parts: Mapping[str, Any], content: Callable[[str, Any], str]) -> str:
    if len(parts) == 1:
        return "".join(content("", part) for part in parts.values())
    return "".join(paragraph(f"{group}:") + content(group, part) for group, part in parts.items())


def _with_bands(fits: Fits, group: str, validation: Validation) -> Bands:
    """The comparisons with fitted logs and with logs held out, each with the band of the model in its first log."""
    robot = (fits.get(group) or next(iter(fits.values()))).robot
    held_out = validation.held_out
    return with_fitted_band(validation.fitted, robot), held_out and with_fitted_band(held_out, robot)


def _runs(group: str, banded: Future[Bands]) -> str:
    fit_comparison, held_out = banded.result()
    pictures = [_renamed(draw_overlay(fit_comparison), f"overlay-fitted{group}", "on a log it was fitted to")]
    if held_out is not None:
        pictures.append(_renamed(draw_overlay(held_out), f"overlay-held-out{group}", "on a log held out"))
    return content(*pictures)


def _misfit(group: str, fit: OutputErrorEstimate) -> str:
    """Whether residuals hold more than noise, with a picture of it, and what would explain it."""
    lack = fit.lack_of_fit
    if lack is None or fit.not_followed:
        return paragraph("Not looked for: the fit was cut short, or the model does not follow the logs at all.")
    pictures = [draw_misfit(lack.pictures, _anchor(f"misfit-in-bins{group}"))] if lack.pictures else []
    return content(Points(lack.statements()), *pictures, *([lack.table()] if lack.remedies else []))


def _ladder(fit: OutputErrorEstimate) -> str:
    """Every model that the ladder fitted, and what it came to."""
    if fit.ladder is None:
        return ""
    return paragraph(sentence(str(fit.ladder.statement()))) + (content(fit.ladder.table()) if fit.ladder.rungs else "")


def _rests(_group: str, fit: OutputErrorEstimate) -> str:
    table = fit.diagnosis.table() if fit.diagnosis else None
    return content(table) if table else paragraph("On nothing that was taken as it stands.")


def _stability(_group: str, fit: OutputErrorEstimate) -> str:
    stability = fit.stability
    if stability is None or fit.not_followed:
        return paragraph("Not looked for: the fit was cut short, or the model does not follow the logs at all.")
    if not stability.found:
        return paragraph("No number differs between parts of the logs by more than its errors allow.")
    return content(Points(stability.statements()), *stability.tables())


def _measured(validations: Mapping[str, Validation]) -> list[tuple[str, Run]]:
    """(group, run) of every run that was compared, fitted or held out."""
    return [
        (group, run)
        for group, validation in validations.items()
        for comparison in (validation.fitted, validation.held_out)
        if comparison is not None
        for run in comparison.measured
    ]


def _driven(fits: Fits, validations: Mapping[str, Validation]) -> list[tuple[float, float] | None]:
    """The middle 90 % of the speeds of all logs, of each axis."""
    return driven([body_twist(run, fits[group].robot) for group, run in _measured(validations)])


def _paths(fits: Fits, validations: Mapping[str, Validation]) -> list[BodyPath]:
    all_paths = (path_of(run, fits[group].robot) for group, run in _measured(validations))
    return [path for path in all_paths if path is not None]


def _renamed(drawing: Picture, name: str, words: str) -> Picture:
    return replace(drawing, name=_anchor(name), title=f"{drawing.title}, {words}")


def _anchor(name: str) -> str:
    return "".join(c if c.isalnum() or c in "-_." else "-" for c in name)


def _residuals(group: str, fit: OutputErrorEstimate, validation: Validation) -> str:
    logs = [("fitted", validation.fitted, ", logs it was fitted to")]
    if validation.held_out is not None:
        logs.append(("held-out", validation.held_out, ", logs held out"))
    figures = []
    for role, comparison, words in logs:
        noise = _noise(fit, validation.scores[FITTED if role == "fitted" else HELD_OUT], comparison)
        figures.append(figure(draw_residuals(comparison, noise, _anchor(f"residuals-{role}{group}"), words)))
    return "".join(figures)


def _noise(fit: OutputErrorEstimate, scores: Mapping[str, Score], comparison: Comparison) -> dict[str, float]:
    """Component -> std of its errors where the model leaves nothing but noise, in SI.

    Of a counted angle the noise of the fit is that before its encoder rounds: rounding adds to it, and chi2 of the
    score, which allows for both, says how much.
    """
    noise = {}
    for key in comparison.channels:
        name, score = output_name(key), scores.get(key)
        if name not in fit.noise:
            continue
        noise[key] = fit.noise[name]
        if score is not None and score.chi2 and component_channel(key) in COUNTED:
            noise[key] = math.sqrt(float(np.mean(residuals_of(comparison, key) ** 2)) / score.chi2)
    return noise


def _correlations(fits: Fits) -> list[str]:
    blocks = []
    for group, fit in fits.items():
        drawing = draw_correlation(fit.correlation)
        title = _named(group, drawing.title, fits)
        blocks.append(figure(replace(drawing, name=_anchor(f"correlation{group}"), title=title)))
        remarks = [f"{name} is not identifiable from these logs" for name in fit.unidentifiable]
        blocks.append(bullets([_named(group, words, fits) for words in [*remarks, *fit.blind]]))
    return blocks


def _warnings(fits: Fits, validations: Mapping[str, Validation]) -> list[str]:
    words = [_named(group, warning, fits) for group, fit in fits.items() for warning in map(str, fit.warnings)]
    for validation in validations.values():
        for comparison in (validation.fitted, validation.held_out):
            words += map(str, comparison.warnings) if comparison is not None else ()
    return words
