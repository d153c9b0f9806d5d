"""Parts of a page that needs nothing else: no script, no request, every text escaped, the style fixed by its hash."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from omnidyn.document import Points, Table, in_clauses
from omnidyn.errors import printable
from omnidyn.report.style import Picture

WORDS = 24  # characters of a cell that is wrapped
STYLE = (Path(__file__).parent / "page.css").read_text("utf-8")


def escaped(text: str) -> str:
    """A text as HTML shows it, in an attribute too: nothing in it is HTML, turns letters around or ends a line."""
    return escape(printable(text), quote=True)


@dataclass(frozen=True)
class Section:
    """A part of the page with a heading: key (its anchor), title, and content that is HTML already."""

    key: str
    title: str
    content: str


def section(key: str, title: str, *parts: Table | Points | Picture, none: str = "") -> Section:
    """A part of the page with tables, lists and pictures; `none` stands there where they hold nothing."""
    return Section(key, title, content(*parts) or (paragraph(none) if none else ""))


def content(*parts: Table | Points | Picture) -> str:
    """Tables, lists and pictures, one after the other."""
    return "".join(
        figure(part)
        if isinstance(part, Picture)
        else table(part.head, part.rows)
        if isinstance(part, Table)
        else bullets([*map(str, part.words)])
        for part in parts
    )


def page(
    title: str,
    introduction: str,
    sections: Sequence[Section],
    provenance: Mapping[str, Any],
    *,
    lead: str = "",
    verdict: str = "",
    screen: str = "",
) -> str:
    """The page as HTML. verdict: the result in a sentence, before all else. lead: HTML between introduction and links.
    screen: HTML right behind the verdict, for the first screen.

    provenance: version ("omnidyn"), "command" and "inputs" (role, name, sha256); it is the last section.
    """
    all_sections = [*sections, Section("made", "How this was made", provenance_table(provenance))]
    links = "".join(f'<a href="#{escaped(part.key)}">{escaped(part.title)}</a>' for part in all_sections)
    line, clauses = in_clauses(verdict)
    first = f"<p><strong>{escaped(line)}</strong></p>" if verdict else ""
    first += f"<ul>{''.join(f'<li>{escaped(clause)}</li>' for clause in clauses)}</ul>" if clauses else ""
    words = f"<p>{escaped(introduction)}</p>" if introduction else ""
    head = f"<header><h1>{escaped(title)}</h1>{first}{screen}{words}{lead}<nav>{links}</nav></header>"
    parts = (
        f'<section id="{escaped(part.key)}"><h2>{escaped(part.title)}</h2>{part.content}</section>'
        for part in all_sections
    )
    return _document(title, head + "".join(parts))


def _document(title: str, body: str) -> str:
    style_hash = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'sha256-{style_hash}'; base-uri 'none'; form-action 'none'"
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,">'
        f"<title>{escaped(title)}</title><style>{STYLE}</style></head>\n<body><main>{body}</main></body></html>\n"
    )


def beside(left: str, right: str) -> str:
    """Two parts side by side, where the screen is wide enough."""
    return f'<div class="beside"><div>{left}</div><div>{right}</div></div>'


def table(head: Sequence[str], rows: Sequence[Sequence[str]], name: str = "plain") -> str:
    """A table of plain text; `name` is its class in page.css."""
    top = "".join(f'<th scope="col">{escaped(cell)}</th>' for cell in head)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    return f'<div class="wide"><table class="{name}"><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table></div>'


def _cell(text: str) -> str:
    """A cell; one of many words is wrapped."""
    kind = ' class="words"' if len(text) > WORDS else ""
    return f"<td{kind}>{escaped(text)}</td>"


def bullets(words: Sequence[str]) -> str:
    """A list of sentences; nothing where there are none."""
    return f"<ul>{''.join(f'<li>{escaped(sentence)}</li>' for sentence in words)}</ul>" if words else ""


def paragraph(words: str) -> str:
    """One paragraph of plain text."""
    return f"<p>{escaped(words)}</p>"


def figure(picture: Picture) -> str:
    """A picture with its title and caption, inside the page; a box to tick makes it large, and scrolls it."""
    data = base64.b64encode(picture.svg).decode()
    name = escaped(picture.name)
    image = f'<img alt="{escaped(picture.caption)}" src="data:image/svg+xml;base64,{data}">'
    zoom = f'<input type="checkbox" class="zoom" id="zoom-{name}"><label for="zoom-{name}">large</label>'
    words = f"<b>{escaped(picture.title)}.</b> {escaped(picture.caption)}"
    frame = f'<div class="frame" tabindex="0">{image}</div>'
    return f'<figure id="{name}">{zoom}{frame}<figcaption>{words}</figcaption></figure>'


SHOWN_INPUTS = 20


def provenance_table(provenance: Mapping[str, Any]) -> str:
    """Version, command and inputs with their hashes; many logs of one folder fold up."""
    rows = [("omnidyn", provenance["omnidyn"]), ("command", provenance["command"])]
    inputs = [(source["role"], f"{source['name']}, sha256 {source['sha256']}") for source in provenance["inputs"]]
    if len(inputs) <= SHOWN_INPUTS:
        return _made([*rows, *inputs])
    return _made(rows) + f"<details><summary>{len(inputs)} inputs with their hashes</summary>{_made(inputs)}</details>"


def _made(rows: Sequence[tuple[str, str]]) -> str:
    cells = (
        f'<tr><th scope="row">{escaped(name)}</th><td><code>{escaped(text)}</code></td></tr>' for name, text in rows
    )
    return f'<table class="made">{"".join(cells)}</table>'
