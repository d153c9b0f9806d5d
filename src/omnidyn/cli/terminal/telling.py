"""How a result is told: to people as text, to machines as values, with where they were written and made from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any, NoReturn

import typer

from omnidyn.cli.terminal.streams import painted, say, show, show_json
from omnidyn.document import WIDTH, Document, Table, Words, sentence
from omnidyn.statement import ERROR, WARNING, Statement

BRIEF_LINES = 20  # on stdout; the columns of a log and the files written are a few more on stderr
BRIEF_ROWS, BRIEF_WARNINGS, BRIEF_STEPS = 12, 3, 2  # the most of each, where there is room
SPARE_LINES = 4  # two empty ones, the head of the table, what is left out
FAILED = 4  # the result is written, and it means nothing


def end_failed(verdict: object) -> NoReturn:
    """End with exit code 4 a command whose result, written and shown, means nothing; `verdict` says why."""
    say(f"omnidyn: {verdict if isinstance(verdict, str) else sentence(str(verdict))}")
    raise typer.Exit(FAILED)


def as_json(document: Document, record: dict[str, Any], **written: Any) -> dict[str, Any]:
    """The result for machines. record: its provenance; written: which files hold what."""
    verdict = {"verdict": document.verdict_text} if document.verdict else {}
    return {**verdict, **document.data, **written, "provenance": record}


def tell(document: Document, json: bool, record: dict[str, Any], *, width: int = WIDTH, **written: Any) -> None:
    """The result, to stdout. What a reader of the JSON alone must know is said on stderr too."""
    if json:
        for warning in dict.fromkeys(document.warnings):
            say(f"omnidyn: warning: {warning}")
        show_json(as_json(document, record, **written))
    else:
        show(document.to_text(width, painted))


class Brief(Document):
    """A document without explanations of its terms: `--full` has them."""

    def legend(self) -> list[str]:
        """No lines."""
        return []


def brief_document(
    verdict: object,
    table: Table,
    warnings: Iterable[Statement],
    advice: Sequence[object] = (),
    head: Sequence[Words] = (),
    row_word: str = "number",
) -> Document:
    """A result on one screen: verdict, table, the gravest warnings, the next step, and how much `--full` adds.

    Args:
        verdict: the result in a sentence, text or a statement.
        table: all rows; the first BRIEF_ROWS are shown.
        warnings: of all severities; notes are only counted.
        advice: next steps, the best first.
        head: what stands before the table.
        row_word: what a row of the table is, in the singular.
    """
    statements = dict.fromkeys(warnings)
    grave = [warning for severity in (ERROR, WARNING) for warning in statements if warning.severity == severity]
    brief_table = replace(table, rows=table.rows[:BRIEF_ROWS])
    title = Document((), verdict=verdict).verdict_lines(WIDTH)
    room = BRIEF_LINES - SPARE_LINES - len(title) - _height(head) - len(brief_table.rows)
    worst = [Words(f"{warning.severity}: {warning}", rest="  ") for warning in grave[:BRIEF_WARNINGS]]
    worst = _that_fit(worst, room - 2 * bool(advice))
    steps = _that_fit([Words(f"next: {step}", rest="  ") for step in advice[:BRIEF_STEPS]], room - _height(worst))
    hidden = {
        row_word: len(table.rows) - len(brief_table.rows),
        "warning": len(grave) - len(worst),
        "note": len(statements) - len(grave),
        "next step": len(advice) - len(steps),
    }
    counts = ", ".join(f"{count} more {name}{'s' * (count > 1)}" for name, count in hidden.items() if count > 0)
    last = f"--full shows all{f': {counts}' if counts else ''}."
    return Brief([*head, brief_table, "", *worst, *steps, last], ascii=True, verdict=verdict)


def _that_fit(paragraphs: Sequence[Words], room: int) -> list[Words]:
    """The first paragraphs that take no more than so many lines together; the gravest one always."""
    fitting = list[Words]()
    for paragraph in paragraphs:
        if fitting and _height([*fitting, paragraph]) > room:
            break
        fitting.append(paragraph)
    return fitting


def _height(paragraphs: Sequence[Words]) -> int:
    return sum(len([*paragraph.lines(WIDTH, lambda word, _: word)]) for paragraph in paragraphs)
