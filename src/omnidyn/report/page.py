"""The page of the demo: every claim of the paper with its verdict, and the figures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from omnidyn.paper.claim import Claim, ClaimVerdict
from omnidyn.report.html import STYLE, Section, figure, page
from omnidyn.report.style import Picture

__all__ = ["MARKS", "STYLE", "render_page"]

# Colour, word and sign: a reader who cannot see one has the others.
MARKS = {
    ClaimVerdict.REPRODUCED: ("yes", "\N{CHECK MARK}"),
    ClaimVerdict.CORRECTED: ("mended", "\N{ALMOST EQUAL TO}"),
    ClaimVerdict.NOT_REPRODUCED: ("no", "\N{MULTIPLICATION X}"),
}


def render_page(
    title: str, introduction: str, claims: Sequence[Claim], pictures: Sequence[Picture], provenance: Mapping[str, Any]
) -> str:
    """The report as HTML. provenance: version ("omnidyn"), "command" and "inputs" (role, name, sha256)."""
    sections = [
        Section("claims", "Claims", _table(claims)), Section("figures", "Figures", "".join(map(figure, pictures)))
    ]  # fmt: skip
    return page(title, introduction, sections, provenance, lead=_counts(claims))


def _counts(claims: Sequence[Claim]) -> str:
    parts = []
    for verdict in ClaimVerdict:
        number = sum(claim.verdict == verdict for claim in claims)
        parts.append(f"<li>{_badge(verdict)} <b>{number}</b></li>")
    return f'<ul class="counts">{"".join(parts)}</ul>'


def _badge(verdict: ClaimVerdict) -> str:
    colour, sign = MARKS[verdict]
    return f'<span class="badge {colour}"><span aria-hidden="true">{sign}</span> {escape(verdict.value)}</span>'


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
