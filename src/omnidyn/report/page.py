"""The page of the demo: every claim of the paper with its verdict, and the figures."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from omnidyn.paper.claims import RULE, Claim, ClaimVerdict, headlines, verdict_counts
from omnidyn.report.formulas import formula
from omnidyn.report.html import STYLE, Section, escaped, figure, page
from omnidyn.report.style import Picture

__all__ = ["SIGNS", "STYLE", "render_page"]

# Beside the colour, which is that of the short word: a reader who cannot see one has the other, and the words.
SIGNS = {
    "yes": "\N{CHECK MARK}",
    "mended": "\N{ALMOST EQUAL TO}",
    "no": "\N{MULTIPLICATION X}",
    "absent": "\N{EN DASH}",
    "other": "\N{RIGHTWARDS ARROW}",
}

# Which pictures stand beside the claims of which subject.
PICTURES_OF = {
    "Frames and wheels": ("fig1_robot",),
    "Friction, Table 2": ("fig3_friction",),
    "Steady speeds, Table 1": ("fig2_traces",),
    "Validation, section 4": ("fig4_steps", "fig5_dead_zone"),
    "How the tables fit together": ("fig6_reconcile",),
}


def render_page(
    title: str, introduction: str, claims: Sequence[Claim], pictures: Sequence[Picture], provenance: Mapping[str, Any]
) -> str:
    """The report as HTML: what came out, the rule, then every subject with its pictures and its claims.

    provenance: version ("omnidyn"), "command" and "inputs" (role, name, sha256).
    """
    subjects = dict.fromkeys(claim.subject for claim in claims)
    sections = [_subject(subject, claims, pictures) for subject in subjects]
    placed_pictures = {name for subject in subjects for name in PICTURES_OF.get(subject, ())}
    rest_pictures = [picture for picture in pictures if picture.name not in placed_pictures]
    rest_sections = [Section("figures", "Figures", "".join(map(figure, rest_pictures)))] if rest_pictures else []
    return page(title, introduction, [*sections, *rest_sections], provenance, lead=_lead(claims))


def _lead(claims: Sequence[Claim]) -> str:
    """Five lines, where the claims are those of the paper; how many have which verdict; the rule."""
    try:
        lines = headlines(claims)
    except KeyError:  # some claims only
        lines = []
    line_list = f'<ol class="lines">{"".join(f"<li>{formula(line)}</li>" for line in lines)}</ol>' if lines else ""
    return f'{line_list}{_counts(claims)}<p class="rule">{escaped(RULE)}</p>'


def _counts(claims: Sequence[Claim]) -> str:
    counts = verdict_counts(claims)
    parts = "".join(f"<li>{_badge(verdict)} <b>{number}</b></li>" for verdict, number in counts.items())
    return f'<ul class="counts">{parts}</ul>'


def _subject(subject: str, claims: Sequence[Claim], pictures: Sequence[Picture]) -> Section:
    """Pictures, then the claims that were judged, then those that were not."""
    own_claims = [claim for claim in claims if claim.subject == subject]
    figures = [figure(picture) for name in PICTURES_OF.get(subject, ()) for picture in pictures if picture.name == name]
    judged = [claim for claim in own_claims if claim.verdict.judged]
    apart = [claim for claim in own_claims if not claim.verdict.judged]
    rest = f"<h3>Nothing to judge</h3>{_table(apart)}" if apart else ""
    key = "".join(c if c.isalnum() else "-" for c in subject.lower()) or "claims"
    return Section(key, subject or "Claims", "".join(figures) + (_table(judged) if judged else "") + rest)


def _badge(verdict: ClaimVerdict) -> str:
    sign = SIGNS[verdict.short]
    return f'<span class="badge {verdict.short}"><span aria-hidden="true">{sign}</span> {escaped(verdict.value)}</span>'


def _table(claims: Sequence[Claim]) -> str:
    head = "".join(f'<th scope="col">{name}</th>' for name in ("Verdict", "Place", "Claim", "Printed", "Ours"))
    rows = "".join(map(_row, claims))
    return f'<div class="wide"><table class="claims"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _row(claim: Claim) -> str:
    cells = (
        _badge(claim.verdict),
        formula(claim.place),
        f"<b>{formula(claim.statement)}</b><p>{formula(claim.why)}</p>{_numbers(claim.numbers)}",
        formula(claim.printed),
        formula(claim.ours),
    )
    return f'<tr id="{escaped(claim.key)}">{"".join(f"<td>{cell}</td>" for cell in cells)}</tr>'


def _numbers(numbers: Mapping[str, Any]) -> str:
    """All that stands behind a claim, to the last digit."""
    if not numbers:
        return ""
    lines = (f"{name} = {json.dumps(value)}" for name, value in numbers.items())
    return f"<details><summary>numbers</summary><pre>{chr(10).join(map(escaped, lines))}</pre></details>"
