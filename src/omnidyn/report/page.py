"""The page of the demo: every claim of the paper with its verdict, and the figures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from omnidyn.paper.claims import Claim, Verdict, verdict_counts
from omnidyn.report.html import STYLE, Section, figure, page
from omnidyn.report.style import Picture

__all__ = ["SIGNS", "STYLE", "render_page"]

# Beside the colour, which is that of the short word: a reader who cannot see one has the other, and the words.
SIGNS = {"yes": "\N{CHECK MARK}", "mended": "\N{ALMOST EQUAL TO}", "no": "\N{MULTIPLICATION X}"}


def render_page(
    title: str, introduction: str, claims: Sequence[Claim], pictures: Sequence[Picture], provenance: Mapping[str, Any]
) -> str:
    """The report as HTML. provenance: version ("omnidyn"), "command" and "inputs" (role, name, sha256)."""
    sections = [
        Section("claims", "Claims", _table(claims)), Section("figures", "Figures", "".join(map(figure, pictures)))
    ]  # fmt: skip
    return page(title, introduction, sections, provenance, lead=_counts(claims))


def _counts(claims: Sequence[Claim]) -> str:
    counts = verdict_counts(claims)
    parts = "".join(f"<li>{_badge(verdict)} <b>{number}</b></li>" for verdict, number in counts.items())
    return f'<ul class="counts">{parts}</ul>'


def _badge(verdict: Verdict) -> str:
    sign = SIGNS[verdict.short]
    return f'<span class="badge {verdict.short}"><span aria-hidden="true">{sign}</span> {escape(verdict.value)}</span>'


def _table(claims: Sequence[Claim]) -> str:
    head = "".join(f'<th scope="col">{name}</th>' for name in ("Verdict", "Place", "Claim", "Printed", "Ours"))
    rows = "".join(map(_row, claims))
    return f'<div class="wide"><table class="claims"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _row(claim: Claim) -> str:
    cells = (
        _badge(claim.verdict),
        escape(claim.place),
        f"<b>{escape(claim.statement)}</b><p>{escape(claim.why)}</p>{_numbers(claim.numbers)}",
        escape(claim.printed),
        escape(claim.ours),
    )
    return f'<tr id="{escape(claim.key, quote=True)}">{"".join(f"<td>{cell}</td>" for cell in cells)}</tr>'


def _numbers(numbers: Mapping[str, Any]) -> str:
    """All that stands behind a claim, to the last digit."""
    if not numbers:
        return ""
    lines = (f"{name} = {json.dumps(value)}" for name, value in numbers.items())
    return f"<details><summary>numbers</summary><pre>{escape(chr(10).join(lines))}</pre></details>"
