"""The result of `omnidyn identify` on one screen."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from omnidyn.cli.terminal.telling import brief_document
from omnidyn.document import Document, Table, Words, interval_cell, sentence

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.identification import Identification


def brief(result: Identification) -> Document:
    """What the result says in about 20 lines: verdict, numbers, the gravest warnings, the next step."""
    groups = len(result.groups)
    rows = [row for group, estimate in result.groups.items() for row in _rows(group, estimate, groups)]
    of_study = result.study.warnings if result.study is not None else ()
    warnings = [*of_study, *(warning for estimate in result.groups.values() for warning in estimate.warnings)]
    table = Table(("number", "value", "95 % interval", "unit", "key"), rows, "<>><<")
    blocks = [fit.held_out.statement() for fit in result.fits.values() if fit.held_out is not None]
    head = [Words(sentence(str(statement))) for statement in blocks]
    return brief_document(result.headline, table, warnings, result.advice, head)


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
