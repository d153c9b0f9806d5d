"""The result of `omnidyn identify` on one screen: verdict, numbers, the gravest warnings, the next step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from omnidyn.document import WIDTH, Document, Table, Words, interval_cell
from omnidyn.statement import ERROR, WARNING

if TYPE_CHECKING:
    from omnidyn.identification.estimate import Estimate
    from omnidyn.identification.identify import Identification

LINES = 20  # on stdout; the columns of a log and the files written are a few more on stderr
ROWS, WARNINGS, STEPS = 12, 3, 2  # numbers, warnings and next steps that are shown, where there is room
SPARE = 4  # lines: two empty ones, the head of the table, what is left out
Row = tuple[str, ...]


class Brief(Document):
    """A document without explanations of its terms: `--full` has them."""

    def legend(self) -> list[str]:
        """No lines."""
        return []


def brief(found: Identification) -> Document:
    """What the result says in about LINES lines."""
    rows = [row for group, estimate in found.estimates.items() for row in _rows(group, estimate, len(found.estimates))]
    of_study = found.study.warnings if found.study is not None else ()
    every = dict.fromkeys([*of_study, *(one for estimate in found.estimates.values() for one in estimate.warnings)])
    grave = [one for severity in (ERROR, WARNING) for one in every if one.severity == severity]
    table = Table(("number", "value", "95 % interval", "unit", "key"), rows[:ROWS], "<>><<")
    room = LINES - SPARE - len([*Words(found.headline).lines(WIDTH, _bare)]) - len(table.rows)
    warnings = _that_fit([f"{one.severity}: {one}" for one in grave[:WARNINGS]], room - 2 * bool(found.advice))
    steps = _that_fit([f"next: {one}" for one in found.advice[:STEPS]], room - _height(warnings))
    left = {
        "number": len(rows) - len(table.rows), "warning": len(grave) - len(warnings), "note": len(every) - len(grave),
        "next step": len(found.advice) - len(steps),
    }  # fmt: skip
    more = ", ".join(f"{count} more {what}{'s' * (count > 1)}" for what, count in left.items() if count > 0)
    last = f"--full shows all{f': {more}' if more else ''}."
    return Brief(
        [table, "", *(Words(text, rest="  ") for text in (*warnings, *steps)), last], ascii=True, verdict=found.headline
    )


def _rows(group: str, estimate: Estimate, groups: int) -> Iterator[Row]:
    """The numbers of a group, those of the log after those of the robot."""
    from omnidyn.identification.estimate import NOT_DETERMINED
    from omnidyn.identification.output_error.answer import OutputErrorEstimate
    from omnidyn.model.keys import in_words, unit

    of = f" in {group}" if groups > 1 else ""
    for name, value in estimate.value.items():
        known = NOT_DETERMINED if name in estimate.unidentifiable else interval_cell(estimate.ci95[name])
        yield f"{in_words(name)}{of}", f"{value:.4g}", known, unit(name), name
    if isinstance(estimate, OutputErrorEstimate):
        for name, own in estimate.nuisances.items():
            known = NOT_DETERMINED if name in estimate.unidentifiable else interval_cell(own.ci95)
            yield f"{name} of the log{of}", f"{own.value:.4g}", known, own.unit, ""


def _that_fit(texts: Sequence[str], room: int) -> list[str]:
    """The first of some texts, as many as take no more than so many lines; the gravest one always."""
    kept = list[str]()
    for text in texts:
        if kept and _height([*kept, text]) > room:
            break
        kept.append(text)
    return kept


def _height(texts: Sequence[str]) -> int:
    return sum(len([*Words(text, rest="  ").lines(WIDTH, _bare)]) for text in texts)


def _bare(word: str, tone: str) -> str:
    return word
