"""The result of `omnidyn identify` on one screen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from omnidyn.cli.terminal.telling import brief_document
from omnidyn.document import Document, Points, Table, Words, apart, interval_cell, percent_cell, sentence

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.identification import Identification
    from omnidyn.identification.planning.got import Got
    from omnidyn.statement import Statement


Beside = Mapping[str, Mapping[str, "Got"]]  # group -> key -> what a plan promised and what the fit has


def brief(result: Identification, planned: Beside | None = None) -> Document:
    """What the result says in about 20 lines: verdict, numbers, the gravest warnings, the next step."""
    groups, head, align = len(result.groups), ["number", "value", "95 % interval", "unit", "key"], "<>><<"
    rows = [row for group, estimate in result.groups.items() for row in _rows(group, estimate, groups)]
    if planned:
        head, align = [*head[:3], "planned, got +- %", *head[3:]], "<>>><<"
        of_row = [planned[group] for group, estimate in result.groups.items() for _ in _rows(group, estimate, groups)]
        rows = [(*row[:3], _promised_cell(of.get(row[-1])), *row[3:]) for row, of in zip(rows, of_row, strict=True)]
    of_study = result.study.warnings if result.study is not None else ()
    of_plan = _wider(planned) if planned else []
    warnings = [*of_plan, *of_study, *(warning for estimate in result.groups.values() for warning in estimate.warnings)]
    table = Table(head, rows, align)
    blocks = [fit.held_out.statement() for fit in result.fits.values() if fit.held_out is not None]
    words = [Words(sentence(str(statement))) for statement in blocks]
    return brief_document(result.headline, table, warnings, result.advice, words)


def with_plan(document: Document, planned: Beside) -> Document:
    """All that a result says, and what a plan promised beside it."""
    rows = [
        (group, name, percent_cell(one.planned), percent_cell(one.worst), percent_cell(one.got))
        for group, numbers in planned.items()
        for name, one in numbers.items()
    ]
    table = Table(("group", "key", "95 % planned +- %", "worst %", "got %"), rows, "<<>", name="planned")
    data = {group: {name: one._asdict() for name, one in numbers.items()} for group, numbers in planned.items()}
    wider = _wider(planned)
    points = [Points(wider, mark="", name="wider than planned")] if wider else []
    data = {**document.data, "planned": data, "planned_warnings": [statement.to_dict() for statement in wider]}
    return replace(
        document, parts=apart(document.parts, [table], points), data=data, warnings=[*wider, *document.warnings]
    )


def _wider(planned: Beside) -> list[Statement]:
    """What is known much less well than planned."""
    from omnidyn.identification.planning.got import wider_of_groups

    return wider_of_groups(planned)


def _promised_cell(of: Got | None) -> str:
    """What a plan promised and what the fit has [%]; nothing for a number that it does not speak of."""
    return "" if of is None else f"{percent_cell(of.planned)}, {percent_cell(of.got)}"


def _rows(group: str, estimate: Estimate, groups: int) -> Iterator[tuple[str, ...]]:
    """The numbers of a group, those of the log after those of the robot."""
    from omnidyn.identification.estimate import NOT_DETERMINED
    from omnidyn.identification.output_error.answer import OutputErrorEstimate
    from omnidyn.model.keys import in_words, unit

    of = f" in {group}" if groups > 1 else ""
    for name, value in estimate.value.items():
        interval = NOT_DETERMINED if name in estimate.unidentifiable else interval_cell(estimate.ci95[name])
        yield f"{in_words(name)}{of}", f"{value:.4g}", interval, unit(name), name
    if isinstance(estimate, OutputErrorEstimate):
        for name, nuisance in estimate.nuisances.items():
            interval = NOT_DETERMINED if name in estimate.unidentifiable else interval_cell(nuisance.ci95)
            yield f"{name} of the log{of}", f"{nuisance.value:.4g}", interval, nuisance.unit, ""
