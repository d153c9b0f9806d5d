"""One HTML file that needs nothing else: no script, no request, every text escaped, the style fixed by its hash."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from omnidyn.paper.claim import Claim, Verdict
from omnidyn.report.style import Picture

STYLE = (Path(__file__).parent / "page.css").read_text("utf-8")

# Colour, word and sign: a reader who cannot see one has the others.
MARKS = {
    Verdict.REPRODUCED: ("yes", "\N{CHECK MARK}"),
    Verdict.CORRECTED: ("mended", "\N{ALMOST EQUAL TO}"),
    Verdict.NOT_REPRODUCED: ("no", "\N{MULTIPLICATION X}"),
}


def render_page(
    title: str, introduction: str, claims: Sequence[Claim], pictures: Sequence[Picture], provenance: Mapping[str, Any]
) -> str:
    """The report as HTML. provenance: version ("omnidyn"), "command" and "inputs" (role, name, sha256)."""
    body = [
        f"<header><h1>{escape(title)}</h1><p>{escape(introduction)}</p>{_counts(claims)}{_links()}</header>",
        f'<section id="claims"><h2>Claims</h2>{_table(claims)}</section>',
        f'<section id="figures"><h2>Figures</h2>{"".join(map(_figure, pictures))}</section>',
        f'<section id="made"><h2>How this was made</h2>{_provenance(provenance)}</section>',
    ]
    return _document(title, "".join(body))


def _document(title: str, body: str) -> str:
    allowed = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'sha256-{allowed}'; base-uri 'none'; form-action 'none'"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body><main>{body}</main></body></html>\n"
    )


def _counts(claims: Sequence[Claim]) -> str:
    parts = []
    for verdict in Verdict:
        number = sum(claim.verdict == verdict for claim in claims)
        parts.append(f"<li>{_badge(verdict)} <b>{number}</b></li>")
    return f'<ul class="counts">{"".join(parts)}</ul>'


def _links() -> str:
    places = {"claims": "Claims", "figures": "Figures", "made": "How this was made"}
    links = (f'<a href="#{place}">{words}</a>' for place, words in places.items())
    return f"<nav>{''.join(links)}</nav>"


def _badge(verdict: Verdict) -> str:
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


def _figure(picture: Picture) -> str:
    data = base64.b64encode(picture.svg).decode()
    image = f'<img alt="{escape(picture.caption, quote=True)}" src="data:image/svg+xml;base64,{data}">'
    words = f"<b>{escape(picture.title)}.</b> {escape(picture.caption)}"
    return f'<figure id="{escape(picture.name, quote=True)}">{image}<figcaption>{words}</figcaption></figure>'


def _provenance(provenance: Mapping[str, Any]) -> str:
    rows = [("omnidyn", provenance["omnidyn"]), ("command", provenance["command"])]
    for each in provenance["inputs"]:
        rows.append((each["role"], f"{each['name']}, sha256 {each['sha256']}"))
    cells = (f'<tr><th scope="row">{escape(name)}</th><td><code>{escape(text)}</code></td></tr>' for name, text in rows)
    return f'<table class="made">{"".join(cells)}</table>'
