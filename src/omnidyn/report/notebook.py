"""A Document as the HTML that a notebook shows: the tables, lists and words of a page, in the style of the notebook."""

from __future__ import annotations

from omnidyn.document import Document, Points, Table, Words
from omnidyn.report.html import bullets, paragraph, table


def document_html(document: Document) -> str:
    """The parts of a document, one after the other; every text is escaped."""
    return f"<div>{''.join(map(_part, document.parts))}</div>"


def _part(part: str | Words | Points | Table) -> str:
    if isinstance(part, Table):
        return table(part.head, part.rows)
    if isinstance(part, Points):
        return bullets([*map(str, part.words)])
    words = f"{part.first}{part.text}".strip() if isinstance(part, Words) else part
    return paragraph(words) if words else ""
