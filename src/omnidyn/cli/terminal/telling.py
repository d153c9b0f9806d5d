"""How a result is told: to people as text, to machines as values, with where they were written and made from."""

from __future__ import annotations

from typing import Any, NoReturn

import typer

from omnidyn.cli.terminal.streams import painted, say, show, show_json
from omnidyn.document import WIDTH, Document, sentence

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
